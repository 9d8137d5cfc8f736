"""Tables of results."""

from __future__ import annotations

import os
from html import escape
from typing import Any, Iterator, NamedTuple

from softdock import _export, _softdock

SHOWN_ROWS = 10


class Column(NamedTuple):
    """What a column holds."""

    name: str
    unit: str
    meaning: str


class Table:
    """A table, read only, in the memory of softdock.

    Readers of the Arrow PyCapsule interface take it without a copy: ``polars.DataFrame(table)``,
    ``pyarrow.table(table)``, ``duckdb.sql("from runs")`` (with ``runs`` a table).

    Attributes
    ----------
    columns : list of Column
        Name, unit and meaning of every column.
    """

    def __init__(self, native: _softdock.Table) -> None:
        self._native = native
        self.columns = [Column(*column) for column in native.columns]

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._native.__arrow_c_stream__(requested_schema)

    def __len__(self) -> int:
        return len(self._native)

    def __getitem__(self, column: str) -> list[Any]:
        """Values of a column; ``None`` where one is missing."""
        return self._native[column]

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Rows, each as a dictionary."""
        values = {column.name: self[column.name] for column in self.columns}
        for row in range(len(self)):
            yield {name: column[row] for name, column in values.items()}

    def unit(self, column: str) -> str:
        """Unit of a column; ``"1"`` for a pure number."""
        for known in self.columns:
            if known.name == column:
                return known.unit
        raise KeyError(column)

    def to_pyarrow(self) -> Any:
        """The table as a ``pyarrow.Table``."""
        import pyarrow

        return pyarrow.table(self)

    def to_pandas(self) -> Any:
        """The table as a ``pandas.DataFrame``."""
        return self.to_pyarrow().to_pandas()

    def to_polars(self) -> Any:
        """The table as a ``polars.DataFrame``."""
        import polars

        return polars.DataFrame(self)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV file: a line of names, then a line per row. Missing values are empty."""
        _export.to_csv(self, path)

    def to_hdf5(self, path: str | os.PathLike[str], group: str = "table") -> None:
        """Write a dataset per column into a group of an HDF5 file, with unit and description as attributes.

        Missing numbers are NaN, missing truth values -1. Needs ``h5py``.
        """
        _export.to_hdf5(self, path, group)

    def to_mat(self, path: str | os.PathLike[str], name: str = "table") -> None:
        """Write a structure with a field per column, and ``NAME_units``, into a MAT file. Needs ``scipy``."""
        _export.to_mat(self, path, name)

    def __repr__(self) -> str:
        names = ", ".join(column.name for column in self.columns[:6])
        more = f", ... ({len(self.columns)} columns)" if len(self.columns) > 6 else ""
        return f"<softdock.Table {len(self)} rows: {names}{more}>"

    def _repr_html_(self) -> str:
        shown = self.columns[:12]
        values = [self[column.name][:SHOWN_ROWS] for column in shown]
        head = "".join(f"<th title='{escape(c.meaning, quote=True)}'>{escape(c.name)}</th>" for c in shown)
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(_text(value))}</td>" for value in row) + "</tr>" for row in zip(*values)
        )
        rest = f"{len(self)} rows, {len(self.columns)} columns"
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table><p>{rest}</p>"


def _text(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
