"""Figures, drawn by matplotlib (``pip install softdock[plot]``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Sequence

if TYPE_CHECKING:
    from softdock._results import Agreement, Results
    from softdock._trace import Trace

# Colours of the report page.
SPACE, FACILITY, LIMIT = "#1f5fa8", "#c2571a", "#b3261e"
AGREEMENT = {
    "true_pass": "#2e7d4f",
    "true_fail": "#8a949e",
    "false_pass": "#b3261e",
    "false_fail": "#d98324",
    "aborted_pass": "#7b5ea7",
    "aborted_fail": "#b6a4d0",
    "invalid": "#222222",
}


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("figures need matplotlib: pip install 'softdock[plot]'") from error
    return plt


def _axes(ax: Any) -> Any:
    return ax if ax is not None else _pyplot().subplots(figsize=(7, 4), layout="constrained")[1]


def verdict(results: Results, axes: Any) -> Any:
    """Failure rates with bounds and limits, and the agreement."""
    summary = results.summary
    if "agreement" not in summary:
        from softdock._softdock import SoftdockError

        raise SoftdockError(f"{results.path} has no summary of one campaign to draw\n  help: draw one of its variants")
    if axes is None:
        rows = 2 * len(summary["requirements"]) + len(summary["agreement_requirements"])
        figure, axes = _pyplot().subplots(
            1, 2, figsize=(11, 1.8 + 0.45 * max(rows, 4)), width_ratios=(3, 2), layout="constrained"
        )
    else:
        figure = axes[0].figure
    rates, counts = axes
    _rates(rates, summary)
    _counts(counts, summary["agreement"])
    word = summary["verdict"].replace("_", " ")
    figure.suptitle(f"{summary['title']}: {word}", fontweight="bold")
    return figure


def _rates(ax: Any, summary: dict[str, Any]) -> None:
    """A line per requirement and loop: observed rate, upper bound, limit."""
    labels: list[str] = []
    for requirement in summary["requirements"]:
        limit = 1.0 - requirement["probability"]
        for loop, colour in (("space", SPACE), ("facility", FACILITY)):
            judged = requirement["loops"][loop]
            if not judged["runs"] or (loop == "space" and requirement["subject"] == "facility"):
                continue
            place = "in space" if loop == "space" else "on the facility"
            verdict = judged["verdict"].replace("_", " ") if loop == requirement["subject"] else "informative"
            rate = judged["failures"] / judged["runs"]
            _rate(ax, len(labels), rate, judged["failure_rate_bound"], limit, colour)
            labels.append(f"{requirement['id']} {place}: {verdict}")
    for requirement in summary["agreement_requirements"]:
        share = requirement["share"]
        if share["cases"]:
            rate = share["count"] / share["cases"]
            _rate(ax, len(labels), rate, requirement["bound"], requirement["at_most"], FACILITY)
            labels.append(f"{requirement['id']}: {requirement['verdict'].replace('_', ' ')}")
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(len(labels) - 0.5, -0.5)
    ax.set_xlim(left=0)
    ax.set_xlabel("failure rate: observed (dot), upper bound (bar), allowed (line)")
    ax.grid(axis="x", alpha=0.3)


def _rate(ax: Any, row: int, rate: float, bound: float | None, limit: float, colour: str) -> None:
    if bound is not None:
        ax.plot([rate, bound], [row, row], color=colour, linewidth=3, solid_capstyle="butt", alpha=0.6)
    ax.plot(rate, row, "o", color=colour)
    ax.plot([limit, limit], [row - 0.35, row + 0.35], color=LIMIT, linewidth=1.5)


def _counts(ax: Any, agreement: dict[str, Any]) -> None:
    words = list(AGREEMENT)
    counts = [agreement[word]["count"] for word in words]
    shares = [agreement[word]["interval"] for word in words]
    runs = max(sum(counts), 1)
    errors = [
        [count / runs - share["lo"] for count, share in zip(counts, shares)],
        [share["hi"] - count / runs for count, share in zip(counts, shares)],
    ]
    rows = range(len(words))
    ax.barh(rows, [count / runs for count in counts], xerr=errors, color=[AGREEMENT[word] for word in words], capsize=2)
    labels = [f"{word.replace('_', ' ')}: {count}" for word, count in zip(words, counts)]
    ax.set_yticks(rows, labels)
    ax.invert_yaxis()
    ax.set_xlabel(f"share of {sum(counts)} runs, 95 % intervals")
    ax.grid(axis="x", alpha=0.3)


def agreement(table: Agreement, ax: Any) -> Any:
    """Rates of false verdicts and of aborted sessions along an input, as steps with bands."""
    ax = _axes(ax)
    edges = list(zip(table["from"], table["to"]))
    for rate, word in (("false_pass_rate", "false_pass"), ("false_fail_rate", "false_fail"), ("abort_rate", "aborted_pass")):
        colour = AGREEMENT[word]
        values, least, greatest = table[rate], table[f"{rate}_lo"], table[f"{rate}_hi"]
        label: str | None = rate.replace("_", " ")
        for (start, end), value, lo, hi in zip(edges, values, least, greatest):
            if value is None:
                continue
            ax.fill_between([start, end], lo, hi, color=colour, alpha=0.2, linewidth=0)
            ax.plot([start, end], [value, value], color=colour, linewidth=2, label=label)
            label = None
    ax.set_xlabel(f"{table.by} [{table.unit('from')}]")
    ax.set_ylabel("rate, 95 % intervals")
    ax.set_ylim(-0.02, 1.02)
    ax.grid(alpha=0.3)
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    return ax


def trace(table: Trace, results: Results, signals: Sequence[str] | None, ax: Any) -> Any:
    """Signals over time, with the limits of the campaign on contact force."""
    ax = _axes(ax)
    is_force = signals is None
    named = ("space_contact_force_n", "hil_contact_force_n") if signals is None else tuple(signals)
    units = {table.unit(name) for name in named}
    if len(units) != 1:
        raise ValueError(f"signals have the units {', '.join(sorted(units))}; draw one unit at a time")
    colours = {"space_contact_force_n": SPACE, "hil_contact_force_n": FACILITY}
    for name in named:
        values = [float("nan") if value is None else value for value in table[name]]
        ax.plot(table["t_s"], values, label=name, color=colours.get(name), linewidth=1.2)
    if is_force:
        for requirement in results.summary.get("requirements", []):
            if requirement["metric"] == "peak_contact_force" and requirement["at_most"] is not None:
                ax.axhline(requirement["at_most"], color=LIMIT, linestyle="--", linewidth=1, label=requirement["id"])
    run = results.run(table.run)
    for loop, colour in (("space", SPACE), ("hil", FACILITY)):
        for event in ("touch_time_s", "capture_time_s"):
            time = run.get(f"{loop}_{event}")
            if time is not None and time >= 0:
                ax.axvline(time, color=colour, linestyle=":", linewidth=1)
    ax.set_xlabel("t [s]; dotted: first touch and capture")
    ax.set_ylabel(f"[{units.pop()}]")
    ax.set_title(f"run {table.run}: {run['agreement'].replace('_', ' ')}")
    ax.grid(alpha=0.3)
    ax.legend()
    return ax


