"""Answers for people and programs."""

from __future__ import annotations

from html import escape
from typing import Any


class TextReport:
    """An answer as data and as text.

    Attributes
    ----------
    data : dict
        The answer for programs.
    text : str
        The answer for people.
    """

    def __init__(self, data: dict[str, Any], text: str) -> None:
        self.data = data
        self.text = text

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.text)}</pre>"
