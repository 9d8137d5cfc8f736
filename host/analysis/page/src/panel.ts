// The panel of a run: verdicts, causes, requirements, inputs, trace and replay.

import { CODE, type Data, type Requirement } from "./data";
import { button, el } from "./dom";
import { siText, valueText, wordText } from "./format";
import type { Store } from "./store";
import { showTrace } from "./traces";

const SIDES = ["in space", "on the facility"];

/** Why a loop did not pass, as a sentence; none where it passed. */
function causeText(data: Data, row: number, side: number): string | null {
    const { words } = data.head;
    const cause = words.causes[data.codes[CODE.cause[side]][row]];
    if (cause.id === "none") return null;
    const number = (name: string) => {
        const at = data.column(`${side === 0 ? "space" : "hil"}_cause_${name}`);
        return at === undefined ? NaN : data.values(at)[row];
    };
    const [value, limit, time] = [number("value"), number("limit"), number("time_s")];
    let text = cause.text.replace("{}", siText(limit, cause.unit));
    // A criterion without a number has the limit 1 and no value.
    if (Number.isFinite(value)) text += `: ${siText(value, cause.unit)}${Number.isFinite(limit) ? `, limit ${siText(limit, cause.unit)}` : ""}`;
    if (Number.isFinite(time)) text += `, ${Number.isFinite(value) ? "at" : "until"} ${siText(time, "s")}`;
    const phase = words.phase[data.codes[CODE.phase[side]][row]];
    return phase === "none" ? text : `${text}, ${phase} phase`;
}

/** Requirements on a metric that a loop does not hold, each with its value. */
function missedRequirements(store: Store, row: number, side: number): string[] {
    const { data, units } = store;
    const value = (at: number) => valueText(data.head.columns[at], data.values(at)[row], units);
    return data.head.requirements.flatMap((own) => {
        const [margin, metric] = [own.margin[side], own.value[side]];
        if (margin === null || metric === null || !(data.values(margin)[row] < 0)) return [];
        return [`${own.id}: ${own.metric} ${value(metric)}, margin ${value(margin)}`];
    });
}

function requirementRows(store: Store, row: number): HTMLElement[] {
    const { data, units } = store;
    const text = (at: number | null) => (at === null ? "\u2013" : valueText(data.head.columns[at], data.values(at)[row], units));
    const cell = (at: number | null) => {
        const margin = at === null ? NaN : data.values(at)[row];
        return el("td", { class: `n ${margin < 0 ? "bad" : ""}` }, text(at));
    };
    const limit = (own: Requirement) => {
        const column = own.margin[0] ?? own.margin[1];
        const shown = (value: number) => (column === null ? siText(value, own.unit) : valueText(data.head.columns[column], value, units));
        const parts = [own.at_least === null ? "" : `\u2265 ${shown(own.at_least)}`, own.at_most === null ? "" : `\u2264 ${shown(own.at_most)}`];
        return parts.filter(Boolean).join(", ");
    };
    return data.head.requirements.flatMap((own) => {
        const decides = own.worst.map((worst, side) => (worst === data.run[row] ? SIDES[side] : "")).filter(Boolean);
        const head = el(
            "tr",
            { class: "head" },
            el("td", { colspan: 3 }, el("b", {}, own.id), ` ${own.metric} ${limit(own)}`, ...(decides.length > 0 ? [el("span", { class: "note" }, ` worst run ${decides.join(" and ")}`)] : [])),
        );
        const sides = ([0, 1] as const).filter((side) => own.margin[side] !== null || own.value[side] !== null);
        return [head, ...sides.map((side) => el("tr", {}, el("td", {}, SIDES[side]), el("td", { class: "n" }, text(own.value[side])), cell(own.margin[side])))];
    });
}

function numbers(store: Store, row: number, group: "input" | "metric"): HTMLElement {
    const { data, units } = store;
    const entries = data.head.columns
        .map((column, at) => ({ column, at }))
        .filter(({ column, at }) => column.group === group && Number.isFinite(data.values(at)[row]) && (group === "metric" || column.dispersed || column.name === "in_loop_delay_s"));
    if (group === "input") {
        const line = ({ column, at }: (typeof entries)[number]) => {
            const value = data.values(at)[row];
            const [lo, hi] = column.range ?? [value, value];
            const bar = el("span", { class: "place", "aria-hidden": "true" }, el("i"));
            (bar.firstElementChild as HTMLElement).style.left = `${hi > lo ? (100 * (value - lo)) / (hi - lo) : 50}%`;
            return el("tr", { title: column.meaning }, el("td", {}, column.label), el("td", { class: "n" }, valueText(column, value, units)), el("td", {}, bar));
        };
        return el("table", {}, el("tbody", {}, ...entries.map(line)));
    }
    const labels = [...new Set(entries.map(({ column }) => column.label))];
    const cell = (label: string, side: string) => {
        const found = entries.find(({ column }) => column.label === label && column.side === side);
        return el("td", { class: "n" }, found ? valueText(found.column, data.values(found.at)[row], units) : "\u2013");
    };
    const head = el("tr", {}, el("th", { scope: "col" }, "metric"), el("th", { class: "n", scope: "col" }, "space"), el("th", { class: "n", scope: "col" }, "facility"));
    return el("table", {}, el("thead", {}, head), el("tbody", {}, ...labels.map((label) => el("tr", {}, el("td", {}, label), cell(label, "space"), cell(label, "facility")))));
}

