// Elements. Text of users enters the page through `textContent` alone.

type Attributes = Record<string, string | number | boolean | ((event: Event) => void) | undefined>;

/** An element with attributes (functions are listeners) and children; strings become text. */
export function el<K extends keyof HTMLElementTagNameMap>(
    tag: K,
    attributes: Attributes = {},
    ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (typeof value === "function") element.addEventListener(name, value);
        else if (value === true) element.setAttribute(name, "");
        else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
    }
    element.append(...children);
    return element;
}

/** A labelled select; `choose` gets the value. */
export function select(
    label: string,
    options: { value: string; text: string; group?: string }[],
    value: string,
    choose: (value: string) => void,
): HTMLLabelElement {
    const field = el("select", { change: () => choose(field.value) });
    const groups = new Map<string, HTMLOptGroupElement>();
    for (const option of options) {
        const item = el("option", { value: option.value, selected: option.value === value }, option.text);
        if (!option.group) {
            field.append(item);
            continue;
        }
        let group = groups.get(option.group);
        if (!group) {
            group = el("optgroup", { label: option.group });
            groups.set(option.group, group);
            field.append(group);
        }
        group.append(item);
    }
    field.value = value;
    return el("label", { class: "field" }, el("span", {}, label), field);
}

/** A button with text. */
export function button(text: string, press: () => void, attributes: Attributes = {}): HTMLButtonElement {
    return el("button", { type: "button", click: press, ...attributes }, text);
}

/** Fragment for text inside markup of a tooltip. */
export function escaped(text: string): string {
    const holder = document.createElement("span");
    holder.textContent = text;
    return holder.innerHTML.replaceAll('"', "&quot;");
}

export function byId(id: string): HTMLElement | null {
    return document.getElementById(id);
}

export type ImageKind = "png" | "svg";

/** Buttons that save a figure. */
export function saveButtons(title: string, save: (kind: ImageKind) => void): HTMLElement {
    return el(
        "span",
        { class: "save" },
        button("PNG", () => save("png"), { "aria-label": `Save as PNG: ${title}` }),
        button("SVG", () => save("svg"), { "aria-label": `Save as SVG: ${title}` }),
    );
}

/** Saves a figure under its title. */
export function saveFile(title: string, kind: ImageKind, url: string): void {
    const name = title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");
    el("a", { href: url, download: `${name}.${kind}` }).click();
}
