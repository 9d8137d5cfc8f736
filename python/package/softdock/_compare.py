"""Two results folders side by side."""

from __future__ import annotations

import json
import os
from html import escape
from typing import Any

from softdock import _softdock
from softdock._results import Results


class Comparison:
    """Failures, rates, runs that changed, metrics and keys of two results folders.

    Attributes
    ----------
    data : dict
        The comparison of ``softdock compare --json``.
    text : str
        The comparison for people.
    """

    def __init__(self, data: dict[str, Any], text: str) -> None:
        self.data = data
        self.text = text

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.text)}</pre>"


def compare(first: Results | str | os.PathLike[str], second: Results | str | os.PathLike[str]) -> Comparison:
    """Compare two results folders; differences are those of the second less the first.

    Runs with the same number are pairs if both folders have the same seed.
    """
    paths = [given.path if isinstance(given, Results) else given for given in (first, second)]
    data, text = _softdock.compare_folders(*paths)
    return Comparison(json.loads(data), text)
