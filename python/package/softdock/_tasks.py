"""Diagnosis and identification from recordings."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from typing import Any, Iterable

from softdock._command import PathLike, answer


class Report:
    """Answer of a diagnosis or an identification.

    Attributes
    ----------
    data : dict
        The answer of the command with ``--json``.
    path : pathlib.Path
        Folder of its files.
    """

    def __init__(self, data: dict[str, Any], path: Path) -> None:
        self.data = data
        self.path = path

    @property
    def pages(self) -> list[Path]:
        """The pages of the answer."""
        return sorted(self.path.glob("*.html"))

    def __repr__(self) -> str:
        return f"<softdock.Report in {self.path}: {', '.join(sorted(self.data))}>"

    def _repr_html_(self) -> str:
        links = " ".join(f"<a href='{escape(page.as_uri(), quote=True)}'>{escape(page.name)}</a>" for page in self.pages)
        return f"<p>{links}</p><pre>{escape(json.dumps(self.data, indent=2)[:4000])}</pre>"


def _options(names: dict[str, object]) -> list[PathLike]:
    """Keywords as options of the command: ``hold_out=0.3`` is ``--hold-out 0.3``."""
    words: list[PathLike] = []
    for name, value in names.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif isinstance(value, (list, tuple)):
            words.extend([option, *map(str, value)])
        elif value is not None and value is not False:
            words.extend([option, str(value)])
    return words


def diagnose(
    model: PathLike, logs: Iterable[PathLike], *, out: PathLike | None = None, **options: object
) -> Report:
    """Name the causes of deviations between recordings and a model.

    Parameters
    ----------
    model : path
        Campaign or rig file.
    logs : iterable of paths
        Recordings.
    out : path, optional
        Folder of the answer; ``results/diagnose_NAME`` if not given.
    **options
        Options of ``softdock diagnose``: ``holdout=[...]``, ``seed=1``.

    Raises
    ------
    SoftdockError
        If a file is wrong.
    """
    folder = Path(out) if out is not None else Path("results") / f"diagnose_{Path(model).stem}"
    return Report(answer(["diagnose", model, *logs, *_options(options), "--out", folder]), folder)


def identify(
    system: str, model: PathLike, logs: Iterable[PathLike] = (), *, out: PathLike | None = None, **options: object
) -> Report:
    """Identify a robot or a contact from recordings.

    Parameters
    ----------
    system : {"robot", "contact"}
        What is identified.
    model : path
        Robot model file or rig file.
    logs : iterable of paths
        Recordings.
    out : path, optional
        Folder of the answer; ``results/identify_NAME`` if not given.
    **options
        Options of ``softdock identify``: ``hold_out=0.3``, ``validate=[...]``, ``design=True``.

    Raises
    ------
    SoftdockError
        If a file is wrong.
    """
    folder = Path(out) if out is not None else Path("results") / f"identify_{Path(model).stem}"
    given = list(logs)
    if system == "robot":
        words: list[PathLike] = ["identify", "robot", model, *given]
    elif system == "contact":
        words = ["identify", "contact", model, "--data", *given]
    else:
        raise ValueError(f'system is {system!r}; write "robot" or "contact"')
    return Report(answer([*words, *_options(options), "--out", folder]), folder)
