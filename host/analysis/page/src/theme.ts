// Dark and light: the scheme of the system, or the reader's choice; paper is always light.

import { button, el } from "./dom";

const KEY = "softdock-theme";
let paper = false;
const listeners: (() => void)[] = [];

export interface Colours {
    ink: string;
    soft: string;
    rule: string;
    paper: string;
    wash: string;
    space: string;
    facility: string;
    limit: string;
    agreement: Record<string, string>;
}

const NAMES = ["true_pass", "true_fail", "false_fail", "false_pass", "aborted", "invalid"];

/** Colours of the style sheet as they stand now. */
export function colours(): Colours {
    const style = getComputedStyle(document.documentElement);
    const of = (name: string) => style.getPropertyValue(`--${name}`).trim();
    return {
        ink: of("ink"),
        soft: of("soft"),
        rule: of("rule"),
        paper: of("paper"),
        wash: of("wash"),
        space: of("space"),
        facility: of("facility"),
        limit: of("limit"),
        agreement: Object.fromEntries(NAMES.map((name) => [name, of(name)])),
    };
}

export function isDark(): boolean {
    return getComputedStyle(document.documentElement).getPropertyValue("--dark").trim() === "1";
}

export function onTheme(listener: () => void): void {
    listeners.push(listener);
}

function notify(): void {
    for (const listener of listeners) listener();
}

function choose(theme: string | null): void {
    if (theme) document.documentElement.dataset.theme = theme;
    else delete document.documentElement.dataset.theme;
}

/** Light colours while the page is printed. */
export function setPaper(on: boolean): void {
    if (on === paper) return;
    paper = on;
    document.documentElement.classList.toggle("paper", on);
    notify();
}

function stored(): string | null {
    // A page that is opened from disk may have no storage.
    try {
        return localStorage.getItem(KEY);
    } catch {
        return null;
    }
}

/** Applies the reader's last choice and returns the switch. */
export function themeSwitch(): HTMLElement {
    choose(stored());
    const text = () => (isDark() ? "Light" : "Dark");
    const control = button(text(), () => {
        const next = isDark() ? "light" : "dark";
        choose(next);
        try {
            localStorage.setItem(KEY, next);
        } catch {
            // The choice then holds for this view alone.
        }
        notify();
    });
    control.setAttribute("aria-label", "Switch between dark and light colours");
    onTheme(() => {
        control.textContent = text();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", notify);
    return el("span", {}, control);
}
