"""Time histories of runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Sequence

from softdock._table import Table

if TYPE_CHECKING:
    from softdock._results import Results


class Trace(Table):
    """Time history of a run: ``t_s`` and a column per signal.

    Attributes
    ----------
    run : int
        Number of the run.
    path : pathlib.Path
        Its Parquet file.
    """

    def __init__(self, results: Results, run: int, table: Table, path: Path) -> None:
        super().__init__(table._native)
        self._results = results
        self.run = run
        self.path = path

    def plot(self, signals: Sequence[str] | None = None, ax: Any = None) -> Any:
        """Draw signals over time; returns the axes.

        Parameters
        ----------
        signals : sequence of str, optional
            Signals of one unit; contact force in space and on the facility, with the limits of the campaign, if not
            given. :attr:`columns` lists all.
        ax : matplotlib axes, optional
            Where to draw; a new figure if not given.
        """
        from softdock import _plots

        return _plots.trace(self, self._results, signals, ax)
