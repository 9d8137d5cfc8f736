"""Two results folders side by side."""

from __future__ import annotations

import json
import os

from softdock import _softdock
from softdock._results import Results
from softdock._text import TextReport


class Comparison(TextReport):
    """Failures, rates, runs that changed, metrics and keys of two results folders.

    ``data`` is the comparison of ``softdock compare --json``.
    """


def compare(first: Results | str | os.PathLike[str], second: Results | str | os.PathLike[str]) -> Comparison:
    """Compare two results folders; differences are those of the second less the first.

    Runs with the same number are pairs if both folders have the same seed.
    """
    paths = [given.path if isinstance(given, Results) else given for given in (first, second)]
    data, text = _softdock.compare_folders(*paths)
    return Comparison(json.loads(data), text)
