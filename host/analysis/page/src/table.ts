// Table of the runs: only the rows in view exist; sorted by any column; moved through by keys.

import { CODE } from "./data";
import { button, el } from "./dom";
import { columnText, grouped, shownAs, significant, wordText } from "./format";
import type { Store } from "./store";

const ROW_HEIGHT = 27;

/** Rows beyond the view that are made. */
const AHEAD = 12;

interface Field {
    head: string;
    title: string;
    numeric: boolean;
    text: (row: number) => string;
    /** Key to sort by. */
    key: (row: number) => number;
    tag?: (row: number) => string;
    /** Width, in characters. */
    width: number;
}

export class RunTable {
    readonly element: HTMLElement;
    private readonly scroll: HTMLElement;
    private readonly head: HTMLTableRowElement;
    private readonly body: HTMLTableSectionElement;
    private readonly count: HTMLElement;
    private fields: Field[] = [];
    private order: Uint32Array = new Uint32Array();
    private sortBy = 0;
    private descending = false;
    /** Place of the keyboard's row in the order. */
    private cursor = 0;

    constructor(private readonly store: Store, private readonly columns: number[]) {
        this.head = el("tr");
        this.body = el("tbody");
        this.count = el("p", { class: "note", role: "status" });
        const table = el("table", { class: "runs" }, el("thead", {}, this.head), this.body);
        this.scroll = el(
            "div",
            {
                class: "scroll runs-scroll",
                tabindex: 0,
                role: "region",
                "aria-label": "Table of runs: arrow keys move, Enter opens a run",
                scroll: () => this.drawRows(),
                keydown: (event) => this.key(event as KeyboardEvent),
            },
            table,
        );
        this.element = el("div", { class: "run-table" }, this.count, this.scroll);
        this.makeFields();
        this.sort();
        store.on("filter", () => {
            this.cursor = 0;
            this.scroll.scrollTop = 0;
            this.sort();
        });
        store.on("selection", () => this.show(store.selected));
        store.on("units", () => {
            this.makeFields();
            this.drawRows();
        });
        new ResizeObserver(() => this.drawRows()).observe(this.scroll);
    }

    private makeFields(): void {
        const { data, units } = this.store;
        const words = data.head.words;
        const code = (at: number) => (row: number) => data.codes[at][row];
        const cause = (at: number): Field => ({
            head: at === 0 ? "cause, space" : "cause, facility",
            title: "Criterion, rule or flag by which the loop did not pass",
            numeric: false,
            text: (row) => {
                const own = words.causes[data.codes[CODE.cause[at]][row]];
                return own.id === "none" ? "\u2013" : own.id;
            },
            key: code(CODE.cause[at]),
            width: 20,
        });
        this.fields = [
            { head: "run", title: "Run number", numeric: true, text: (row) => String(data.run[row]), key: (row) => data.run[row], width: 8 },
            {
                head: "agreement",
                title: "The facility's verdict against that of space",
                numeric: false,
                text: (row) => wordText(words.agreement[data.codes[0][row]]),
                key: code(CODE.agreement),
                tag: (row) => data.stratum(row),
                width: 14,
            },
            cause(0),
            cause(1),
            ...this.columns.map((at): Field => {
                const column = data.head.columns[at];
                const { unit, factor } = shownAs(column, units);
                const values = data.values(at);
                return {
                    head: unit ? `${columnText(column)} [${unit}]` : columnText(column),
                    title: column.meaning,
                    numeric: true,
                    text: (row) => (Number.isFinite(values[row]) ? significant(factor * values[row]) : "\u2013"),
                    key: (row) => values[row],
                    width: 12,
                };
            }),
        ];
        this.drawHead();
    }

    private drawHead(): void {
        this.head.replaceChildren(
            ...this.fields.map((field, at) => {
                const sorted = at === this.sortBy;
                const mark = sorted ? (this.descending ? " \u2193" : " \u2191") : "";
                const head = el(
                    "th",
                    {
                        class: field.numeric ? "n" : "",
                        scope: "col",
                        title: field.title,
                        "aria-sort": sorted ? (this.descending ? "descending" : "ascending") : "none",
                    },
                    button(field.head + mark, () => this.sortOn(at), { class: "head" }),
                );
                head.style.minWidth = `${field.width}ch`;
                return head;
            }),
        );
    }

    private sortOn(field: number): void {
        this.descending = field === this.sortBy ? !this.descending : false;
        this.sortBy = field;
        this.drawHead();
        this.sort();
    }

