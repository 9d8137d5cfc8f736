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


def test_keys_are_set_with_their_units(tmp_path: Path) -> None:
    campaign = sd.Campaign.load(CAMPAIGNS / "probe_drogue.toml", runs=20)
    before = campaign.hash
    campaign["dispersion[loop_delay].dist.max"] = "40 ms"
    campaign["execution.shard_runs"] = 10
    assert campaign.hash != before
    results = campaign.run(tmp_path / "out", backend="cpu", progress=False)
    assert max(results.runs(["in_loop_delay_s"])["in_loop_delay_s"]) < 0.040
    assert len(list((results.path / "runs").glob("*.parquet"))) == 2

    kept = campaign.hash
    with pytest.raises(sd.SoftdockError, match="40 kg"):
        campaign["dispersion[loop_delay].dist.max"] = "40 kg"
    with pytest.raises(sd.SoftdockError, match="shard_runs"):
        campaign["execution.shard_run"] = 10
    with pytest.raises(TypeError, match="object"):
        campaign["title"] = object()
    assert campaign.hash == kept
    # The sample is not part of the files.
    campaign["runs"] = 30
    assert (campaign.runs, campaign.hash) == (30, kept)


def test_a_dictionary_is_a_campaign(tmp_path: Path) -> None:
    import tomllib

    path = CAMPAIGNS / "smoke.toml"
    data = tomllib.loads(path.read_text())
    data["id"] = "made"
    data["runs"] = 16
    campaign = sd.Campaign.from_dict(data, CAMPAIGNS)
    results = campaign.run(tmp_path / "made", backend="cpu", progress=False)
    assert results.id == "made"
    assert sd.open(tmp_path / "made").verdict == results.verdict
    same = sd.Campaign.load(path, runs=16).run(tmp_path / "same", backend="cpu", progress=False)
    assert results.runs(["hil_peak_contact_force_n"])["hil_peak_contact_force_n"] == (
        same.runs(["hil_peak_contact_force_n"])["hil_peak_contact_force_n"]
    )
    # The folder runs again on its own.
    again = sd.Campaign.load(next((tmp_path / "made" / "campaign").rglob("made.toml")))
    assert again.hash == campaign.hash
    with pytest.raises(sd.SoftdockError, match="runs"):
        sd.Campaign.from_dict({**data, "runs": "many"}, CAMPAIGNS)
    with pytest.raises(sd.SoftdockError, match="no_such_file.toml"):
        sd.Campaign.from_dict({**data, "scenario": "no_such_file.toml"}, CAMPAIGNS)


def test_an_example_needs_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    campaign = sd.Campaign.example("first", runs=16)
    assert (tmp_path / "first" / "smoke.toml").is_file()
    assert campaign.run(progress=False).verdict in ("verified", "not_verified")
    with pytest.raises(sd.SoftdockError, match="dock"):
        sd.Campaign.example("docking")


def test_lists_find_names_by_meaning() -> None:
    assert "loop_delay" in [row["name"] for row in sd.params("latency")]
    assert "peak_contact_force" in [row["name"] for row in sd.metrics()]
    assert any(row["task"] == "dock" for row in sd.examples())
    assert len(sd.effects()) > 30
    assert "<table>" in sd.signals()._repr_html_()
