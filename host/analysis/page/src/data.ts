// Data of the page: a head of JSON and a block of numbers, as `host/analysis/src/page_data` writes them.

export interface ArrayPlace {
    kind: "f32" | "u8" | "f64" | "i16";
    offset: number;
    length: number;
}

export interface ShownUnit {
    unit: string;
    factor: number;
}

export type Side = "space" | "facility";

export interface Column {
    name: string;
    label: string;
    unit: string;
    shown: ShownUnit | null;
    meaning: string;
    group: "input" | "metric" | "margin" | "cause";
    side: Side | null;
    dispersed: boolean;
    range: [number, number] | null;
    values: ArrayPlace;
}

export interface Histogram {
    range: [number, number];
    bars: [number[], number[]];
    below: [number, number];
    above: [number, number];
    missing: [number, number];
}

export interface Requirement {
    id: string;
    text: string;
    subject: string;
    metric: string;
    unit: string;
    at_least: number | null;
    at_most: number | null;
    margin: [number | null, number | null];
    value: [number | null, number | null];
    worst: [number | null, number | null];
    tolerance: number | null;
    histogram: Histogram | null;
}

export interface Curve {
    column: number;
    index: number[];
    influence: number;
    centres: ArrayPlace;
    ends: ArrayPlace;
    runs: ArrayPlace;
    shares: ArrayPlace[];
}

export interface OutcomeMap {
    title: string;
    columns: [number | null, number | null];
    ranges: [[number, number], [number, number]];
    logarithmic: [boolean, boolean];
    lines: [string, [number, number][]][];
}

export interface Quantity {
    id: string;
    text: string;
    unit: string;
    limits: { requirement: string; value: number }[];
}

export interface Poses {
    time: ArrayPlace;
    names: string[];
    ranges: [number, number][];
    steps: ArrayPlace;
}

export interface Trace {
    run: number | null;
    kept_as: string;
    time: ArrayPlace;
    contact: [number, number];
    curves: { quantity: string; place: string; values: ArrayPlace }[];
    poses: Poses | null;
}

/** Position and attitude quaternion x, y, z, w. */
export type Place = [number, number, number, number, number, number, number];

export type Solid = { place: Place } & (
    | { shape: "plane" }
    | { shape: "sphere"; radius: number }
    | { shape: "box"; half: [number, number, number] }
    | { shape: "capsule"; radius: number; length: number }
    | { shape: "frustum"; along: [number, number]; radii: [number, number] }
    | { shape: "ring"; radius: number; tube: number }
    | { shape: "hole"; outline: [number, number][] }
    | { shape: "mesh"; vertices: [number, number, number][]; triangles: [number, number, number][] }
);

export interface Robot {
    base: Place;
    joints: { origin: Place; sign: number }[];
    capsules: { joint: number; from: [number, number, number]; to: [number, number, number]; radius: number }[];
    tool: Place;
    rail: [number, number, number] | null;
}

export interface Scene {
    parts: { points: [[number, number, number], number][]; solids: Solid[] }[];
    reach: number;
    joints: { origin: Place; slides: boolean }[];
    tool: Place;
    seat: Place;
    boxes: [[number, number, number], [number, number, number]];
    robots: [Robot, Robot] | null;
    latch: [[number, number, number], [number, number, number]] | null;
}

export interface Head {
    schema: string;
    campaign: string;
    runs: number;
    shown: number;
    strata: { id: string; text: string; total: number; shown: number }[];
    words: {
        agreement: string[];
        outcome: string[];
        phase: string[];
        causes: { id: string; text: string; unit: string }[];
    };
    flags: [number, string, string][];
    columns: Column[];
    run: ArrayPlace;
    flag_bits: ArrayPlace;
    codes: ArrayPlace[];
    requirements: Requirement[];
    counted: [string, string][];
    curves: Curve[];
    maps: { axes: { column: number; edges: number[] }[]; pairs: { columns: [number, number]; counts: ArrayPlace }[] };
    outcome_maps: OutcomeMap[];
    quantities: Quantity[];
    traces: Trace[];
    traced: number[];
    scene: Scene | null;
}

/** Codes of a run in the order of `Head.codes`. */
export const CODE = { agreement: 0, outcome: [1, 4], cause: [2, 5], phase: [3, 6] } as const;

/** The runs that the page shows, column by column. */
export class Data {
    readonly run: Float64Array;
    readonly flags: Float64Array;
    readonly codes: Uint8Array[];
    private readonly cache = new Map<number, Float32Array>();
    private readonly rows = new Map<number, number>();

    constructor(readonly head: Head, private readonly block: ArrayBuffer) {
        this.run = this.f64(head.run);
        this.flags = this.f64(head.flag_bits);
        this.codes = head.codes.map((place) => new Uint8Array(block, place.offset, place.length));
        this.run.forEach((run, row) => this.rows.set(run, row));
    }

    f32(place: ArrayPlace): Float32Array {
        return new Float32Array(this.block, place.offset, place.length);
    }

    f64(place: ArrayPlace): Float64Array {
        return new Float64Array(this.block, place.offset, place.length);
    }

    i16(place: ArrayPlace): Int16Array {
        return new Int16Array(this.block, place.offset, place.length);
    }

    /** Values of a column in SI; NaN stands for none. */
    values(column: number): Float32Array {
        let values = this.cache.get(column);
        if (!values) {
            values = this.f32(this.head.columns[column].values);
            this.cache.set(column, values);
        }
        return values;
    }

    /** Row of a run, if the page shows it. */
    row(run: number): number | undefined {
        return this.rows.get(run);
    }

    /** Agreement of a row; both kinds of aborted sessions are `aborted`. */
    stratum(row: number): string {
        const word = this.head.words.agreement[this.codes[CODE.agreement][row]];
        return word.startsWith("aborted") ? "aborted" : word;
    }

    column(name: string): number | undefined {
        const place = this.head.columns.findIndex((column) => column.name === name);
        return place < 0 ? undefined : place;
    }

    trace(run: number): Trace | undefined {
        return this.head.traces.find((trace) => trace.run === run);
    }
}

/** Reads the data that stand in the page; none without runs. */
export async function readData(): Promise<Data | undefined> {
    const head = document.getElementById("page-head")?.textContent;
    const text = document.getElementById("page-block")?.textContent;
    if (!head || !text) return undefined;
    const binary = atob(text.trim());
    const bytes = new Uint8Array(binary.length);
    for (let at = 0; at < binary.length; at++) bytes[at] = binary.charCodeAt(at);
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Data(JSON.parse(head) as Head, await new Response(stream).arrayBuffer());
}
