// Time histories: curves of several runs over one another, with limits and events.

import type { ECharts } from "echarts/core";
import { axis, Chart, type Option, tooltip } from "./chart";
import type { Data, Side, Trace } from "./data";
import { el, escaped, select } from "./dom";
import { siText, significant, unitText } from "./format";
import type { Store } from "./store";
import type { Colours } from "./theme";

const DASHES = ["solid", "dashed", "dotted"] as const;

/** Opens the time history of a run; set when the figure exists. */
let opener: (run: number) => void = () => undefined;

export function showTrace(run: number): void {
    opener(run);
}

export function traceName(trace: Trace): string {
    return trace.run === null ? "nominal case" : `run ${trace.run}`;
}

/** When a loop of a trace ended: its signals stand still from then on \[s\]. */
export function endOf(data: Data, trace: Trace, side: Side): number {
    const row = trace.run === null ? undefined : data.row(trace.run);
    const column = data.column(side === "space" ? "space_end_time_s" : "hil_end_time_s");
    const end = row === undefined || column === undefined ? NaN : data.values(column)[row];
    return Number.isFinite(end) ? end : Infinity;
}

/** Events of a run on a loop. */
function events(data: Data, trace: Trace): { time: number; text: string }[] {
    const row = trace.run === null ? undefined : data.row(trace.run);
    if (row === undefined) return [];
    const at = (name: string) => {
        const column = data.column(name);
        return column === undefined ? NaN : data.values(column)[row];
    };
    const causes = data.head.words.causes;
    const cause = (side: number) => causes[data.codes[side === 0 ? 2 : 5][row]].id;
    const all = [
        { time: at("space_touch_time_s"), text: "touch, space" },
        { time: at("hil_touch_time_s"), text: "touch, facility" },
        { time: at("space_capture_time_s"), text: "capture, space" },
        { time: at("hil_capture_time_s"), text: "capture, facility" },
        { time: at("space_cause_time_s"), text: `${cause(0)}, space` },
        { time: at("hil_cause_time_s"), text: `${cause(1)}, facility` },
    ];
    const near = 0.02 * (trace.contact[1] - trace.contact[0]);
    const seen: { time: number; text: string }[] = [];
    for (const event of all.filter((own) => Number.isFinite(own.time)).sort((one, two) => one.time - two.time)) {
        const last = seen[seen.length - 1];
        // Events beside one another share a line, so that their names can be read.
        if (last && event.time - last.time < near) last.text += `; ${event.text}`;
        else seen.push({ ...event });
    }
    return seen;
}

export interface TraceView {
    element: HTMLElement;
    /** Draws the instant of the replay. */
    setCursor: (time: number | null) => void;
    /** Listener for an instant that is clicked in the curves. */
    onTime: (listener: (time: number) => void) => void;
    onTrace: (listener: (trace: Trace) => void) => void;
    current: () => Trace;
}

