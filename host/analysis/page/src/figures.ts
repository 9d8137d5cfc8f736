// Figures over all runs: margins, success along the inputs, maps over pairs; and maps of outcomes and the energy.

import { axis, Chart, type Option, tooltip } from "./chart";
import { CODE, type Curve, type Data, type OutcomeMap, type Requirement } from "./data";
import { button, el, escaped, select } from "./dom";
import { axisText, columnText, grouped, percent, shownAs, significant } from "./format";
import { columnAxis, logEnds, Scatter } from "./scatter";
import type { Store } from "./store";
import type { Colours } from "./theme";

const SIDES = ["space", "facility"] as const;

/** Unit in which a requirement's margin is shown. */
function marginUnit(store: Store, own: Requirement): { unit: string; factor: number } {
    const at = own.margin[0] ?? own.margin[1];
    return at === null ? { unit: own.unit, factor: 1 } : shownAs(store.data.head.columns[at], store.units);
}

function margins(store: Store, own: Requirement): HTMLElement {
    const histogram = own.histogram;
    const title = el("h3", {}, own.id, " ", el("span", { class: "text" }, own.text));
    if (!histogram) return el("div", { class: "margin" }, title, el("p", { class: "soft" }, "The margin takes fewer than three values: see the counts in section 1."));
    let cumulative = false;
    const { range, bars, below, above, missing } = histogram;
    const width = (range[1] - range[0]) / bars[0].length;
    const option = (now: Colours): Option => {
        const { unit, factor } = marginUnit(store, own);
        const line = (value: number, text: string, colour: string) => ({ xAxis: factor * value, label: { formatter: text, color: colour, position: "insideEndTop" }, lineStyle: { color: colour, type: "solid", width: 1.4 } });
        const marks = [line(0, "limit", now.limit), ...(own.tolerance === null || !cumulative ? [] : [line(own.tolerance, "tolerance limit in space", now.space)])];
        const points = (side: number): [number, number][] => {
            const counts = bars[side];
            if (!cumulative) return counts.flatMap((count, at) => [0, 1].map((end): [number, number] => [factor * (range[0] + (at + end) * width), count]));
            const total = counts.reduce((sum, count) => sum + count, below[side] + above[side] + missing[side]);
            let sum = below[side] + missing[side];
            const curve: [number, number][] = [[factor * range[0], sum / Math.max(1, total)]];
            counts.forEach((count, at) => {
                sum += count;
                curve.push([factor * (range[0] + (at + 1) * width), sum / Math.max(1, total)]);
            });
            return curve;
        };
        return {
            grid: { left: 62, right: 16, top: 18, bottom: 44 },
            xAxis: axis(now, unit ? `margin [${unit}]` : "margin", { type: "value", min: factor * range[0], max: factor * range[1], axisLabel: { color: now.soft, hideOverlap: true, showMinLabel: false, showMaxLabel: false, formatter: (value: number) => significant(value, 3) } }),
            yAxis: axis(now, cumulative ? "share of runs with at most this margin" : "runs", { type: "value", min: 0, nameGap: 46, ...(cumulative ? { max: 1 } : {}) }),
            tooltip: tooltip(now, {
                trigger: "axis",
                formatter: (items: { seriesName: string; data: [number, number] }[]) =>
                    [`margin ${escaped(significant(items[0].data[0], 3))} ${escaped(unit)}`, ...items.map((item) => `${escaped(item.seriesName)}: <b>${cumulative ? percent(item.data[1]) : grouped(item.data[1])}</b>`)].join("<br>"),
            }),
            series: SIDES.map((side, at) => ({
                type: "line", name: side, data: points(at), showSymbol: false, color: now[side], lineStyle: { width: 1.6 },
                areaStyle: at === 0 && !cumulative ? { opacity: 0.35 } : undefined,
                markLine: at === 0 ? { symbol: "none", silent: true, data: marks } : undefined,
            })),
        };
    };
    const notes = SIDES.map((side, at) => {
        const parts = [[below[at] + above[at], "beyond the axis"], [missing[at], "without a margin (metric not available, or run invalid)"]].filter(([count]) => (count as number) > 0);
        return parts.length > 0 ? `${side}: ${parts.map(([count, text]) => `${grouped(count as number)} ${text}`).join(", ")}.` : "";
    });
    const chart = new Chart({ title: `Margin of ${own.id}`, height: 250, option, caption: ["Margins of all runs; right of the limit the requirement holds.", ...notes].filter(Boolean).join(" ") });
    const toggle = button("Cumulative", () => {
        cumulative = !cumulative;
        toggle.setAttribute("aria-pressed", String(cumulative));
        chart.update();
    }, { "aria-pressed": "false", class: "chip" });
    store.on("units", () => chart.update());
    const worst = own.worst.map((run, side) => (run === null ? [] : [el("a", { href: `#run=${run}` }, `run ${run}`), ` ${side === 0 ? "in space" : "on the facility"} `]));
    return el("div", { class: "margin" }, title, el("p", { class: "row" }, toggle, el("span", { class: "note" }, "worst: ", ...worst.flat())), chart.element);
}

