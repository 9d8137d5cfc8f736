// Puts the interactive parts into the page.

import { printAll } from "./chart";
import { readData } from "./data";
import { byId, el, select } from "./dom";
import { explorer, sampleText } from "./explorer";
import { energyFigure, marginFigures, outcomeFigures, successFigures } from "./figures";
import type { Units } from "./format";
import { panel } from "./panel";
import { replay } from "./replay";
import { shell } from "./shell";
import { Store } from "./store";
import { onTheme } from "./theme";
import { traceFigure } from "./traces";

async function start(): Promise<void> {
    shell();
    const data = await readData();
    if (!data) return;
    const store = new Store(data);
    const units = select(
        "Units",
        [{ value: "author", text: "author's" }, { value: "si", text: "SI" }],
        store.units,
        (value) => store.setUnits(value as Units),
    );
    byId("controls")?.append(units);
    const sample = byId("sample");
    if (sample) sample.textContent = sampleText(store);
    byId("explorer")?.append(explorer(store));
    byId("margin-figures")?.append(...marginFigures(store));
    byId("success-figures")?.append(...successFigures(store));
    byId("outcome-figures")?.append(...outcomeFigures(store));
    byId("energy-figure")?.append(energyFigure(store));
    const holder = byId("trace-figure");
    if (holder && data.head.traces.length > 0) {
        const view = traceFigure(store);
        holder.append(view.element);
        byId("replay")?.append(replay(data, view, onTheme));
    } else holder?.append(el("p", { class: "soft" }, "No trace of these runs is in the results folder."));
    const aside = byId("panel");
    if (aside) panel(store, aside);

    const follow = () => {
        if (store.follow(location.hash) && location.hash.startsWith("#filter")) byId("runs")?.scrollIntoView();
    };
    addEventListener("hashchange", follow);
    follow();
    addEventListener("beforeprint", () => printAll(true));
    addEventListener("afterprint", () => printAll(false));
    document.documentElement.dataset.ready = String(Math.round(performance.now()));
}

// The first screen, which needs no script, is drawn before the figures are prepared.
requestAnimationFrame(() => setTimeout(() => void start(), 0));