export function traceFigure(store: Store): TraceView {
    const { data } = store;
    const { head } = data;
    const shown = new Set<number>([0]);
    let current = 0;
    let quantity = head.quantities[0]?.id ?? "";
    let cursor: number | null = null;
    const timeListeners: ((time: number) => void)[] = [];
    const traceListeners: ((trace: Trace) => void)[] = [];

    const option = (now: Colours): Option => {
        const own = head.quantities.find((candidate) => candidate.id === quantity);
        const traces = [...shown].sort((one, two) => one - two);
        const series: Record<string, unknown>[] = [];
        traces.forEach((at, place) => {
            const trace = head.traces[at];
            const time = data.f32(trace.time);
            for (const curve of trace.curves.filter((candidate) => candidate.quantity === quantity)) {
                const values = data.f32(curve.values);
                const end = 1.0001 * endOf(data, trace, curve.place === "space" ? "space" : "facility");
                const colour = curve.place === "space" || curve.place === "measured" ? now.space : now.facility;
                series.push({
                    type: "line", name: `${traceName(trace)}, ${curve.place}`, showSymbol: false, color: colour, silent: true,
                    lineStyle: { width: at === current ? 1.6 : 1.1, type: DASHES[place % DASHES.length], opacity: at === current ? 1 : 0.7 },
                    data: Array.from(time, (instant, index) => [instant, instant <= end ? values[index] : NaN]), z: at === current ? 4 : 3,
                });
            }
        });
        const trace = head.traces[current];
        const limits = (own?.limits ?? []).map((limit) => ({ yAxis: limit.value, label: { formatter: `${limit.requirement} ${siText(limit.value, own?.unit ?? "1")}`, position: "insideEndTop", color: now.limit }, lineStyle: { color: now.limit, type: "solid", width: 1.2 } }));
        const marks = events(data, trace).map((event) => ({ xAxis: event.time, label: { formatter: event.text, color: now.soft, fontSize: 10, rotate: 90, position: "insideEndTop", distance: [2, 4] }, lineStyle: { color: now.soft, type: "dashed", width: 1 } }));
        series.push({ type: "line", name: "marks", data: [], markLine: { symbol: "none", silent: true, animation: false, data: [...limits, ...marks] } });
        const peak = Math.max(0, ...series.flatMap((curve) => ((curve.data as [number, number][]) ?? []).map((point) => point[1])).filter(Number.isFinite));
        const greatest = Math.max(peak, ...(own?.limits ?? []).map((limit) => limit.value));
        const start = trace.contact[0];
        const end = trace.contact[1];
        return {
            grid: { left: 66, right: 20, top: 34, bottom: 74 },
            legend: { top: 0, type: "scroll", textStyle: { color: now.ink }, itemWidth: 18, itemHeight: 3, data: series.slice(0, -1).map((curve) => curve.name as string) },
            xAxis: axis(now, "time [s]", { type: "value", scale: true, min: "dataMin", max: "dataMax", axisLabel: { color: now.soft, hideOverlap: true, showMinLabel: false, showMaxLabel: false, formatter: (value: number) => significant(value, 4) } }),
            yAxis: axis(now, own ? `${own.text}${unitText(own.unit) ? ` [${unitText(own.unit)}]` : ""}` : "", { type: "value", scale: true, nameGap: 50, ...(own?.limits.length ? { max: significantCeil(1.05 * greatest) } : {}), axisLabel: { color: now.soft, formatter: (value: number) => significant(value, 3) } }),
            dataZoom: [
                { type: "inside", startValue: start, endValue: end, filterMode: "none", zoomOnMouseWheel: "ctrl", moveOnMouseWheel: false, moveOnMouseMove: false },
                { type: "slider", startValue: start, endValue: end, filterMode: "none", height: 18, bottom: 8, borderColor: now.rule, textStyle: { color: now.soft }, labelFormatter: (value: number) => `${significant(value, 4)} s` },
            ],
            toolbox: { right: 4, top: 0, itemSize: 13, iconStyle: { borderColor: now.soft }, feature: { dataZoom: { title: { zoom: "Zoom into a box", back: "Undo the zoom" }, filterMode: "none" } } },
            tooltip: tooltip(now, {
                trigger: "axis",
                formatter: (items: { seriesName: string; data: [number, number] }[]) => [`${significant(items[0].data[0], 5)} s`, ...items.slice(0, 8).map((item) => `${escaped(item.seriesName)}: <b>${escaped(siText(item.data[1], own?.unit ?? "1"))}</b>`)].join("<br>"),
            }),
            series,
        };
    };
    let zr: ECharts | undefined;
    const line = el("div", { class: "cursor-line", hidden: true });
    const chart = new Chart({
        title: "Time histories", height: 380, canvas: true, option,
        caption: "Between two points of a curve lie the extremes of a group of instants, so that no peak is lost. Drag the slider or hold Ctrl and turn the wheel to zoom; click to move the replay there.",
        ready: (own) => {
            zr = own;
            own.getZr().on("click", (event) => {
                const pixel = [event.offsetX, event.offsetY];
                if (!own.containPixel("grid", pixel)) return;
                const time = (own.convertFromPixel("grid", pixel) as number[])[0];
                timeListeners.forEach((listener) => listener(time));
            });
            own.on("datazoom", () => place());
            new ResizeObserver(() => requestAnimationFrame(place)).observe(own.getDom());
        },
    });
    chart.element.querySelector(".chart")?.parentElement?.append(line);
    const place = () => {
        const holder = chart.element.querySelector<HTMLElement>(".chart");
        if (!zr || cursor === null || !holder) {
            line.hidden = true;
            return;
        }
        const x = (zr.convertToPixel({ xAxisIndex: 0 }, cursor) as unknown as number) ?? NaN;
        line.hidden = !(x >= 66 && x <= holder.clientWidth - 20);
        line.style.left = `${x}px`;
    };

    const names = head.traces.map((trace, at) => ({ value: String(at), text: `${traceName(trace)} (${trace.kept_as})` }));
    const overlay = el("div", { class: "chips", role: "group", "aria-label": "Runs over one another" });
    const field = select("Run", names, "0", (value) => choose(Number(value)));
    const drawOverlay = () => {
        overlay.replaceChildren(
            el("span", { class: "soft" }, "over it:"),
            ...head.traces.map((trace, at) => {
                const chip = el("button", { type: "button", class: "chip", "aria-pressed": String(shown.has(at)), disabled: at === current }, traceName(trace));
                chip.addEventListener("click", () => {
                    if (shown.has(at)) shown.delete(at);
                    else shown.add(at);
                    drawOverlay();
                    chart.update();
                });
                return chip;
            }),
        );
    };
    const choose = (at: number) => {
        shown.delete(current);
        current = at;
        shown.add(at);
        const element = field.querySelector("select");
        if (element) element.value = String(at);
        drawOverlay();
        chart.update();
        place();
        traceListeners.forEach((listener) => listener(head.traces[current]));
    };
    opener = (run) => {
        const at = head.traces.findIndex((trace) => trace.run === run);
        if (at >= 0) choose(at);
    };
    store.on("selection", () => {
        if (store.selected !== null) opener(store.selected);
    });
    drawOverlay();
    const quantities = head.quantities.map((own) => ({ value: own.id, text: own.text }));
    const controls = el("div", { class: "row" }, field, select("Quantity", quantities, quantity, (value) => {
        quantity = value;
        chart.update();
    }));
    return {
        element: el("div", {}, controls, overlay, chart.element),
        setCursor: (time) => {
            cursor = time;
            place();
        },
        onTime: (listener) => timeListeners.push(listener),
        onTrace: (listener) => traceListeners.push(listener),
        current: () => head.traces[current],
    };
}

/** The next number with two digits above a value. */
function significantCeil(value: number): number {
    if (value <= 0) return 1;
    const size = 10 ** (Math.floor(Math.log10(value)) - 1);
    return Math.ceil(value / size) * size;
}
