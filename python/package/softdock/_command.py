"""The command in a process of its own: Ctrl-C reaches it, and its notes go to standard error."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from typing import Any, Sequence, Union

from softdock._softdock import SoftdockError

PathLike = Union[str, "os.PathLike[str]"]


def answer(arguments: Sequence[PathLike]) -> Any:
    """The answer of a command with ``--json``.

    Raises
    ------
    SoftdockError
        If the command refuses its input or cannot complete.
    """
    words = [os.fspath(word) for word in [*arguments, "--json"]]
    notes: list[str] = []
    with tempfile.TemporaryFile() as file:
        command = [sys.executable, "-m", "softdock", *words]
        with subprocess.Popen(command, stdout=file, stderr=subprocess.PIPE, encoding="utf-8", errors="replace") as task:
            try:
                for line in task.stderr or ():
                    notes.append(line)
            except KeyboardInterrupt:
                task.send_signal(signal.SIGINT)
                raise
        if task.returncode not in (0, 1):
            raise SoftdockError("".join(notes).strip())
        sys.stderr.writelines(notes)
        file.seek(0)
        return json.loads(file.read())
