// Entry of the pages whose figures are drawn by the program: the shell, and each figure as a file.

import { saveButtons, saveFile } from "./dom";
import { shell } from "./shell";

/** Pixels of a saved PNG per pixel of the screen. */
const SCALE = 2;

function asPng(svg: SVGSVGElement, text: string, done: (url: string) => void): void {
    const { width, height } = svg.getBoundingClientRect();
    const image = new Image();
    image.addEventListener("load", () => {
        const canvas = document.createElement("canvas");
        [canvas.width, canvas.height] = [SCALE * width, SCALE * height];
        const pen = canvas.getContext("2d");
        if (!pen) return;
        pen.fillStyle = "#fff";
        pen.fillRect(0, 0, canvas.width, canvas.height);
        pen.drawImage(image, 0, 0, canvas.width, canvas.height);
        done(canvas.toDataURL("image/png"));
    });
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
}

for (const figure of document.querySelectorAll("figure")) {
    const svg = figure.querySelector("svg");
    const caption = figure.querySelector("figcaption");
    if (!svg || !caption) continue;
    const title = svg.getAttribute("aria-label") || caption.textContent || "figure";
    const words = document.createElement("span");
    words.append(...caption.childNodes);
    figure.classList.add("figure");
    caption.append(
        words,
        saveButtons(title, (kind) => {
            const text = new XMLSerializer().serializeToString(svg);
            if (kind === "svg") saveFile(title, kind, `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`);
            else asPng(svg, text, (url) => saveFile(title, kind, url));
        }),
    );
}
shell();
