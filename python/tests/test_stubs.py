"""Types: of the package, and of the stubs against the native part."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, cwd=ROOT)


def test_stubs_match_the_native_part() -> None:
    done = _run("mypy.stubtest", "softdock._softdock", "--ignore-disjoint-bases", "--concise")
    assert done.returncode == 0, done.stdout + done.stderr


def test_package_and_tests_are_typed() -> None:
    done = _run("mypy", "package/softdock", "tests")
    assert done.returncode == 0, done.stdout + done.stderr