export function marginFigures(store: Store): HTMLElement[] {
    return store.data.head.requirements.map((own) => margins(store, own));
}

/** One curve with its band. */
function band(now: Colours, colour: string, name: string, points: [number, number, number, number][]): Record<string, unknown>[] {
    const base = { type: "line", showSymbol: false, silent: true, color: colour };
    return [
        { ...base, stack: name, data: points.map(([x, , lo]) => [x, lo]), lineStyle: { opacity: 0 }, tooltip: { show: false } },
        { ...base, stack: name, data: points.map(([x, , lo, hi]) => [x, hi - lo]), lineStyle: { opacity: 0 }, areaStyle: { opacity: 0.18 }, tooltip: { show: false } },
        { type: "line", name, data: points.map(([x, share]) => [x, share]), color: colour, showSymbol: true, symbolSize: 4, lineStyle: { width: 1.7 }, z: 3 },
    ].map((own) => ({ ...own, textStyle: { color: now.ink } }));
}

/** Events of the figure: places in `Head.counted`. */
const EVENTS: Record<string, { text: string; events: number[] }> = {
    success: { text: "task success, space and facility", events: [0, 1] },
    wrong: { text: "false pass and false fail", events: [3, 4] },
    aborted: { text: "aborted sessions", events: [2] },
};

function curveChart(store: Store, curve: Curve, chosen: () => string): Chart {
    const { data } = store;
    const column = data.head.columns[curve.column];
    const colour = (now: Colours, event: number) => [now.space, now.facility, now.agreement.aborted, now.agreement.false_pass, now.agreement.false_fail][event];
    const option = (now: Colours): Option => {
        const { unit, factor } = shownAs(column, store.units);
        const [centres, runs] = [data.f32(curve.centres), data.f64(curve.runs)];
        const { events } = EVENTS[chosen()];
        const logarithmic = centres[0] > 0 && centres[centres.length - 1] / centres[0] > 5;
        const series = events.flatMap((event) => {
            const shares = data.f32(curve.shares[event]);
            const points = Array.from(centres, (centre, at): [number, number, number, number] => [factor * centre, shares[3 * at], shares[3 * at + 1], shares[3 * at + 2]]);
            return band(now, colour(now, event), data.head.counted[event][1], points);
        });
        return {
            grid: { left: 48, right: 14, top: 12, bottom: 44 },
            xAxis: axis(now, axisText(column, store.units), { type: logarithmic ? "log" : "value", scale: true, ...(logarithmic ? logEnds : {}), axisLabel: { color: now.soft, hideOverlap: true, formatter: (value: number) => significant(value, 3) } }),
            yAxis: axis(now, "share of runs", { type: "value", min: 0, max: chosen() === "success" ? 1 : undefined, nameGap: 34 }),
            tooltip: tooltip(now, {
                trigger: "axis",
                formatter: (items: { seriesName: string; dataIndex: number; componentSubType: string; data: [number, number] }[]) => {
                    const at = items[0].dataIndex;
                    const lines = events.map((event) => {
                        const shares = data.f32(curve.shares[event]);
                        return `${escaped(data.head.counted[event][1])}: <b>${percent(shares[3 * at])}</b> (${percent(shares[3 * at + 1])} to ${percent(shares[3 * at + 2])})`;
                    });
                    const ends = data.f32(curve.ends);
                    return [`${escaped(column.label)} ${significant(factor * ends[2 * at], 3)} to ${significant(factor * ends[2 * at + 1], 3)} ${escaped(unit)}: ${grouped(runs[at])} runs`, ...lines].join("<br>");
                },
            }),
            series,
        };
    };
    return new Chart({ title: `${column.label}: shares of runs`, height: 230, option, caption: "" });
}

