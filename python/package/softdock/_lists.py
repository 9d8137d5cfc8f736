"""What can be written in files, and what results hold."""

from __future__ import annotations

import os
from html import escape
from typing import Any

from softdock._command import answer


class Listing(list[dict[str, Any]]):
    """Rows of a list, each a dictionary; a table in notebooks."""

    def _repr_html_(self) -> str:
        if not self:
            return "<p>none</p>"
        head = "".join(f"<th>{escape(name)}</th>" for name in self[0])
        rows = "".join(
            "<tr>" + "".join(f"<td style='text-align:left'>{escape(_text(value))}</td>" for value in row.values()) + "</tr>"
            for row in self
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _text(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        return " to ".join(_text(item) for item in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _listed(command: str, word: str | None) -> Listing:
    return Listing(answer([command] if word is None else [command, word]))


def params(word: str | None = None) -> Listing:
    """Parameters for dispersions: unit, legal range, null value, meaning.

    Parameters
    ----------
    word : str, optional
        Part of a name or a meaning, or a word of the field: ``"latency"`` finds ``loop_delay``.
    """
    return _listed("params", word)


def metrics(word: str | None = None) -> Listing:
    """Metrics for requirements: unit, when they have a value, meaning."""
    return _listed("metrics", word)


def effects(word: str | None = None) -> Listing:
    """Effects by which the facility may differ from space, with their parameters."""
    return _listed("effects", word)


def signals(word: str | None = None, *, campaign: str | os.PathLike[str] | None = None) -> Listing:
    """Columns of time histories.

    Parameters
    ----------
    word : str, optional
        Part of a name or a meaning.
    campaign : path, optional
        Campaign file whose poses of base, arm, parts and robots are listed too.
    """
    words: list[str | os.PathLike[str]] = ["signals"] if word is None else ["signals", word]
    return Listing(answer(words if campaign is None else [*words, "--campaign", campaign]))


def examples(word: str | None = None) -> Listing:
    """Shipped campaigns: task, id, number of runs, meaning."""
    return _listed("examples", word)
