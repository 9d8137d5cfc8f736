"""Results folders: verdict, runs, causes, agreement, time histories."""

from __future__ import annotations

import json
import os
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, Literal, Sequence

from softdock import _softdock
from softdock._table import Table
from softdock._trace import Trace

Units = Literal["SI", "author"]
Loop = Literal["space", "facility"]


def _is_author(units: Units) -> bool:
    if units not in ("SI", "author"):
        raise ValueError(f'units is {units!r}; write "SI" or "author"')
    return units == "author"


class Results:
    """The results of a campaign. Use :func:`softdock.open` or :meth:`softdock.Campaign.run`.

    Attributes
    ----------
    path : pathlib.Path
        The results folder.
    incomplete : str or None
        Why runs are missing, if the call that made them was stopped.
    """

    def __init__(self, path: str | os.PathLike[str], *, incomplete: str | None = None) -> None:
        self._native = _softdock.NativeResults(path)
        self.path = Path(self._native.path)
        self.incomplete = incomplete

    @property
    def id(self) -> str:
        """Id of the campaign."""
        return self._native.id

    @property
    def title(self) -> str:
        """Title of the campaign."""
        return self._native.title

    @cached_property
    def _shown(self) -> tuple[str, dict[str, Any], str]:
        kind, data, text = self._native.summary()
        return kind, json.loads(data) or {}, text

    @property
    def summary(self) -> dict[str, Any]:
        """The content of ``summary.json`` without the hash of the files, or of ``compare.json`` for a campaign with
        variants; empty without runs."""
        return self._shown[1]

    @property
    def verdict(self) -> str:
        """``"verified"``, ``"not_verified"``, or ``"undecided"`` where runs are missing or are no independent sample.

        Raises
        ------
        SoftdockError
            For a campaign with variants: each has its verdict, see :attr:`variants`.
        """
        kind, data, _ = self._shown
        if kind == "compare":
            raise _softdock.SoftdockError(
                f"{self.path} holds the variants {', '.join(self.variants)}: each has a verdict of its own\n"
                "  help: results.variants[NAME].verdict"
            )
        return str(data.get("verdict", "undecided"))

    @cached_property
    def variants(self) -> dict[str, Results]:
        """Results of the campaign's variants by name; empty without variants."""
        return {name: Results(self.path / name) for name in self._native.variants if (self.path / name).is_dir()}

    @property
    def report(self) -> Path:
        """The page of the results."""
        return self.path / ("compare.html" if self._native.variants else "report.html")

    def runs(
        self, columns: Sequence[str] | None = None, *, varied: bool = False, units: Units = "SI"
    ) -> Table:
        """The runs, one row each.

        Parameters
        ----------
        columns : sequence of str, optional
            Names of columns; all if not given.
        varied : bool
            Leave out inputs that are the same in every run.
        units : {"SI", "author"}
            ``"author"`` converts what the campaign file writes in other units, and renames these columns:
            ``in_loop_delay_s`` is then ``in_loop_delay_ms``.
        """
        names = None if columns is None else list(columns)
        return Table(self._native.runs(names, varied, _is_author(units)))

    def run(self, number: int) -> dict[str, Any]:
        """One run: every column with its value, SI."""
        return next(iter(Table(self._native.row(number))))

    def causes(self, agreement: str) -> Table:
        """Why runs of one agreement do not pass, most frequent first.

        Parameters
        ----------
        agreement : str
            ``"false_fail"``, ``"false_pass"``, ``"true_fail"``, ``"aborted_pass"``, ``"aborted_fail"`` or ``"invalid"``.
            Causes are those on the facility; of false passes, those in space.
        """
        return Table(self._native.causes(agreement))

    def agreement(self, by: str, bins: int = 12, *, units: Units = "author") -> Agreement:
        """Agreement of the facility with space along one input.

        Parameters
        ----------
        by : str
            Parameter (``"loop_delay"``), key of the scenario, or input column.
        bins : int
            Groups of equally many runs, 1 to 1000.

        Returns
        -------
        Agreement
            Counts, and rates of false passes, false fails and aborted sessions with exact 95 % intervals;
            ``.plot()`` draws them.
        """
        return Agreement(self._native.agreement(by, bins, _is_author(units)), by)

    def worst(self, requirement: str, *, loop: Loop = "facility", n: int = 10, units: Units = "author") -> Table:
        """The runs of least margin of a requirement in one loop, worst first.

        Runs without a margin (invalid, aborted, or without the metric) are left out.
        """
        if n < 1:
            raise ValueError(f"n is {n}; write 1 or more")
        return Table(self._native.worst(requirement, loop, n, _is_author(units)))

    def trace(self, run: int) -> Trace:
        """Time history of a run; a run whose history was not kept is simulated again in f64."""
        table, path = self._native.trace(run)
        return Trace(self, run, Table(table), Path(path))

    def plot(self, ax: Any = None) -> Any:
        """Draw failure rates against their limits, and the agreement of the facility with space.

        Parameters
        ----------
        ax : pair of matplotlib axes, optional
            Where to draw; a new figure if not given.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from softdock import _plots

        return _plots.verdict(self, ax)

    def __repr__(self) -> str:
        return f"<softdock.Results {self.id} in {self.path}>\n{self._shown[2]}"

    def _repr_html_(self) -> str:
        from softdock import _html

        return _html.results(self)


class Agreement(Table):
    """Agreement of the facility with space in groups of runs along one input."""

    def __init__(self, native: _softdock.Table, by: str) -> None:
        super().__init__(native)
        self.by = by

    def plot(self, ax: Any = None) -> Any:
        """Draw the rates with their intervals; returns the axes."""
        from softdock import _plots

        return _plots.agreement(self, ax)


def open(path: str | os.PathLike[str]) -> Results:
    """Open a results folder.

    Raises
    ------
    SoftdockError
        If it is none, or its campaign files were changed after the runs.
    """
    return Results(path)
