// What the figures and the table share: filter, selection, units; and the deep links `#run=N` and `#filter=ID`.

import { CODE, type Data } from "./data";
import type { Units } from "./format";

export interface Filter {
    /** Agreement, or nothing. */
    stratum: string | null;
    /** Cause in either loop. */
    cause: string | null;
    /** Ends of columns by their place, SI. */
    ranges: Map<number, [number, number]>;
}

type Topic = "filter" | "selection" | "units" | "theme";

export class Store {
    filter: Filter = { stratum: null, cause: null, ranges: new Map() };
    selected: number | null = null;
    units: Units = "author";
    /** Rows that pass the filter, in the order of runs. */
    rows: Uint32Array;
    private readonly listeners = new Map<Topic, (() => void)[]>();

    constructor(readonly data: Data) {
        this.rows = this.passing();
    }

    on(topic: Topic, listener: () => void): void {
        this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
    }

    notify(topic: Topic): void {
        for (const listener of this.listeners.get(topic) ?? []) listener();
    }

    private passing(): Uint32Array {
        const { data, filter } = this;
        const causes = data.head.words.causes;
        const cause = filter.cause === null ? -1 : causes.findIndex((own) => own.id === filter.cause);
        const ranges = [...filter.ranges].map(([column, ends]) => ({ values: data.values(column), ends }));
        const rows: number[] = [];
        for (let row = 0; row < data.run.length; row++) {
            if (filter.stratum !== null && data.stratum(row) !== filter.stratum) continue;
            if (filter.cause !== null && CODE.cause.every((code) => data.codes[code][row] !== cause)) continue;
            if (ranges.every(({ values, ends }) => values[row] >= ends[0] && values[row] <= ends[1])) rows.push(row);
        }
        return Uint32Array.from(rows);
    }

    setFilter(change: Partial<Filter>): void {
        this.filter = { ...this.filter, ...change };
        this.rows = this.passing();
        this.notify("filter");
    }

    clearFilter(): void {
        this.setFilter({ stratum: null, cause: null, ranges: new Map() });
    }

    setRange(column: number, ends: [number, number] | null): void {
        const ranges = new Map(this.filter.ranges);
        if (ends) ranges.set(column, ends);
        else ranges.delete(column);
        this.setFilter({ ranges });
    }

    /** Opens a run, or closes the panel. */
    select(run: number | null, link = true): void {
        this.selected = run;
        if (link) history.replaceState(null, "", run === null ? location.pathname + location.search : `#run=${run}`);
        this.notify("selection");
    }

    setUnits(units: Units): void {
        this.units = units;
        this.notify("units");
    }

    /** Follows the address; true if it named a run or a filter. */
    follow(hash: string): boolean {
        const [, key, value] = /^#(run|filter)=([\w-]+)$/.exec(hash) ?? [];
        if (key === "run" && /^\d+$/.test(value)) {
            this.select(Number(value), false);
            return true;
        }
        if (key === "filter" && this.data.head.strata.some((stratum) => stratum.id === value)) {
            this.setFilter({ stratum: value, cause: null, ranges: new Map() });
            return true;
        }
        return false;
    }
}
