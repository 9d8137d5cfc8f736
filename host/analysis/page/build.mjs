// Builds src/*.ts into two minified scripts: `../src/page/app.js` of the results page, with the licences of its libraries
// beside it, and `../src/page/shell.js` of the other pages.
//
// The first line of a script states the BLAKE3 hash of its sources; a test of the Rust crate computes it again.

import { blake3 } from "@noble/hashes/blake3.js";
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";

const here = new URL(".", import.meta.url).pathname;
const out = `${here}../src/page/`;

/** Hash of name, length and content of every source, in the order of names. */
function sourceHash() {
    const sources = readdirSync(`${here}src`).map((name) => `src/${name}`);
    const names = [...sources, "package-lock.json", "build.mjs"].sort();
    const hash = blake3.create();
    for (const name of names) {
        const text = readFileSync(here + name);
        hash.update(new TextEncoder().encode(`${name}\n${text.length}\n`));
        hash.update(text);
    }
    return Buffer.from(hash.digest()).toString("hex");
}

const version = (name) => JSON.parse(readFileSync(`${here}node_modules/${name}/package.json`, "utf8")).version;
const libraries = ["echarts", "zrender", "three"].map((name) => `${name} ${version(name)}`).join(", ");

/** Bundles an entry into `name.js`, with the hash of the script beside it. */
async function bundle(entry, name, banner) {
    const { outputFiles, metafile } = await build({
        absWorkingDir: here,
        entryPoints: [entry],
        bundle: true,
        minify: true,
        write: false,
        metafile: true,
        format: "iife",
        target: "es2022",
        charset: "ascii",
        legalComments: "none",
        define: { "process.env.NODE_ENV": '"production"', __DEV__: "false" },
    });
    const text = `/* softdock page, sources ${sourceHash()} */\n${banner}${outputFiles[0].text}`;
    if (text.toLowerCase().includes("</script")) throw new Error("the script would end its own element");
    writeFileSync(`${out}${name}.js`, text);
    // Of the page's script element, which holds the script and nothing else.
    writeFileSync(`${out}${name}.sha256`, `sha256-${createHash("sha256").update(text).digest("base64")}\n`);
    const sizes = Object.entries(Object.values(metafile.outputs)[0].inputs);
    const of = (part) => sizes.filter(([file]) => file.includes(part)).reduce((sum, [, own]) => sum + own.bytesInOutput, 0);
    const [echarts, zrender, three] = ["node_modules/echarts/", "zrender/", "node_modules/three/"].map(of);
    console.log(`${name}.js ${text.length} bytes: echarts ${echarts}, zrender ${zrender}, three ${three}, own ${of("src/") - of("three/src/")}`);
}

await bundle("src/main.ts", "app", `/* with ${libraries}; licences: licenses.txt beside this file */\n`);
await bundle("src/drawings.ts", "shell", "");

const licences = [
    ["Apache ECharts", ["echarts/LICENSE", "echarts/NOTICE"]],
    ["ZRender", ["zrender/LICENSE"]],
    ["three.js", ["three/LICENSE"]],
    ["tslib", ["tslib/LICENSE.txt"]],
];
const licenceText = ([name, files]) =>
    `${name}\n${"=".repeat(name.length)}\n\n${files.map((file) => readFileSync(`${here}node_modules/${file}`, "utf8").trim()).join("\n\n")}\n`;
writeFileSync(`${out}licenses.txt`, licences.map(licenceText).join("\n\n"));
