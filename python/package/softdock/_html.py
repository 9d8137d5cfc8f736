"""Summaries in notebooks."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softdock._results import Results

COLOURS = {"verified": "#2e7d4f", "not_verified": "#b3261e", "undecided": "#8a949e"}


def _verdict(word: str) -> str:
    colour = COLOURS.get(word, COLOURS["undecided"])
    return f"<b style='color:{colour}'>{escape(word.replace('_', ' '))}</b>"


def results(results: Results) -> str:
    """Verdict, requirements and agreement as a small table."""
    summary: dict[str, Any] = results.summary
    title = f"<p><b>{escape(results.title)}</b> <code>{escape(str(results.path))}</code></p>"
    if "agreement" not in summary:
        return f"{title}<pre>{escape(results._shown[2])}</pre>"
    rows = []
    for requirement in summary["requirements"]:
        judged = requirement["loops"][requirement["subject"]]
        rows.append((requirement, f"{judged['failures']} of {judged['runs']} failed"))
    for requirement in summary["agreement_requirements"]:
        share = requirement["share"]
        rows.append((requirement, f"{share['count']} of {share['cases']} cases"))
    lines = "".join(
        f"<tr><td><b>{escape(row['id'])}</b></td><td style='text-align:left'>{escape(row['sentence'])}</td>"
        f"<td>{escape(counted)}</td><td>{_verdict(row['verdict'])}</td></tr>"
        for row, counted in rows
    )
    counts = summary["agreement"]
    words = [word for word in counts if "rate" not in word and word != "misleading_passes"]
    agreement = ", ".join(f"{counts[word]['count']} {word.replace('_', ' ')}" for word in words)
    incomplete = f"<p>{escape(results.incomplete)}</p>" if results.incomplete else ""
    done = summary["completeness"]
    facts = f"{done['runs_done']} of {done['runs_planned']} runs: {escape(agreement)}"
    return f"{title}<p>{_verdict(summary['verdict'])}</p>{incomplete}<table>{lines}</table><p>{facts}</p>"
