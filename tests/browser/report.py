"""The results page in Chromium and Firefox: `report.py FOLDER [--chromium PROGRAM] [--firefox PROGRAM] [--screenshots DIR]`.

FOLDER holds results of the campaign that `inject.py` writes, at least 300 runs. Every check that fails is listed; the exit
status is 1 then.
"""

import argparse
import pathlib
import shutil
import statistics
import sys

from axe_playwright_python.sync_playwright import Axe
from bidi import Firefox
from playwright.sync_api import Page, sync_playwright

# The sandbox needs privileges that a container lacks; WebGL is drawn by software.
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
READY = "html[data-ready]"
SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
# Elements that reach beyond the page, for the message of a failed check.
WIDEST = """[...document.querySelectorAll('body *')].filter((own) => !own.closest('.scroll, .chart') &&
    own.getBoundingClientRect().right > document.documentElement.clientWidth + 1).slice(0, 4).map((own) => own.outerHTML.slice(0, 90))"""

failures: list[str] = []


def check(name: str, holds: bool, seen: object = "") -> None:
    """Reports a check; one that fails counts."""
    print(f"{'ok  ' if holds else 'FAIL'} {name}{f': {seen}' if seen != '' else ''}", flush=True)
    if not holds:
        failures.append(name)


def selected(page: Page) -> str:
    """Returns the heading of the open run, empty without one."""
    return page.evaluate("document.getElementById('panel').hidden ? '' : document.querySelector('#panel h2').textContent")


def loading(playwright, program: str, url: str) -> None:
    """Time to the first screen, without the software renderer of WebGL, which delays every first picture."""
    browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
    firsts, readies = [], []
    for _ in range(5):
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(url)
        page.wait_for_selector(READY, state="attached")
        page.wait_for_timeout(300)
        firsts.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? Infinity"))
        readies.append(int(page.evaluate("document.documentElement.dataset.ready")))
        page.close()
    browser.close()
    first, ready = statistics.median(firsts), statistics.median(readies)
    check("first screen and interactive parts below 1 s", first < 1000 and ready < 1000, f"{first:.0f} ms, {ready:.0f} ms (medians of 5)")


def deciding_run(page: Page, url: str) -> None:
    """Which run decides DOCK-020, and why does it fail: one click from the first screen."""
    page.goto(url)
    page.wait_for_selector(READY, state="attached")
    row = page.locator("table.first tr", has_text="DOCK-020, worst run")
    row.locator("a").first.click()
    page.wait_for_function("!document.getElementById('panel').hidden")
    text = page.locator("#panel").inner_text()
    check("the run that decides DOCK-020 opens in one click", selected(page).startswith("Run ") and "worst run in space" in text)
    causes = page.locator("#panel .cause").all_inner_texts()
    check("its panel states both outcomes with their causes", len(causes) == 2, " | ".join(causes))
    check("its time history is on the page", page.locator("#panel button", has_text="Time history and replay").count() == 1)
    page.keyboard.press("Escape")
    check("Escape closes the run", selected(page) == "")


def filters(page: Page) -> None:
    page.locator("#explorer .chip", has_text="false fail").first.click()
    status = page.locator(".run-table [role=status]").inner_text()
    words = set(page.locator("table.runs .tag b").all_inner_texts())
    check("one click filters the table to false fails", words == {"false fail"}, status)
    check("the filter is in the address", page.evaluate("location.hash") == "#filter=false_fail")
    page.locator("#explorer .chip", has_text="Clear all filters").click()
    heads = page.locator("table.runs button.head")
    heads.nth(0).click()
    first = page.locator("table.runs tr[data-run]").first.get_attribute("data-run")
    heads.nth(0).click()
    check("a click on a heading sorts", page.locator("table.runs tr[data-run]").first.get_attribute("data-run") != first)
    region = page.locator(".runs-scroll")
    region.focus()
    for key in ["Home", "ArrowDown", "ArrowDown", "Enter"]:
        page.keyboard.press(key)
    check("the table is operated by keys", selected(page).startswith("Run "), selected(page))
    page.keyboard.press("Escape")


def dots(page: Page) -> None:
    """A click on a dot of the scatter opens its run; a box filters."""
    chart = page.locator("#explorer .chart")
    chart.scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    box = chart.bounding_box()
    found = ""
    # The dots lie anywhere: try a grid of places until one opens a run.
    for step in range(400):
        x, y = 80 + (step * 37) % (box["width"] - 110), 40 + (step * 23) % (box["height"] - 100)
        page.mouse.click(box["x"] + x, box["y"] + y)
        found = selected(page)
        if found:
            break
    check("a click on a dot opens its run", found.startswith("Run "), found)
    page.keyboard.press("Escape")


