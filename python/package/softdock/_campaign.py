"""Campaigns: load, check, run."""

from __future__ import annotations

import json
import os
from html import escape
from pathlib import Path
from typing import Any, Callable, Mapping

from softdock import _softdock
from softdock._command import answer
from softdock._progress import reporter
from softdock._results import Results
from softdock._text import TextReport
from softdock._toml import toml_value


class Check(TextReport):
    """Report on a campaign before its runs: draws, nominal case, what its requirements need.

    ``data`` is the report of ``softdock check --json``.
    """


class Campaign:
    """A checked campaign. Use :meth:`load`, :meth:`from_dict` or :meth:`example`.

    ``campaign[key] = value`` sets a key as ``softdock run --set`` does, with its unit, and checks the campaign again:

    >>> campaign["scenario.contact.friction"] = 0.3  # doctest: +SKIP
    >>> campaign["dispersion[loop_delay].dist.max"] = "40 ms"  # doctest: +SKIP

    The results folder keeps the files with these values.
    """

    def __init__(self, path: Path, text: str | None, selection: dict[str, Any], settings: dict[str, str]) -> None:
        self._path = path
        self._text = text
        self._selection = {key: value for key, value in selection.items() if value is not None}
        self._settings = settings
        self._native = self._checked(self._selection, settings)

    def _checked(self, selection: dict[str, Any], settings: dict[str, str]) -> _softdock.NativeCampaign:
        values = [f"{key}={value}" for key, value in settings.items()]
        return _softdock.NativeCampaign(self._path, self._text, values, **selection)

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        *,
        runs: int | None = None,
        seed: int | None = None,
        variant: str | None = None,
        model: str | os.PathLike[str] | None = None,
        cases: str | os.PathLike[str] | None = None,
    ) -> Campaign:
        """Load a campaign file with all files that it names.

        Parameters
        ----------
        path : path
            Campaign file.
        runs, seed : int, optional
            In place of the file's. A larger number of runs extends an existing results folder.
        variant : str, optional
            Only this variant of the campaign.
        model : path, optional
            Scenario file in place of the campaign's: a model that a diagnosis has extended.
        cases : path, optional
            Table of inputs (CSV or Parquet, SI) to run instead of draws; such runs give no verdict.

        Raises
        ------
        SoftdockError
            If a file is wrong: with file, line, key, value and remedy.
        """
        selection = {"runs": runs, "seed": seed, "variant": variant, "model": model, "cases": cases}
        return cls(Path(path), None, selection, {})

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: str | os.PathLike[str] = ".") -> Campaign:
        """Make a campaign of the keys of a campaign file.

        Parameters
        ----------
        data : mapping
            Content of a campaign file; quantities with units are texts: ``"8 ms"``.
        folder : path
            Folder that paths in it are relative to.

        Raises
        ------
        SoftdockError
            If a key or a value is wrong: with line and key of the campaign file that the keys would make.
        """
        text = _softdock.toml_text(json.dumps(data))
        name = data.get("id")
        return cls(Path(folder) / f"{name if isinstance(name, str) and name else 'campaign'}.toml", text, {}, {})

    @classmethod
    def example(
        cls, task: str, folder: str | os.PathLike[str] | None = None, *, runs: int | None = None, seed: int | None = None
    ) -> Campaign:
        """Write the files of a shipped campaign and load it; :func:`softdock.examples` lists the tasks.

        Parameters
        ----------
        task : str
            Task (``"dock"``) or id of the campaign.
        folder : path, optional
            Folder that receives the files; one with the name of the task if not given. Existing files with other
            content are an error.
        """
        folder = Path(task) if folder is None else Path(folder)
        written = answer(["init", task, folder])
        return cls.load(folder / f"{written['id']}.toml", runs=runs, seed=seed)

    def __setitem__(self, key: str, value: object) -> None:
        # The sample is no property of the files: with more runs a results folder is extended.
        if key in ("runs", "seed"):
            selection = {**self._selection, key: value}
            self._native = self._checked(selection, self._settings)
            self._selection = selection
            return
        settings = {**self._settings, key: toml_value(value)}
        self._native = self._checked(self._selection, settings)
        self._settings = settings

    @property
    def id(self) -> str:
        """Name, also of the default results folder."""
        return self._native.id

    @property
    def title(self) -> str:
        """One line for people."""
        return self._native.title

    @property
    def runs(self) -> int:
        """Number of runs."""
        return self._native.runs

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""
        return self._native.seed

    @property
    def hash(self) -> str:
        """blake3 of campaign, scenario, models and tables, in hexadecimal."""
        return self._native.hash

    @property
    def requirements(self) -> dict[str, str]:
        """Requirements by id, as sentences."""
        return dict(self._native.requirements)

    def check(self, draws: int = 2000, step: int | None = None) -> Check:
        """Draw inputs, step the nominal case and some draws, and report what the runs can prove.

        Parameters
        ----------
        draws : int
            Draws for the histograms.
        step : int, optional
            Draws to step, spread over the campaign.
        """
        data, text = self._native.check(draws, step)
        return Check(json.loads(data), text)

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        backend: str | None = None,
        threads: int | None = None,
        fresh: bool = False,
        progress: bool | Callable[[str, int, int], object] = True,
    ) -> Results:
        """Run the campaign to its verdict; the same call resumes an interrupted campaign.

        Ctrl-C stops after the present runs: every finished run is kept.

        Parameters
        ----------
        out : path, optional
            Results folder; ``results/ID`` if not given.
        backend : {"auto", "gpu", "cpu"}, optional
            In place of the campaign's.
        threads : int, optional
            CPU threads; all if not given.
        fresh : bool
            Delete what softdock has written in the results folder, and start over.
        progress : bool or callable
            ``True`` shows progress and notes on standard error; a function is called with the name of the work, the
            finished runs and all runs.

        Returns
        -------
        Results
            Complete unless :attr:`Results.incomplete` states a reason.

        Raises
        ------
        SoftdockError
            If the folder belongs to another campaign, or no device can make the runs.
        """
        with reporter(progress) as report:
            folder, incomplete = self._native.run(
                out,
                backend=backend,
                threads=threads,
                fresh=fresh,
                progress=report.progress,
                note=report.note,
            )
        return Results(folder, incomplete=incomplete)

    def __repr__(self) -> str:
        return f"<softdock.Campaign {self.id}: {self.runs} runs, seed {self.seed}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td><b>{escape(id)}</b></td><td style='text-align:left'>{escape(text)}</td></tr>"
            for id, text in self.requirements.items()
        )
        facts = f"{self.runs} runs, seed {self.seed}, hash <code>{escape(self.hash[:12])}</code>"
        return f"<p><b>{escape(self.title)}</b><br><code>{escape(self.id)}</code>: {facts}</p><table>{rows}</table>"

