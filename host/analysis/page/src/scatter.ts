// Linked scatter: any two columns, a colour; a click opens a run, a brush filters.

import type { ECharts } from "echarts/core";
import { axis, Chart, type Option, scaleOf, symlog, symlogInverse, tooltip } from "./chart";
import { escaped } from "./dom";
import { axisText, columnText, grouped, shownAs, significant, valueText, wordText } from "./format";
import type { Store } from "./store";
import type { Colours } from "./theme";

/** Runs of each agreement are drawn in this order: rare ones on top. */
const ORDER = ["true_pass", "true_fail", "aborted", "invalid", "false_fail", "false_pass"];

export interface Axes {
    x: number;
    y: number;
    /** Column of the colour; none for the agreement. */
    colour: number | null;
}

/** A logarithmic axis ends a little beyond its data, not at the next power of ten. */
export const logEnds = {
    min: ({ min }: { min: number }) => Number((min / 1.1).toPrecision(2)),
    max: ({ max }: { max: number }) => Number((1.1 * max).toPrecision(2)),
};

/** An axis of a column: transform from SI, its inverse, and the look. */
export function columnAxis(store: Store, now: Colours, at: number, vertical: boolean): {
    to: (value: number) => number;
    back: (value: number) => number;
    look: Record<string, unknown>;
} {
    const column = store.data.head.columns[at];
    const { factor } = shownAs(column, store.units);
    const scale = scaleOf(store.data.values(at));
    const name = axisText(column, store.units);
    const gap = { nameGap: vertical ? 52 : 28 };
    if (scale.kind === "symlog") {
        const { size } = scale;
        return {
            to: (value) => symlog(value, size),
            back: (value) => symlogInverse(value, size),
            look: axis(now, name, {
                type: "value",
                scale: true,
                ...gap,
                axisLabel: {
                    color: now.soft,
                    hideOverlap: true,
                    formatter: (value: number) => significant(factor * symlogInverse(value, size), 2),
                },
            }),
        };
    }
    return {
        to: (value) => factor * value,
        back: (value) => value / factor,
        look: axis(now, name, {
            type: scale.kind === "log" ? "log" : "value",
            scale: true,
            ...(scale.kind === "log" ? logEnds : {}),
            ...gap,
            axisLabel: { color: now.soft, hideOverlap: true, formatter: (value: number) => significant(value, 3) },
        }),
    };
}

export class Scatter {
    readonly chart: Chart;

    constructor(private readonly store: Store, public axes: Axes, title: string, height: number, private readonly brush: boolean) {
        this.chart = new Chart({ title, height, canvas: true, option: (now) => this.option(now), ready: (chart) => this.ready(chart) });
        const update = () => this.chart.update();
        store.on("filter", update);
        store.on("selection", update);
        store.on("units", update);
    }

    setAxes(change: Partial<Axes>): void {
        this.axes = { ...this.axes, ...change };
        this.chart.update();
    }

    private ready(chart: ECharts): void {
        chart.on("click", (event) => {
            const datum = event.data as { row?: number } | undefined;
            const row = Array.isArray(datum) ? (datum as number[])[2] : undefined;
            if (row !== undefined) this.store.select(this.store.data.run[row]);
        });
        chart.on("brushEnd", (event) => {
            const area = (event as { areas?: { coordRange?: [[number, number], [number, number]] }[] }).areas?.[0];
            if (!area?.coordRange) return;
            const now = {} as Colours;
            const [x, y] = [this.axes.x, this.axes.y].map((at, place) => columnAxis(this.store, now, at, place === 1));
            const ends = (range: [number, number], back: (value: number) => number): [number, number] => {
                const [one, two] = range.map(back);
                return [Math.min(one, two), Math.max(one, two)];
            };
            const ranges = new Map(this.store.filter.ranges);
            ranges.set(this.axes.x, ends(area.coordRange[0], x.back));
            ranges.set(this.axes.y, ends(area.coordRange[1], y.back));
            chart.dispatchAction({ type: "brush", areas: [] });
            this.store.setFilter({ ranges });
        });
    }