function curveFigures(store: Store): HTMLElement {
    const { curves, counted, columns } = store.data.head;
    if (curves.length === 0) return el("p", { class: "soft" }, "No input varies, or there are too few runs.");
    let chosen = "success";
    const grid = el("div", { class: "figures thirds" });
    const rank = (curve: Curve) => Math.max(...EVENTS[chosen].events.map((event) => curve.index[event]));
    const charts = curves.map((curve) => ({ curve, chart: curveChart(store, curve, () => chosen) }));
    let whole = false;
    const few = 6;
    const more = button("", () => {
        whole = !whole;
        order();
    });
    const order = () => {
        charts.sort((one, two) => rank(two.curve) - rank(one.curve));
        charts.forEach(({ curve, chart }, at) => {
            const index = EVENTS[chosen].events.map((event) => `${counted[event][1]} ${significant(curve.index[event], 2)}`).join(", ");
            chart.setCaption(`${at + 1}. ${columns[curve.column].meaning}. Index: ${index}.`);
            chart.element.classList.toggle("later", at >= few && !whole);
            grid.append(chart.element);
            chart.update();
        });
        more.hidden = charts.length <= few;
        more.textContent = whole ? `Show the ${few} most influential inputs` : `Show all ${charts.length} inputs`;
    };
    store.on("units", () => charts.forEach(({ chart }) => chart.update()));
    const options = Object.entries(EVENTS).map(([value, { text }]) => ({ value, text }));
    const field = select("Show", options, chosen, (value) => {
        chosen = value;
        order();
    });
    order();
    return el("div", {}, el("div", { class: "row" }, field), grid, more);
}

