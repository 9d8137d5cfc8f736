"""Answers of a results folder against the same numbers by other programs."""

from __future__ import annotations

import json
from pathlib import Path

import duckdb
import pandas
import polars
import pyarrow
import pytest

import softdock as sd

from .conftest import RUNS


def test_runs_are_those_of_the_files(results: sd.Results) -> None:
    files = str(results.path / "runs" / "*.parquet")
    table = results.runs()
    relation = duckdb.sql(f"select * from read_parquet('{files}') order by run")
    assert relation is not None
    other = relation.to_arrow_table()
    own = pyarrow.table(table)
    assert own.num_rows == RUNS == len(table)
    assert own.column_names == other.column_names
    for name in ("run", "in_loop_delay_s", "hil_peak_contact_force_n", "agreement"):
        assert own[name].to_pylist() == other[name].to_pylist() == table[name]


def test_arrow_readers_get_the_same_buffers(results: sd.Results) -> None:
    table = results.runs(["run", "hil_peak_contact_force_n"])
    one, two = pyarrow.table(table), pyarrow.table(table)
    addresses = [
        [chunk.buffers()[1].address for chunk in copy["hil_peak_contact_force_n"].chunks] for copy in (one, two)
    ]
    assert addresses[0] == addresses[1]
    runs = list(range(RUNS))
    table_of_runs = table  # noqa: F841  DuckDB finds it by its name.
    assert polars.DataFrame(table)["run"].to_list() == runs
    assert table.to_pandas()["run"].tolist() == runs
    assert isinstance(table.to_pandas(), pandas.DataFrame)
    assert duckdb.connect().execute("select count(*), max(run) from table_of_runs").fetchall() == [(RUNS, RUNS - 1)]


def test_only_varied_inputs_remain(results: sd.Results) -> None:
    every, varied = results.runs(), results.runs(varied=True)
    inputs = [column.name for column in every.columns if column.name.startswith("in_")]
    expected = [name for name in inputs if len(set(every[name])) > 1]
    assert [column.name for column in varied.columns if column.name.startswith("in_")] == expected
    assert 10 < len(expected) < len(inputs)
    others = [column.name for column in every.columns if not column.name.startswith("in_")]
    assert [column.name for column in varied.columns if not column.name.startswith("in_")] == others


def test_author_units_are_those_of_the_campaign(results: sd.Results) -> None:
    si, author = results.runs(), results.runs(units="author")
    assert author.unit("in_loop_delay_ms") == "ms"
    assert author.unit("in_offset_y_mm") == "mm"
    assert author.unit("in_closing_speed_m_per_s") == "m/s"
    for own, written, factor in (("in_loop_delay_s", "in_loop_delay_ms", 1e3), ("in_offset_y_m", "in_offset_y_mm", 1e3)):
        assert author[written] == pytest.approx([factor * value for value in si[own]], rel=1e-14)
    assert len(author.columns) == len(si.columns)
    with pytest.raises(ValueError, match='write "SI" or "author"'):
        results.runs(units="mm")  # type: ignore[arg-type]


def test_verdict_is_that_of_the_summary(results: sd.Results) -> None:
    summary = json.loads((results.path / "summary.json").read_text())
    # The hash of the files belongs to the file.
    del summary["results_hash"]
    assert results.summary == summary
    assert results.verdict == summary["verdict"]
    assert results.report.is_file()
    assert results.incomplete is None
    assert sd.open(results.path).verdict == results.verdict


def test_causes_count_every_run_of_the_agreement(results: sd.Results) -> None:
    for agreement in ("false_fail", "false_pass", "true_fail", "aborted_pass", "aborted_fail"):
        causes = results.causes(agreement)
        assert sum(causes["runs"]) == results.summary["agreement"][agreement]["count"]
        assert causes["runs"] == sorted(causes["runs"], reverse=True)
        for row in causes:
            assert results.run(row["first_run"])["agreement"] == agreement
    assert len(results.causes("aborted_pass")) > 0
    with pytest.raises(sd.SoftdockError, match="false_fail"):
        results.causes("false_failure")


def test_agreement_along_an_input_counts_every_run_once(results: sd.Results) -> None:
    table = results.agreement(by="loop_delay", bins=6)
    assert len(table) == 6
    assert sum(table["runs"]) == RUNS
    assert table.unit("from") == "ms"
    for word, share in results.summary["agreement"].items():
        if word in [column.name for column in table.columns] and "rate" not in word:
            assert sum(table[word]) == share["count"]
    assert all(end <= start for end, start in zip(table["to"], table["from"][1:]))
    for row in table:
        cases = row["false_fail"] + row["true_pass"] + row["aborted_pass"]
        if cases:
            assert row["false_fail_rate"] == row["false_fail"] / cases
            assert row["false_fail_rate_lo"] <= row["false_fail_rate"] <= row["false_fail_rate_hi"]
        else:
            assert row["false_fail_rate"] is None
    one = results.agreement("loop_delay", bins=1)
    assert one["false_fail_rate_hi"][0] == results.summary["agreement"]["false_fail_rate"]["interval"]["hi"]
    with pytest.raises(sd.SoftdockError, match="did you mean `loop_delay`"):
        results.agreement("loop_dellay")
    with pytest.raises(sd.SoftdockError, match="1 to 1000"):
        results.agreement("loop_delay", bins=0)


