// A figure: drawn when it comes into view, in the colours of the theme, exported as PNG and SVG, and on paper.

import { HeatmapChart, LineChart, ScatterChart } from "echarts/charts";
import {
    BrushComponent,
    DataZoomComponent,
    GridComponent,
    LegendComponent,
    MarkLineComponent,
    ToolboxComponent,
    TooltipComponent,
    VisualMapComponent,
} from "echarts/components";
import { type ECharts, type EChartsCoreOption, init, use } from "echarts/core";
import { CanvasRenderer, SVGRenderer } from "echarts/renderers";
import { type ImageKind, el, saveButtons, saveFile } from "./dom";
import { type Colours, colours, onTheme } from "./theme";

use([
    BrushComponent,
    CanvasRenderer,
    DataZoomComponent,
    GridComponent,
    HeatmapChart,
    LegendComponent,
    LineChart,
    MarkLineComponent,
    SVGRenderer,
    ScatterChart,
    ToolboxComponent,
    TooltipComponent,
    VisualMapComponent,
]);

export type Option = EChartsCoreOption;

const FONT = '"Helvetica Neue", Helvetica, Arial, "Liberation Sans", "DejaVu Sans", sans-serif';

/** Width of a figure on A4 paper, alone and beside another, CSS pixels. */
const PAPER_WIDTHS = [660, 322];

export interface ChartInput {
    /** Text for readers of the screen, and name of exported files. */
    title: string;
    height: number;
    option: (colours: Colours) => Option;
    /** Many dots are drawn on a canvas. */
    canvas?: boolean;
    caption?: string;
    /** Called once when the chart exists. */
    ready?: (chart: ECharts) => void;
}

const all: Chart[] = [];

export class Chart {
    readonly element: HTMLElement;
    chart: ECharts | undefined;
    private readonly holder: HTMLElement;
    private readonly caption: HTMLElement;

    constructor(private readonly input: ChartInput) {
        this.holder = el("div", { class: "chart", role: "img", "aria-label": input.title });
        this.holder.style.height = `${input.height}px`;
        const save = saveButtons(input.title, (kind) => this.save(kind));
        this.caption = el("span", {}, input.caption ?? "");
        this.element = el("figure", { class: "figure" }, this.holder, el("figcaption", {}, this.caption, save));
        all.push(this);
        new IntersectionObserver(
            (entries, observer) => {
                if (entries.some((entry) => entry.isIntersecting)) {
                    observer.disconnect();
                    this.draw();
                }
            },
            { rootMargin: "300px" },
        ).observe(this.holder);
        new ResizeObserver(() => this.chart?.resize()).observe(this.holder);
    }

    setCaption(text: string): void {
        this.caption.textContent = text;
    }

    private option(): Option {
        const now = colours();
        return {
            animation: false,
            textStyle: { fontFamily: FONT, color: now.ink, fontSize: 12 },
            ...this.input.option(now),
        };
    }

    /** Draws the figure if it is not drawn yet; a hidden one needs a width. */
    draw(width?: number): void {
        if (this.chart || !this.holder.isConnected) return;
        const size = width === undefined ? {} : { width, height: this.input.height };
        this.chart = init(this.holder, null, { renderer: this.input.canvas ? "canvas" : "svg", locale: "EN", ...size });
        this.chart.setOption(this.option());
        this.input.ready?.(this.chart);
    }

    /** Draws it anew if it is drawn; zoom and brush begin anew with `whole`. */
    update(whole = true): void {
        this.chart?.setOption(this.option(), { notMerge: whole });
    }

    /** Draws it for paper, at once and at the width of paper. */
    print(on: boolean): void {
        const width = PAPER_WIDTHS[this.holder.closest(".figures") ? 1 : 0];
        if (on) this.draw(width);
        this.update();
        this.chart?.resize(on ? { width, height: this.input.height } : { width: "auto", height: "auto" });
        this.chart?.getZr().flush();
    }

    private save(kind: ImageKind): void {
        const { width, height } = this.holder.getBoundingClientRect();
        const copy = el("div");
        copy.style.cssText = `position:fixed;left:-9999px;width:${width}px;height:${height}px`;
        document.body.append(copy);
        const chart = init(copy, null, { renderer: kind === "png" ? "canvas" : "svg", width, height });
        chart.setOption({ ...this.option(), toolbox: { show: false } });
        chart.getZr().flush();
        const url = chart.getDataURL({ type: kind, pixelRatio: 2, backgroundColor: colours().paper });
        saveFile(this.input.title, kind, url);
        chart.dispose();
        copy.remove();
    }
}

/** Draws all figures for paper, or back for the screen. */
export function printAll(on: boolean): void {
    for (const chart of all) if (chart.element.isConnected) chart.print(on);
}

onTheme(() => all.forEach((chart) => chart.update()));

/** Look of an axis. */
export function axis(now: Colours, name: string, more: Record<string, unknown> = {}): Record<string, unknown> {
    return {
        name,
        nameLocation: "middle",
        nameGap: 28,
        nameTextStyle: { color: now.soft },
        axisLine: { show: true, onZero: false, lineStyle: { color: now.soft } },
        axisTick: { show: true, lineStyle: { color: now.soft } },
        axisLabel: { color: now.soft, hideOverlap: true },
        splitLine: { show: true, lineStyle: { color: now.rule, opacity: 0.6 } },
        ...more,
    };
}

export function tooltip(now: Colours, more: Record<string, unknown> = {}): Record<string, unknown> {
    return {
        confine: true,
        transitionDuration: 0,
        backgroundColor: now.paper,
        borderColor: now.rule,
        textStyle: { color: now.ink, fontSize: 12 },
        ...more,
    };
}

/** Linear near zero, logarithmic beyond `size`. */
export function symlog(value: number, size: number): number {
    return Math.sign(value) * Math.log10(1 + Math.abs(value) / size);
}

export function symlogInverse(value: number, size: number): number {
    return Math.sign(value) * size * (10 ** Math.abs(value) - 1);
}

/** Scale of an axis for values of many sizes. */
export function scaleOf(values: ArrayLike<number>): { kind: "linear" } | { kind: "log" } | { kind: "symlog"; size: number } {
    const sizes: number[] = [];
    let [lo, hi] = [Infinity, -Infinity];
    for (let at = 0; at < values.length; at++) {
        const value = values[at];
        if (!Number.isFinite(value)) continue;
        lo = Math.min(lo, value);
        hi = Math.max(hi, value);
        if (value !== 0) sizes.push(Math.abs(value));
    }
    sizes.sort((one, two) => one - two);
    const typical = sizes[Math.floor(sizes.length / 2)] ?? 0;
    if (lo > 0 && hi / lo > 20) return { kind: "log" };
    if (typical > 0 && Math.max(hi, -lo) > 50 * typical) return { kind: "symlog", size: 10 ** Math.floor(Math.log10(typical)) };
    return { kind: "linear" };
}