/** Share of runs with an event over two inputs. */
function pairFigure(store: Store): HTMLElement {
    const { data } = store;
    const { head } = data;
    const { maps } = head;
    if (maps.pairs.length === 0) return el("div");
    let [one, two] = [maps.pairs[0].columns[0], maps.pairs[0].columns[1]];
    let event = 1;
    const edges = (column: number) => maps.axes.find((own) => own.column === column)?.edges ?? [];
    const label = (column: number, at: number) => {
        const { factor } = shownAs(head.columns[column], store.units);
        const ends = edges(column);
        return `${significant(factor * ends[at], 2)}\u2013${significant(factor * ends[at + 1], 2)}`;
    };
    const option = (now: Colours): Option => {
        const pair = maps.pairs.find((own) => own.columns.includes(one) && own.columns.includes(two));
        if (!pair) return { title: { text: "Choose two inputs", textStyle: { color: now.soft, fontWeight: "normal", fontSize: 13 } }, series: [] };
        const counts = data.f64(pair.counts);
        const swapped = pair.columns[0] !== one;
        const [wide, high] = [edges(one).length - 1, edges(two).length - 1];
        const columns = edges(pair.columns[0]).length - 1;
        const step = 1 + head.counted.length;
        const cells: [number, number, number, number][] = [];
        let greatest = 0;
        for (let x = 0; x < wide; x++) {
            for (let y = 0; y < high; y++) {
                const place = step * (swapped ? x * columns + y : y * columns + x);
                const runs = counts[place];
                if (runs === 0) continue;
                const share = counts[place + 1 + event] / runs;
                greatest = Math.max(greatest, share);
                cells.push([x, y, share, runs]);
            }
        }
        const category = (column: number, count: number, name: string, gap: number, interval?: number) =>
            axis(now, name, { type: "category", data: Array.from({ length: count }, (_, at) => label(column, at)), nameGap: gap, splitLine: { show: false }, axisLabel: { color: now.soft, hideOverlap: true, interval, fontSize: 11 } });
        return {
            grid: { left: 116, right: 74, top: 12, bottom: 46 },
            xAxis: category(one, wide, axisText(head.columns[one], store.units), 28),
            yAxis: category(two, high, axisText(head.columns[two], store.units), 98, 0),
            visualMap: { min: 0, max: event < 2 ? 1 : Math.max(greatest, 1e-9), dimension: 2, calculable: false, right: 0, top: "middle", itemHeight: 150, itemWidth: 12, textStyle: { color: now.soft }, formatter: (value: number) => percent(value), inRange: { color: ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"] } },
            tooltip: tooltip(now, {
                formatter: (item: { data: [number, number, number, number] }) => {
                    const [x, y, share, runs] = item.data;
                    return `${escaped(head.columns[one].label)} ${escaped(label(one, x))}<br>${escaped(head.columns[two].label)} ${escaped(label(two, y))}<br>${escaped(head.counted[event][1])}: <b>${percent(share)}</b> of ${grouped(runs)} runs`;
                },
            }),
            series: [{ type: "heatmap", data: cells, itemStyle: { borderColor: now.paper, borderWidth: 1 } }],
        };
    };
    const chart = new Chart({ title: "Share of runs over two inputs", height: 380, option, caption: "Share of all runs in each cell; the ends of the cells divide each input into groups of equal size. An empty cell has no run." });
    const options = maps.axes.map((own) => ({ value: String(own.column), text: columnText(head.columns[own.column]) }));
    const pick = (name: string, value: number, choose: (at: number) => void) =>
        select(name, options, String(value), (text) => {
            choose(Number(text));
            chart.update();
        });
    const events = head.counted.map(([, text], at) => ({ value: String(at), text }));
    store.on("units", () => chart.update());
    const controls = el("div", { class: "row" }, pick("Horizontal", one, (at) => (one = at)), pick("Vertical", two, (at) => (two = at)), select("Share of", events, String(event), (text) => {
        event = Number(text);
        chart.update();
    }));
    return el("div", {}, el("h3", {}, "Pairs of inputs"), controls, chart.element);
}

export function successFigures(store: Store): HTMLElement[] {
    return [curveFigures(store), pairFigure(store)];
}

/** Colours of the causes of a map, the most frequent first. */
const CAUSE_COLOURS = ["#d55e00", "#0072b2", "#cc79a7", "#e69f00", "#8f6bb3", "#a0a0a0"];
const LINE_COLOURS = ["limit", "#992222", "#225599"];

function causeOrder(data: Data): number[] {
    const counts = new Map<number, number>();
    for (const code of CODE.cause) data.codes[code].forEach((cause) => cause > 0 && counts.set(cause, (counts.get(cause) ?? 0) + 1));
    return [...counts].sort((one, two) => two[1] - one[1]).map(([cause]) => cause);
}

function outcomeMap(store: Store, map: OutcomeMap): HTMLElement {
    const { data } = store;
    const { head } = data;
    const [atX, atY] = map.columns;
    if (atX === null || atY === null) return el("p", { class: "soft" }, `${map.title}: an input is missing in the results.`);
    const order = causeOrder(data);
    const charts = ([0, 1] as const).map((side) => {
        const option = (now: Colours): Option => {
            const [x, y] = [columnAxis(store, now, atX, false), columnAxis(store, now, atY, true)];
            const factors = [atX, atY].map((at) => shownAs(head.columns[at], store.units).factor);
            const limits = (place: 0 | 1) => ({ type: map.logarithmic[place] ? "log" : "value", min: factors[place] * map.ranges[place][0], max: factors[place] * map.ranges[place][1] });
            const [valuesX, valuesY] = [data.values(atX), data.values(atY)];
            const dots = (cause: number) => {
                const own: number[][] = [];
                data.codes[CODE.cause[side]].forEach((code, row) => code === cause && own.push([factors[0] * valuesX[row], factors[1] * valuesY[row], row]));
                return own;
            };
            const colour = (cause: number) => (cause === 0 ? now.agreement.true_pass : CAUSE_COLOURS[Math.min(order.indexOf(cause), CAUSE_COLOURS.length - 1)]);
            return {
                grid: { left: 68, right: 14, top: 40, bottom: 46 },
                legend: { top: 0, type: "scroll", textStyle: { color: now.ink }, itemWidth: 9, itemHeight: 9 },
                xAxis: { ...x.look, ...limits(0) },
                yAxis: { ...y.look, ...limits(1) },
                tooltip: tooltip(now, { formatter: (item: { data: number[]; seriesName: string }) => (item.data[2] === undefined ? escaped(item.seriesName) : `<b>Run ${data.run[item.data[2]]}</b>: ${escaped(item.seriesName)}`) }),
                series: [
                    ...[0, ...order].map((cause) => ({ type: "scatter", name: cause === 0 ? "pass" : head.words.causes[cause].text, data: dots(cause), symbolSize: 5, itemStyle: { color: colour(cause), opacity: 0.85 } })).filter((own) => own.data.length > 0),
                    ...map.lines.map(([name, points], at) => ({ type: "line", name, showSymbol: false, data: points.map(([px, py]) => [factors[0] * px, factors[1] * py]), color: LINE_COLOURS[at % 3] === "limit" ? now.limit : LINE_COLOURS[at % 3], lineStyle: { width: 1.8 }, z: 4, clip: true })),
                ],
            };
        };
        const chart = new Chart({
            title: `${map.title}, ${side === 0 ? "in space" : "on the facility"}`, height: 360, canvas: true, option, caption: side === 0 ? "In space: the shown runs." : "On the facility: the shown runs.",
            ready: (own) => own.on("click", (event) => {
                const row = Array.isArray(event.data) ? (event.data as number[])[2] : undefined;
                if (row !== undefined) store.select(data.run[row]);
            }),
        });
        store.on("units", () => chart.update());
        return chart.element;
    });
    return el("div", {}, el("h4", {}, map.title), el("div", { class: "figures" }, ...charts));
}

export function outcomeFigures(store: Store): HTMLElement[] {
    return store.data.head.outcome_maps.map((map) => outcomeMap(store, map));
}

export function energyFigure(store: Store): HTMLElement {
    const [delay, energy] = [store.data.column("in_loop_delay_s"), store.data.column("hil_injected_energy_j")];
    if (delay === undefined || energy === undefined || store.data.head.columns[energy].range === null) return el("p", { class: "soft" }, "No run has both numbers.");
    const scatter = new Scatter(store, { x: delay, y: energy, colour: null }, "Energy injected by the facility against loop delay", 380, false);
    return el("div", {}, el("p", { class: "note" }, "Energy that the facility has put into the simulated contact: space port minus hardware port. An axis of many sizes is linear around zero and logarithmic far from it."), scatter.chart.element);
}