    private sort(): void {
        const { key } = this.fields[this.sortBy];
        const sign = this.descending ? -1 : 1;
        this.order = this.store.rows.slice();
        // A missing value comes last.
        this.order.sort((one, two) => {
            const [a, b] = [key(one), key(two)];
            if (Number.isNaN(a) || Number.isNaN(b)) return Number(Number.isNaN(a)) - Number(Number.isNaN(b)) || one - two;
            return sign * (a - b) || one - two;
        });
        const { data } = this.store;
        this.count.textContent = `${grouped(this.order.length)} of ${grouped(data.head.shown)} shown runs pass the filter.`;
        this.drawRows();
    }

    private drawRows(): void {
        const first = Math.max(0, Math.floor(this.scroll.scrollTop / ROW_HEIGHT) - AHEAD);
        const height = this.scroll.clientHeight || 400;
        const last = Math.min(this.order.length, first + Math.ceil(height / ROW_HEIGHT) + 2 * AHEAD);
        const spacer = (rows: number) => {
            const row = el("tr", { "aria-hidden": "true" }, el("td", { colspan: this.fields.length, class: "spacer" }));
            row.style.height = `${rows * ROW_HEIGHT}px`;
            return row;
        };
        const rows: Node[] = first > 0 ? [spacer(first)] : [];
        for (let place = first; place < last; place++) rows.push(this.row(place));
        if (last < this.order.length) rows.push(spacer(this.order.length - last));
        this.body.replaceChildren(...rows);
    }

    private row(place: number): HTMLTableRowElement {
        const row = this.order[place];
        const run = this.store.data.run[row];
        const cells = this.fields.map((field, at) => {
            const text = field.text(row);
            if (at === 0) return el("td", { class: "n" }, el("a", { href: `#run=${run}`, tabindex: -1 }, text));
            const tag = field.tag?.(row);
            return el("td", { class: field.numeric ? "n" : "" }, tag ? el("span", { class: `tag c-${tag}` }, el("b", {}, text)) : text);
        });
        const classes = [run === this.store.selected ? "selected" : "", place === this.cursor ? "cursor" : ""].join(" ").trim();
        return el("tr", { class: classes, "data-run": run, click: () => this.open(place) }, ...cells);
    }

    private open(place: number): void {
        this.cursor = place;
        this.store.select(this.store.data.run[this.order[place]]);
    }

    private key(event: KeyboardEvent): void {
        const page = Math.floor(this.scroll.clientHeight / ROW_HEIGHT) - 2;
        const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
        if (event.key === "Enter" && event.target === this.scroll && this.order.length > 0) {
            event.preventDefault();
            this.open(this.cursor);
        } else if (event.key in steps) {
            event.preventDefault();
            this.cursor = Math.min(this.order.length - 1, Math.max(0, this.cursor + steps[event.key]));
            this.keepInView();
            this.drawRows();
        }
    }

    private keepInView(): void {
        const top = this.cursor * ROW_HEIGHT;
        const view = this.scroll.clientHeight - 2 * ROW_HEIGHT;
        if (top < this.scroll.scrollTop) this.scroll.scrollTop = top;
        else if (top > this.scroll.scrollTop + view) this.scroll.scrollTop = top - view;
    }

    private show(run: number | null): void {
        const row = run === null ? undefined : this.store.data.row(run);
        const place = row === undefined ? -1 : this.order.indexOf(row);
        if (place >= 0) {
            this.cursor = place;
            this.keepInView();
        }
        this.drawRows();
    }
}

/** Columns of the table: margins, then inputs, the most influential first, then metrics that vary. */
export function tableColumns(store: Store): number[] {
    const { head } = store.data;
    const varies = (at: number) => {
        const { range } = head.columns[at];
        return range !== null && range[0] < range[1];
    };
    // The margin of a requirement on success only repeats the outcome.
    const measured = head.requirements.filter((requirement) => requirement.histogram !== null);
    const margins = measured.flatMap((requirement) => requirement.margin).filter((at): at is number => at !== null);
    const ranked = head.curves.map((curve) => curve.column);
    const rest = head.columns.map((_, at) => at);
    const ordered = [...margins, ...ranked, ...rest.filter((at) => head.columns[at].group === "input"), ...rest];
    return [...new Set(ordered)].filter((at) => varies(at) && head.columns[at].group !== "cause");
}