def replaying(page: Page, url: str) -> None:
    page.goto(url + "#traces")
    page.wait_for_selector(READY, state="attached")
    page.locator("#replay").scroll_into_view_if_needed()
    play = page.locator("#replay button", has_text="Play")
    play.wait_for(timeout=20000)
    clock = page.locator("#replay output")
    before = clock.inner_text()
    picture = page.evaluate("document.querySelector('#replay canvas').toDataURL()")
    # Slowly: the run may be short.
    page.locator("#replay select").select_option("0.1")
    play.click()
    page.wait_for_timeout(1500)
    page.locator("#replay button", has_text="Pause").click()
    check("the replay plays", clock.inner_text() != before, f"{before} to {clock.inner_text()}")
    page.wait_for_timeout(200)
    check("its picture changes", page.evaluate("document.querySelector('#replay canvas').toDataURL()") != picture)
    colours = page.evaluate("""(() => {
        const from = document.querySelectorAll('#replay canvas')[1], copy = document.createElement('canvas');
        copy.width = from.width; copy.height = from.height;
        const context = copy.getContext('2d');
        context.drawImage(from, 0, 0);
        const data = context.getImageData(0, 0, copy.width, copy.height).data, seen = new Set();
        for (let at = 0; at < data.length; at += 64) seen.add(data[at] + ',' + data[at + 1] + ',' + data[at + 2]);
        return seen.size;
    })()""")
    check("the facility is drawn", colours > 20, f"{colours} colours")


def shot(page: Page, folder: pathlib.Path | None, name: str) -> None:
    if folder:
        page.wait_for_timeout(400)
        page.screenshot(path=folder / f"{name}.png")


def no_serious_fault(page: Page, name: str) -> None:
    found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
    serious = [own for own in found if own["impact"] in ("serious", "critical")]
    for own in serious:
        print("    ", own["id"], own["help"], [node["target"] for node in own["nodes"][:3]])
    check(f"axe-core finds no serious fault, {name}", not serious, f"{len(found)} lesser ones")


