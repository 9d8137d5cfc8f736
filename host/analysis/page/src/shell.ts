// What every page has: the contents list, the switch of colours, the date, light colours on paper, and boxes that scroll.

import { byId, el } from "./dom";
import { setPaper, themeSwitch } from "./theme";

/** Width from which the contents list stands beside the page, px. */
const BESIDE = 1360;

/** Lists the sections of a page whose template lists none. */
function listSections(list: HTMLElement): void {
    document.querySelectorAll<HTMLElement>("main h2").forEach((heading, index) => {
        heading.id ||= `section-${index + 1}`;
        const text = heading.textContent?.replace(/^\d+\. /, "") ?? "";
        list.append(el("li", {}, el("a", { href: `#${heading.id}` }, text)));
    });
}

export function shell(): void {
    byId("controls")?.append(themeSwitch());
    const list = byId("contents");
    if (list && list.childElementCount === 0) listSections(list);
    const written = new Date(document.lastModified);
    const stamp = byId("written");
    if (stamp && Number.isFinite(written.getTime())) {
        const text = written.toLocaleString("sv-SE", { dateStyle: "short", timeStyle: "short" });
        stamp.textContent = ` \u00b7 page written ${text}`;
    }
    // Narrow screens begin with the contents folded.
    const contents = document.querySelector<HTMLDetailsElement>("nav.contents details");
    if (contents && innerWidth < BESIDE) contents.open = false;
    // Only what scrolls is a stop of the keyboard.
    const stop = new ResizeObserver((entries) => {
        for (const { target } of entries) {
            const box = target as HTMLElement;
            const scrolls = box.scrollWidth > box.clientWidth + 1 || box.classList.contains("runs-scroll");
            if (scrolls) box.tabIndex = 0;
            else box.removeAttribute("tabindex");
        }
    });
    for (const box of document.querySelectorAll(".scroll")) stop.observe(box);
    addEventListener("beforeprint", () => setPaper(true));
    addEventListener("afterprint", () => setPaper(false));
}