def test_worst_runs_are_the_least_margins(results: sd.Results) -> None:
    worst = results.worst("DOCK-020", loop="facility", n=5, units="SI")
    runs = results.runs(["run", "hil_margin_dock_020"])
    rows = [(margin, run) for run, margin in zip(runs["run"], runs["hil_margin_dock_020"]) if margin is not None]
    assert list(zip(worst["margin"], worst["run"])) == sorted(rows)[:5]
    with pytest.raises(sd.SoftdockError, match="DOCK-020"):
        results.worst("DOCK-999")
    with pytest.raises(ValueError, match="loop"):
        results.worst("DOCK-020", loop="hardware")  # type: ignore[arg-type]


def test_trace_peak_is_that_of_the_run(results: sd.Results) -> None:
    kept = {int(path.stem.split("=")[1]) for path in (results.path / "traces").glob("run=*.parquet")}
    touches = [run for run in range(RUNS) if (results.run(run)["hil_peak_contact_force_n"] or 0.0) > 0.0]
    runs = (next(run for run in touches if run in kept), next(run for run in touches if run not in kept))
    for run in runs:
        trace = results.trace(run)
        assert trace.path.is_file()
        peak = max(value for value in trace["hil_contact_force_n"] if value is not None)
        # A trace has every so many ticks; the metric has every substep.
        assert 0.0 < peak <= results.run(run)["hil_peak_contact_force_n"] * (1.0 + 1e-12)
        assert trace.unit("hil_contact_force_n") == "N"


def test_unknown_run_and_folder_are_errors_with_a_remedy(results: sd.Results, tmp_path: Path) -> None:
    with pytest.raises(sd.SoftdockError, match=f"the campaign has the runs 0 to {RUNS - 1}"):
        results.run(RUNS)
    with pytest.raises(sd.SoftdockError):
        results.trace(RUNS)
    with pytest.raises(sd.SoftdockError, match="help"):
        sd.open(tmp_path)


def test_two_folders_compare(results: sd.Results, campaign: sd.Campaign, tmp_path: Path) -> None:
    compared = sd.compare(results, results.path)
    assert compared.data["changes"] == []
    assert "none" in compared.text


def test_exports_hold_the_same_numbers(results: sd.Results, tmp_path: Path) -> None:
    import h5py
    import scipy.io

    table = results.runs(["run", "agreement", "hil_pass_dock_020", "hil_margin_dock_020"])
    table.to_csv(tmp_path / "made" / "runs.csv")
    csv = polars.read_csv(tmp_path / "made" / "runs.csv")
    assert csv["agreement"].to_list() == table["agreement"]
    assert csv["hil_margin_dock_020"].to_list() == table["hil_margin_dock_020"]
    assert csv["hil_pass_dock_020"].to_list() == table["hil_pass_dock_020"]

    table.to_hdf5(tmp_path / "runs.h5", "runs")
    with h5py.File(tmp_path / "runs.h5") as file:
        assert file["runs/agreement"].asstr()[:].tolist() == table["agreement"]
        assert file["runs/hil_margin_dock_020"].attrs["unit"] == table.unit("hil_margin_dock_020")
        assert file["runs/run"][:].tolist() == table["run"]
    with pytest.raises(ValueError, match="already"):
        table.to_hdf5(tmp_path / "runs.h5", "runs")

    table.to_mat(tmp_path / "runs.mat", "runs")
    mat = scipy.io.loadmat(tmp_path / "runs.mat", simplify_cells=True)
    assert mat["runs"]["run"].tolist() == table["run"]
    assert mat["runs_units"]["hil_margin_dock_020"] == table.unit("hil_margin_dock_020")


def test_formulas_do_not_reach_a_spreadsheet(tmp_path: Path) -> None:
    from softdock import _export

    assert _export._cell("=1+1") == "'=1+1"
    assert _export._cell("@x") == "'@x"
    assert _export._cell(-1.5) == "-1.5"


def test_notebooks_show_results_with_inert_text(results: sd.Results, campaign: sd.Campaign) -> None:
    html = results._repr_html_()
    assert "DOCK-020" in html
    assert results.title in html
    assert "<table>" in results.runs(["run", "agreement"])._repr_html_()
    assert "DOCK-020" in campaign._repr_html_()
    assert "DOCK-020" in repr(results)


def test_figures_are_drawn(results: sd.Results, tmp_path: Path) -> None:
    import matplotlib.pyplot as plt

    figure = results.plot()
    figure.savefig(tmp_path / "verdict.png")
    labels = " ".join(label.get_text() for axes in figure.axes for label in axes.get_yticklabels())
    assert "DOCK-020" in labels
    assert "false fail" in labels
    axes = results.agreement("loop_delay").plot()
    assert "[ms]" in axes.get_xlabel()
    trace = results.trace(3)
    assert "run 3" in trace.plot().get_title()
    with pytest.raises(ValueError, match="one unit"):
        trace.plot(["hil_contact_force_n", "hil_injected_energy_j"])
    plt.close("all")