def chromium(program: str, url: str, folder: pathlib.Path | None) -> None:
    with sync_playwright() as playwright:
        loading(playwright, program, url)
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        context = browser.new_context(viewport={"width": 1440, "height": 900})
        page = context.new_page()
        errors, requests = [], []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: requests.append(request.url[:80]))
        page.on("dialog", lambda dialog: (errors.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        page.goto(url)
        page.wait_for_selector(READY, state="attached")
        shot(page, folder, "first")
        deciding_run(page, url)
        filters(page)
        dots(page)
        page.goto("about:blank")
        page.goto(url + "#filter=false_fail")
        page.wait_for_selector(READY, state="attached")
        check("a deep link filters", set(page.locator("table.runs .tag b").all_inner_texts()) == {"false fail"})
        run = page.locator("table.runs tr[data-run]").first.get_attribute("data-run")
        page.goto("about:blank")
        page.goto(f"{url}#run={run}")
        page.wait_for_selector(READY, state="attached")
        check("a deep link opens its run", selected(page) == f"Run {run}", selected(page))
        page.locator("#explorer").scroll_into_view_if_needed()
        shot(page, folder, "runs")
        replaying(page, url)
        shot(page, folder, "replay")
        no_serious_fault(page, "light")
        # Injected markup sets this variable; every element that could run it is looked for as well.
        check("names of users run nothing", page.evaluate("window.injected === undefined && document.querySelectorAll('img[src=x], svg[onload]').length === 0"))
        shown = page.evaluate("document.body.innerText")
        check("names of users are shown as text", "<img src=x onerror=" in shown)
        pdf = page.pdf(format="A4", print_background=True)
        check("the page prints", pdf.startswith(b"%PDF") and len(pdf) > 50_000, f"{len(pdf)} bytes")
        if folder:
            (folder / "report.pdf").write_bytes(pdf)
        context.close()

        dark = browser.new_context(viewport={"width": 1440, "height": 900}, color_scheme="dark")
        page = dark.new_page()
        page.goto(url)
        page.wait_for_selector(READY, state="attached")
        check("the system's dark scheme is followed", page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(23, 25, 27)")
        shot(page, folder, "dark")
        no_serious_fault(page, "dark")
        page.locator("#controls button").first.click()
        check("the switch goes back to light", page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)")
        dark.close()

        phone = browser.new_context(viewport={"width": 390, "height": 844}, device_scale_factor=2, has_touch=True)
        page = phone.new_page()
        page.goto(url)
        page.wait_for_selector(READY, state="attached")
        check("390 px wide without scrolling sideways", page.evaluate(SIDEWAYS) <= 0, page.evaluate(SIDEWAYS))
        shot(page, folder, "phone")
        for place in ["runs", "success", "traces", "configuration"]:
            page.evaluate(f"document.getElementById('{place}').scrollIntoView()")
            page.wait_for_timeout(250)
        check("nor after every figure is drawn", page.evaluate(SIDEWAYS) <= 0, page.evaluate(SIDEWAYS))
        phone.close()
        check("no console error", not errors, errors[:4] or "")
        other = [own for own in requests if not own.startswith(("file:", "data:", "blob:", "about:"))]
        check("no network request", not other and sum(own.startswith("file:") for own in requests) > 0, other[:4] or "")
        browser.close()


def firefox(program: str, url: str, folder: pathlib.Path | None) -> None:
    browser = Firefox(program)
    try:
        browser.viewport(1440, 900)
        browser.goto(url)
        ready = browser.evaluate("new Promise((done) => { const wait = () => document.documentElement.dataset.ready ? done(document.documentElement.dataset.ready) : setTimeout(wait, 20); wait(); })")
        check("Firefox: interactive below 2 s", int(ready) < 2000, f"{ready} ms")
        browser.evaluate("location.hash = '#filter=false_fail'")
        words = browser.evaluate("new Promise((done) => setTimeout(() => done([...document.querySelectorAll('table.runs .tag b')].map((own) => own.textContent)), 300))")
        check("Firefox: a deep link filters", set(words) == {"false fail"})
        run = browser.evaluate("document.querySelector('table.runs tr[data-run]').dataset.run")
        browser.evaluate(f"location.hash = '#run={run}'")
        heading = browser.evaluate("new Promise((done) => setTimeout(() => done(document.querySelector('#panel h2').textContent), 300))")
        check("Firefox: a deep link opens its run", heading == f"Run {run}", heading)
        browser.evaluate("document.getElementById('replay').scrollIntoView()")
        clock = "document.querySelector('#replay output').textContent"
        wait = "new Promise((done) => setTimeout(() => done(0), {}))"
        browser.evaluate(wait.format(2500))
        before = browser.evaluate(clock)
        browser.evaluate("[...document.querySelectorAll('#replay button')].find((own) => own.textContent === 'Play')?.click()")
        browser.evaluate(wait.format(1500))
        after = browser.evaluate(clock)
        drawn = browser.evaluate("document.querySelectorAll('#replay canvas').length")
        check("Firefox: the replay plays", drawn == 2 and before != after, f"{before} to {after}")
        if folder:
            (folder / "firefox.png").write_bytes(browser.screenshot())
        pdf = browser.pdf()
        check("Firefox: the page prints", pdf.startswith(b"%PDF") and len(pdf) > 50_000, f"{len(pdf)} bytes")
        browser.viewport(390, 844)
        browser.evaluate("[...document.querySelectorAll('#replay button')].find((own) => own.textContent === 'Pause')?.click()")
        # Figures take their new size one after another.
        browser.evaluate(wait.format(2500))
        check("Firefox: 390 px wide without scrolling sideways", browser.evaluate(SIDEWAYS) <= 0, browser.evaluate(WIDEST))
        check("Firefox: names of users run nothing", browser.evaluate("window.injected === undefined"))
        check("Firefox: no console error", not browser.errors, browser.errors[:4] or "")
        other = [own for own in browser.requests if not own.startswith(("file:", "data:", "blob:", "about:"))]
        check("Firefox: no network request", not other and len(browser.requests) > 0, other[:4] or "")
    finally:
        browser.close()


def program_of(name: str) -> str:
    """Returns the path of a program."""
    found = shutil.which(name)
    if not found:
        raise SystemExit(f"report.py: there is no program `{name}`")
    return found


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--chromium")
    options.add_argument("--firefox")
    options.add_argument("--screenshots", type=pathlib.Path)
    given = options.parse_args()
    if given.screenshots:
        given.screenshots.mkdir(parents=True, exist_ok=True)
    page = (given.folder / "report.html").resolve()
    check("the page is at most 3 MB", page.stat().st_size <= 3_000_000, f"{page.stat().st_size} bytes")
    if given.chromium:
        chromium(program_of(given.chromium), page.as_uri(), given.screenshots)
    if given.firefox:
        firefox(program_of(given.firefox), page.as_uri(), given.screenshots)
    print(f"{len(failures)} checks failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
