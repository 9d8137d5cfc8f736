"""Tables as CSV, HDF5 and MAT files."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softdock._table import Table

#: A spreadsheet takes a text that begins with one of these for a formula.
FORMULA = ("=", "+", "-", "@", "\t", "\r")

#: Longest name of a field in MATLAB.
MAT_NAME = 63


def _prepared(path: str | os.PathLike[str]) -> Path:
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def to_csv(table: Table, path: str | os.PathLike[str]) -> None:
    """A line of names, then a line per row; texts never begin like a formula."""
    names = [column.name for column in table.columns]
    with _prepared(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for row in zip(*(table[name] for name in names)):
            writer.writerow([_cell(value) for value in row])


def _cell(value: object) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str) and value.startswith(FORMULA):
        return "'" + value
    return value


def _array(values: list[Any]) -> Any:
    """Numbers with NaN where one is missing, truth values as 1, 0 and -1 for missing, or texts."""
    import numpy

    known = next((value for value in values if value is not None), 0.0)
    if isinstance(known, bool):
        return numpy.array([-1 if value is None else int(value) for value in values], dtype="int8")
    if isinstance(known, str):
        return numpy.array(values, dtype=object)
    if isinstance(known, int):
        return numpy.array(values, dtype="int64")
    return numpy.array([float("nan") if value is None else value for value in values])


def to_hdf5(table: Table, path: str | os.PathLike[str], group: str) -> None:
    """A dataset per column below a group, with the attributes ``unit`` and ``description``."""
    import h5py

    with h5py.File(_prepared(path), "a") as file:
        if group in file:
            raise ValueError(f"{os.fspath(path)} has a group {group!r} already")
        place = file.create_group(group)
        for column in table.columns:
            array = _array(table[column.name])
            kind = h5py.string_dtype() if array.dtype == object else None
            dataset = place.create_dataset(column.name, data=array, dtype=kind)
            dataset.attrs["unit"] = column.unit
            dataset.attrs["description"] = column.meaning


def to_mat(table: Table, path: str | os.PathLike[str], name: str) -> None:
    """A structure with a field per column, and one with the units behind it."""
    from scipy.io import savemat

    long = [column.name for column in table.columns if len(column.name) > MAT_NAME]
    if long:
        raise ValueError(f"MATLAB has no names of more than {MAT_NAME} letters: {', '.join(long)}; leave them out")
    fields = {column.name: _array(table[column.name]) for column in table.columns}
    units = {column.name: column.unit for column in table.columns}
    data = {name: fields, f"{name}_units": units}
    savemat(_prepared(path), data, appendmat=False, long_field_names=True, oned_as="column")