function history(store: Store, run: number): HTMLElement {
    const trace = store.data.trace(run);
    if (trace) {
        const open = () => {
            showTrace(run);
            document.getElementById("traces")?.scrollIntoView();
        };
        return el("p", {}, button(trace.poses ? "Time history and replay" : "Time history", open), el("span", { class: "soft" }, ` kept as: ${trace.kept_as}`));
    }
    const command = `softdock replay . ${run}`;
    const copy = button("Copy", () => void navigator.clipboard?.writeText(command));
    const where = store.data.head.traced.includes(run) ? "The time history of this run is in the results folder, not on this page." : "No time history of this run was kept.";
    return el("p", {}, where, " Make one there: ", el("code", {}, command), " ", copy);
}

/** Fills the panel with the selected run. */
export function panel(store: Store, aside: HTMLElement): void {
    let before: Element | null = null;
    const close = () => {
        store.select(null);
        if (before instanceof HTMLElement) before.focus();
    };
    const draw = () => {
        const { selected: run, data } = store;
        aside.hidden = run === null;
        document.body.classList.toggle("with-panel", run !== null);
        if (run === null) return;
        if (!aside.contains(document.activeElement)) before = document.activeElement;
        const row = data.row(run);
        const step = (by: number) => {
            const place = row === undefined ? -1 : store.rows.indexOf(row);
            const next = store.rows[place + by];
            return button(by < 0 ? "\u2190" : "\u2192", () => store.select(data.run[next]), { disabled: next === undefined || place < 0, "aria-label": by < 0 ? "Previous run" : "Next run" });
        };
        const shut = button("\u00d7", close, { "aria-label": "Close the run" });
        const title = el("h2", { tabindex: -1 }, `Run ${run}`);
        const head = el("div", { class: "panel-head" }, title, step(-1), step(1), shut);
        if (row === undefined) {
            aside.replaceChildren(head, el("p", {}, "This run is not in the sample of this page."), history(store, run));
        } else {
            const { words } = data.head;
            const verdict = (side: number) => {
                const outcome = words.outcome[data.codes[CODE.outcome[side]][row]];
                const missed = missedRequirements(store, row, side);
                const cause = causeText(data, row, side);
                const word = outcome === "pass" && missed.length > 0 ? "fails a requirement" : outcome;
                const reasons = [...(cause ? [cause] : []), ...missed];
                return el("p", { class: "cause" }, el("b", { class: word === "pass" ? "verified" : "not_verified" }, `${word[0].toUpperCase()}${word.slice(1)} ${SIDES[side]}`), reasons.length > 0 ? `: ${reasons.join("; ")}.` : "");
            };
            const flags = data.head.flags.filter(([bit]) => (data.flags[row] & bit) !== 0);
            aside.replaceChildren(
                head,
                el("p", {}, el("span", { class: `tag c-${data.stratum(row)}` }, el("b", {}, wordText(words.agreement[data.codes[0][row]])))),
                verdict(0),
                verdict(1),
                ...(flags.length > 0 ? [el("p", { class: "note" }, `Flags: ${flags.map((flag) => flag[2]).join("; ")}.`)] : []),
                history(store, run),
                el("h3", {}, "Requirements"),
                el("table", {}, el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "loop"), el("th", { class: "n", scope: "col" }, "value"), el("th", { class: "n", scope: "col" }, "margin"))), el("tbody", {}, ...requirementRows(store, row))),
                el("h3", {}, "Inputs"),
                numbers(store, row, "input"),
                el("h3", {}, "Metrics"),
                numbers(store, row, "metric"),
            );
        }
        aside.scrollTop = 0;
        title.focus({ preventScroll: true });
    };
    store.on("selection", draw);
    store.on("units", () => {
        if (store.selected !== null) draw();
    });
    addEventListener("keydown", (event) => {
        if (event.key === "Escape" && store.selected !== null) close();
    });
    draw();
}

