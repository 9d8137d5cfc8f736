// The section of the runs: filters, linked scatter, table.

import { button, el, select } from "./dom";
import { columnText, grouped, shownAs, significant } from "./format";
import { Scatter } from "./scatter";
import type { Store } from "./store";
import { RunTable, tableColumns } from "./table";

/** Options for all columns that have values, in groups. */
export function columnOptions(store: Store): { value: string; text: string; group: string }[] {
    const groups = { input: "Inputs", margin: "Margins", metric: "Metrics", cause: "Causes" };
    const { columns } = store.data.head;
    const ranked = [...store.data.head.curves.map((curve) => curve.column), ...columns.map((_, at) => at)];
    return [...new Set(ranked)]
        .filter((at) => columns[at].range !== null && columns[at].range[0] < columns[at].range[1])
        .map((at) => ({ value: String(at), text: columnText(columns[at]), group: groups[columns[at].group] }));
}

/** Share of the shown runs that have a value of a column. */
function coverage(store: Store, at: number): number {
    return store.data.values(at).reduce((count, value) => count + Number(Number.isFinite(value)), 0) / Math.max(1, store.data.head.shown);
}

/** Axes to begin with: the most influential input, and a margin that most runs have: aborted sessions have none. */
function firstAxes(store: Store): { x: number; y: number } {
    const { head } = store.data;
    const options = columnOptions(store).map((option) => Number(option.value));
    const delay = store.data.column("in_loop_delay_s");
    const x = head.curves[0]?.column ?? delay ?? options[0] ?? 0;
    const margins = head.requirements.flatMap((own) => [own.margin[1], own.margin[0]]);
    const wide = (at: number | null): at is number => at !== null && (head.requirements.find((own) => own.margin.includes(at))?.histogram ?? null) !== null;
    const measured = margins.filter(wide);
    return { x, y: measured.find((at) => coverage(store, at) > 0.7) ?? measured[0] ?? options.find((at) => at !== x) ?? x };
}

/** Filters: agreement, cause, ranges of columns. */
function filterBar(store: Store): HTMLElement {
    const strata = el("div", { class: "chips", role: "group", "aria-label": "Filter by agreement" });
    const active = el("div", { class: "chips" });
    const { head } = store.data;
    const causes = head.words.causes.filter((cause) => cause.id !== "none");
    const causeOptions = [{ value: "", text: "any" }, ...causes.map((cause) => ({ value: cause.id, text: cause.id }))];
    const causeField = select("Cause", causeOptions, "", (value) => store.setFilter({ cause: value || null }));
    const low = el("input", { type: "text", inputmode: "decimal", placeholder: "from", "aria-label": "Least value", size: 7 });
    const high = el("input", { type: "text", inputmode: "decimal", placeholder: "to", "aria-label": "Greatest value", size: 7 });
    const options = columnOptions(store);
    let column = Number(options[0]?.value ?? 0);
    const unit = el("span", { class: "soft" });
    const showUnit = () => (unit.textContent = head.columns[column] ? shownAs(head.columns[column], store.units).unit : "");
    const columnField = select("Range of", options, String(column), (value) => {
        column = Number(value);
        showUnit();
    });
    const apply = () => {
        const { factor } = shownAs(head.columns[column], store.units);
        const number = (field: HTMLInputElement, none: number) => {
            const value = field.value.trim() === "" ? NaN : Number(field.value.replace(",", "."));
            return Number.isFinite(value) ? value / factor : none;
        };
        store.setRange(column, [number(low, -Infinity), number(high, Infinity)]);
    };
    const form = el("form", { class: "row", submit: (event) => { event.preventDefault(); apply(); } }, columnField, low, high, unit, el("button", { type: "submit" }, "Filter"));
    const draw = () => {
        const { stratum, cause, ranges } = store.filter;
        const chip = (id: string | null, text: string) =>
            button(text, () => {
                store.setFilter({ stratum: id });
                history.replaceState(null, "", id === null ? location.pathname + location.search : `#filter=${id}`);
            }, { "aria-pressed": stratum === id ? "true" : "false", class: "chip" });
        strata.replaceChildren(
            chip(null, `all ${grouped(head.shown)}`),
            ...head.strata.filter((own) => own.total > 0).map((own) => chip(own.id, `${own.text} ${grouped(own.shown)}${own.shown < own.total ? ` of ${grouped(own.total)}` : ""}`)),
        );
        const field = causeField.querySelector("select");
        if (field) field.value = cause ?? "";
        const chips = [...ranges].map(([at, [lo, hi]]) => {
            const own = head.columns[at];
            const { unit: text, factor } = shownAs(own, store.units);
            const end = (value: number) => (Number.isFinite(value) ? significant(factor * value, 3) : "\u2026");
            return button(`${columnText(own)} ${end(lo)} to ${end(hi)} ${text} \u00d7`, () => store.setRange(at, null), { class: "chip", "aria-label": `Remove the range of ${columnText(own)}` });
        });
        const any = stratum !== null || cause !== null || ranges.size > 0;
        active.replaceChildren(...chips, ...(any ? [button("Clear all filters", () => store.clearFilter(), { class: "chip" })] : []));
    };
    store.on("filter", draw);
    store.on("units", () => {
        showUnit();
        draw();
    });
    showUnit();
    draw();
    return el("div", { class: "filters" }, strata, el("div", { class: "row" }, causeField, form), active);
}

export function explorer(store: Store): HTMLElement {
    const { head } = store.data;
    const axes = { ...firstAxes(store), colour: null };
    const scatter = new Scatter(store, axes, `Runs of ${head.campaign}`, 420, true);
    const options = columnOptions(store);
    const pick = (label: string, value: number | null, choose: (at: number | null) => void, none?: string) =>
        select(label, none ? [{ value: "", text: none, group: "" }, ...options] : options, value === null ? "" : String(value), (text) => choose(text === "" ? null : Number(text)));
    const controls = el(
        "div",
        { class: "row" },
        pick("Horizontal", axes.x, (at) => scatter.setAxes({ x: at ?? axes.x })),
        pick("Vertical", axes.y, (at) => scatter.setAxes({ y: at ?? axes.y })),
        pick("Colour", null, (colour) => scatter.setAxes({ colour }), "agreement"),
    );
    const table = new RunTable(store, tableColumns(store));
    return el("div", { class: "explorer" }, filterBar(store), controls, scatter.chart.element, table.element);
}

/** How many runs of each kind the page shows. */
export function sampleText(store: Store): string {
    const { head } = store.data;
    if (head.shown === head.runs) return `All ${grouped(head.runs)} runs are shown.`;
    const parts = head.strata.filter((own) => own.total > 0).map((own) => `${grouped(own.shown)} of ${grouped(own.total)} ${own.text}`);
    return `${grouped(head.shown)} of ${grouped(head.runs)} runs shown: ${parts.join(", ")}; the worst runs of every requirement in both loops among them. Within a kind the choice is random. Counts, curves, histograms and maps are of all runs.`;
}
