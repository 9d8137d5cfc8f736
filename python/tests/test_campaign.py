"""Campaigns: errors, progress, interruption, resumption."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import softdock as sd

from .conftest import CAMPAIGNS, RUNS


def test_campaign_states_what_it_is(campaign: sd.Campaign) -> None:
    assert campaign.id == "probe_drogue"
    assert campaign.runs == RUNS
    assert "DOCK-020" in campaign.requirements
    assert len(campaign.hash) == 64


def test_check_reports_draws_and_the_nominal_case(campaign: sd.Campaign) -> None:
    report = campaign.check(draws=100)
    assert "stepped" in report.data
    assert "loop_delay" in report.text
    assert "<pre>" in report._repr_html_()


def test_wrong_files_are_errors_with_every_place(tmp_path: Path) -> None:
    text = (CAMPAIGNS / "smoke.toml").read_text()
    (tmp_path / "scenarios").mkdir()
    for name in ("smoke.toml",):
        (tmp_path / "scenarios" / name).write_bytes((CAMPAIGNS / "scenarios" / name).read_bytes())
    broken = tmp_path / "smoke.toml"
    broken.write_text(text.replace("runs = ", "runs = -"))
    with pytest.raises(sd.SoftdockError) as error:
        sd.Campaign.load(broken)
    assert "smoke.toml" in str(error.value)
    assert "runs" in str(error.value)
    with pytest.raises(sd.SoftdockError, match="missing.toml"):
        sd.Campaign.load(tmp_path / "missing.toml")
    with pytest.raises(ValueError, match='write one of'):
        sd.Campaign.load(CAMPAIGNS / "smoke.toml").run(tmp_path / "out", backend="tpu")
    with pytest.raises(ValueError, match="threads"):
        sd.Campaign.load(CAMPAIGNS / "smoke.toml").run(tmp_path / "out", threads=0)


def test_progress_ends_at_all_runs(campaign: sd.Campaign, tmp_path: Path) -> None:
    seen: list[tuple[str, int, int]] = []
    campaign.run(tmp_path / "dock", backend="cpu", threads=1, progress=lambda *event: seen.append(event))
    runs = [(done, total) for work, done, total in seen if work == "run"]
    assert runs[0] == (0, RUNS)
    assert runs[-1] == (RUNS, RUNS)
    assert runs == sorted(runs)


def test_other_threads_run_while_runs_are_made(campaign: sd.Campaign, tmp_path: Path) -> None:
    counted = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted
    campaign.run(tmp_path / "dock", backend="cpu", threads=1, progress=False)
    during = counted - before
    stop.set()
    thread.join()
    assert during > 50


def test_an_exception_of_the_callback_stops_and_the_same_call_resumes(campaign: sd.Campaign, tmp_path: Path) -> None:
    def fail(work: str, done: int, total: int) -> None:
        if done:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        campaign.run(tmp_path / "dock", backend="cpu", progress=fail)
    results = campaign.run(tmp_path / "dock", backend="cpu", progress=False)
    assert len(results.runs(["run"])) == RUNS


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_ctrl_c_stops_cleanly_and_the_same_call_resumes(tmp_path: Path) -> None:
    script = (
        "import softdock as sd, sys\n"
        f"campaign = sd.Campaign.load({str(CAMPAIGNS / 'probe_drogue.toml')!r}, runs=20000)\n"
        "def started(work, done, total):\n"
        "    if done: print('running', flush=True)\n"
        "try:\n"
        f"    campaign.run({str(tmp_path / 'dock')!r}, backend='cpu', progress=started)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted', flush=True)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as task:
        assert task.stdout is not None
        assert task.stdout.readline() == "running\n"
        task.send_signal(signal.SIGINT)
        start = time.monotonic()
        rest = task.stdout.read()
        assert task.wait() == 0
    assert rest.splitlines()[-1] == "interrupted"
    assert time.monotonic() - start < 30.0
    kept = list((tmp_path / "dock" / "partial").glob("*.parquet")) + list((tmp_path / "dock" / "runs").glob("*.parquet"))
    assert kept


def test_the_command_is_in_the_package() -> None:
    def softdock(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "softdock", *arguments], capture_output=True, text=True)

    version = softdock("--version")
    assert (version.returncode, version.stdout.strip()) == (0, f"softdock {sd.__version__}")
    assert softdock("check", "missing.toml").returncode == 2
    assert "--backend cpu" in softdock("devices").stdout


def test_identification_runs_the_command(tmp_path: Path) -> None:
    model = CAMPAIGNS / "models" / "kr300_r2500.toml"
    with pytest.raises(sd.SoftdockError, match="missing.csv"):
        sd.identify("robot", model, [tmp_path / "missing.csv"], out=tmp_path / "out")
    with pytest.raises(ValueError, match="robot"):
        sd.identify("arm", model)
    with pytest.raises(sd.SoftdockError, match="missing.csv"):
        sd.diagnose(CAMPAIGNS / "rigs" / "emps.toml", [tmp_path / "missing.csv"], out=tmp_path / "out")