    private option(now: Colours): Option {
        const { data, rows, selected, units } = this.store;
        const { head } = data;
        const { x: atX, y: atY, colour } = this.axes;
        const [x, y] = [columnAxis(this.store, now, atX, false), columnAxis(this.store, now, atY, true)];
        const [valuesX, valuesY] = [data.values(atX), data.values(atY)];
        const valuesC = colour === null ? null : data.values(colour);
        const passes = new Uint8Array(data.run.length);
        rows.forEach((row) => (passes[row] = 1));
        const groups = new Map<string, number[][]>(ORDER.map((id) => [id, []]));
        const faded: number[][] = [];
        let missing = 0;
        for (let row = 0; row < data.run.length; row++) {
            const dot = [x.to(valuesX[row]), y.to(valuesY[row]), row, valuesC ? valuesC[row] : 0];
            if (!Number.isFinite(dot[0]) || !Number.isFinite(dot[1])) {
                missing += 1;
                continue;
            }
            if (passes[row]) groups.get(data.stratum(row))?.push(dot);
            else faded.push(dot);
        }
        const series: Record<string, unknown>[] = [
            { type: "scatter", name: "filtered out", data: faded, symbolSize: 4, itemStyle: { color: now.soft, opacity: 0.13 }, silent: true, z: 1 },
        ];
        const texts = new Map(head.strata.map((stratum) => [stratum.id, stratum.text]));
        let ends = [0, 1];
        if (valuesC) {
            const finite = Array.from(rows, (row) => valuesC[row]).filter(Number.isFinite).sort((one, two) => one - two);
            ends = finite.length > 0 ? [finite[Math.floor(0.01 * finite.length)], finite[Math.floor(0.99 * (finite.length - 1))]] : ends;
            series.push({ type: "scatter", name: columnText(head.columns[colour as number]), data: ORDER.flatMap((id) => groups.get(id) ?? []), symbolSize: 6, z: 3 });
        } else {
            ORDER.forEach((id, z) => {
                const dots = groups.get(id) ?? [];
                if (dots.length === 0) return;
                series.push({ type: "scatter", name: texts.get(id), data: dots, symbolSize: 6, itemStyle: { color: now.agreement[id], opacity: 0.8 }, z: 3 + z });
            });
        }
        const row = selected === null ? undefined : data.row(selected);
        if (row !== undefined) {
            const dot = [x.to(valuesX[row]), y.to(valuesY[row]), row];
            series.push({ type: "scatter", name: `run ${selected}`, data: [dot], symbolSize: 15, itemStyle: { color: "transparent", borderColor: now.ink, borderWidth: 2 }, z: 20, silent: true });
        }
        this.chart.setCaption(
            `Each dot is one of the ${grouped(data.head.shown)} shown runs; a click opens it.${missing > 0 ? ` ${grouped(missing)} runs without a value on an axis are not drawn.` : ""}${this.brush ? " The box tool filters the table." : ""}`,
        );
        const narrow = innerWidth < 600;
        return {
            grid: { left: 68, right: valuesC ? 70 : 16, top: 34, bottom: 46 },
            legend: { show: !valuesC, top: 0, left: 60, right: 92, type: "scroll", textStyle: { color: now.ink }, itemWidth: 9, itemHeight: 9, itemGap: narrow ? 8 : 14, data: series.slice(1).map((own) => own.name as string).filter((name) => [...texts.values()].includes(name)) },
            toolbox: {
                right: 4, top: 0, itemSize: 14, iconStyle: { borderColor: now.soft },
                feature: { brush: this.brush ? { type: ["rect"], title: { rect: "Filter by a box" } } : undefined, dataZoom: { title: { zoom: "Zoom into a box", back: "Undo the zoom" }, brushStyle: { color: now.space, opacity: 0.15 } } },
            },
            brush: this.brush ? { xAxisIndex: 0, yAxisIndex: 0, brushType: "rect", transformable: false, brushStyle: { color: "rgba(0,114,178,0.12)", borderColor: now.space } } : undefined,
            xAxis: x.look,
            yAxis: y.look,
            visualMap: valuesC
                ? {
                      type: "continuous", dimension: 3, min: ends[0], max: ends[1], right: 0, top: "middle", itemHeight: 160, itemWidth: 12, seriesIndex: 1,
                      textStyle: { color: now.soft }, inRange: { color: ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"] },
                      formatter: (value: number) => valueText(head.columns[colour as number], value, units), calculable: !narrow,
                  }
                : undefined,
            tooltip: tooltip(now, {
                formatter: (item: { data: number[] }) => {
                    const at = item.data[2];
                    const word = wordText(head.words.agreement[data.codes[0][at]]);
                    const lines = [atX, atY, ...(colour === null ? [] : [colour])].map((own) => {
                        const column = head.columns[own];
                        return `${escaped(columnText(column))}: <b>${escaped(valueText(column, data.values(own)[at], units))}</b>`;
                    });
                    return [`<b>Run ${data.run[at]}</b>, ${escaped(word)}`, ...lines].join("<br>");
                },
            }),
            series,
        };
    }
}
