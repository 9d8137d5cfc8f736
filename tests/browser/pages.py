"""The other pages, with markup in every name of the user, in Chromium: `pages.py SOFTDOCK FOLDER [--all] [--chromium PROGRAM]`.

Makes the comparison of variants, the pages of identifications and of a diagnosis, and serves a folder of results. Each page
is opened on a wide and on a narrow dark screen. `--all`: the pages of `map` and of the gauntlet too, which hold no text of users and
take most of the time.
"""

import argparse
import math
import pathlib
import re
import shutil
import subprocess
import sys

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, sync_playwright

ROOT = pathlib.Path(__file__).parents[2]
MARKUP = "<img src=x onerror=window.injected=1><svg onload=window.injected=1>"
TEXT = MARKUP + "</script><script>window.injected=1</script>{{ 7*7 }}"
INJECTED = "window.injected !== undefined || document.querySelectorAll('img[src=x], svg[onload]').length > 0"
SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
SERIOUS = ("serious", "critical")

failures: list[str] = []


def check(name: str, holds: bool, seen: object = "") -> None:
    """Reports a check; one that fails counts."""
    if not holds:
        failures.append(name)
        print(f"FAIL {name}: {seen}", flush=True)


def softdock(program: str, *arguments: object, expected: tuple[int, ...] = (0, 1)) -> None:
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
    if done.returncode not in expected:
        raise SystemExit(f"{arguments}: exit code {done.returncode}\n{done.stderr}")
    # Names reach the terminal without a control character of their own.
    assert "\x1b" not in done.stdout + done.stderr, arguments


def hostile(path: pathlib.Path, out: pathlib.Path, keys: tuple[str, ...] = ("title", "text", "source")) -> pathlib.Path:
    """A copy of a TOML file with markup at the end of these texts."""
    out.parent.mkdir(parents=True, exist_ok=True)
    pattern = re.compile(rf'^(\s*(?:{"|".join(keys)})\s*=\s*"[^"]*)"', re.MULTILINE)
    out.write_text(pattern.sub(lambda found: f'{found[1]} {TEXT}"', path.read_text()))
    return out


def presses(folder: pathlib.Path) -> list[pathlib.Path]:
    """Recordings of presses of a plate of 80 N/mm."""
    logs = []
    for number, (depth, period) in enumerate([(1.0, 2.0), (2.0, 1.0), (1.5, 0.5)]):
        lines = [f"t_s,depth {MARKUP},force_n"]
        for step in range(int(3000 * period)):
            t = 0.001 * step
            way = depth * (1.6 * math.sin(math.pi * t / period) ** 2 - 0.6)
            lines.append(f"{t},{way},{max(80.0 * way, 0.0)}")
        logs.append(folder / f"press_{number} {MARKUP}.csv")
        logs[-1].write_text("\n".join(lines) + "\n")
    return logs


def made(program: str, folder: pathlib.Path) -> list[pathlib.Path]:
    """The pages, each by its command."""
    pages = []
    campaigns = folder / "campaigns"
    shutil.copytree(ROOT / "campaigns", campaigns)
    campaign = hostile(ROOT / "campaigns/compensators.toml", campaigns / "compensators.toml")
    softdock(program, "run", campaign, "--runs", 8, "--backend", "cpu", "--out", folder / "results/compared")
    pages.append(folder / "results/compared/compare.html")

    data = folder / f"data {MARKUP}"
    data.mkdir()
    rig = hostile(ROOT / "campaigns/rigs/plate_press.toml", folder / "plate.toml")
    rig.write_text(rig.read_text().replace('"depth_mm"', f'"depth {MARKUP}"'))
    softdock(program, "identify", "contact", rig, "--data", *presses(data), "--out", folder / "results/contact")
    pages.append(folder / "results/contact/identify.html")

    robot = hostile(ROOT / "campaigns/models/kr300_r2500.toml", campaigns / "models/kr300_r2500.toml")
    recordings = ROOT / "tests/data/kuka-kr300-recordings"
    motions = [shutil.copy(recordings / f"traj_{name}.csv", data / f"traj_{name} {MARKUP}.csv") for name in "AB"]
    softdock(program, "identify", "robot", robot, motions[0], "--validate", motions[1], "--out", folder / "results/robot")
    pages.append(folder / "results/robot/identify.html")
    softdock(program, "identify", "robot", robot, "--design", "--out", folder / "results/motion")
    pages.append(folder / "results/motion/motion.html")

    rig = hostile(ROOT / "campaigns/rigs/kr300.toml", campaigns / "rigs/kr300.toml")
    softdock(program, "diagnose", rig, motions[0], "--holdout", motions[1], "--out", folder / "results/diagnosis")
    pages += sorted((folder / "results/diagnosis").glob("*.html"))
    return pages


def without_names(program: str, folder: pathlib.Path) -> list[pathlib.Path]:
    """The pages that hold no text of users."""
    pages = [folder / "results/map.html", folder / "results/score/score.html"]
    softdock(program, "map", "--mass-kg", 200, "--delay-ms", 16, "--quick", "--out", pages[0])
    part = ("--only", "drive.null", "--out", pages[1].parent)
    softdock(program, "bench", "diagnosis", *part, expected=(0, 1, 3))
    return pages


def has_shell(page: Page, label: str) -> None:
    """Contents list, switch of colours, origin, and figures that can be saved."""
    headings = [text.removeprefix(f"{n}. ") for n, text in enumerate(page.locator("main h2").all_inner_texts(), 1)]
    page.evaluate("document.querySelector('nav.contents details').open = true")
    listed = page.locator("#contents a").all_inner_texts()
    check(f"{label}: every section is in the contents list", listed == headings and len(listed) > 0, (listed, headings))
    check(f"{label}: version and commit", "commit " in page.inner_text(".provenance"))
    check(f"{label}: date", "page written 20" in page.inner_text(".provenance"))
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#controls button")
    check(f"{label}: dark and light", page.evaluate("getComputedStyle(document.body).backgroundColor") != before)
    page.click("#controls button")
    for kind, head in (("SVG", b"<svg"), ("PNG", b"\x89PNG")):
        button = page.locator("figure .save button", has_text=kind).first
        if button.count() == 0:
            check(f"{label}: figures can be saved", page.locator("figure svg").count() == 0)
            continue
        with page.expect_download() as download:
            button.click()
        check(f"{label}: saved {kind}", download.value.path().read_bytes().startswith(head))


def looked_at(browser: Browser, url: str, name: str, *, is_served: bool, has_names: bool = True) -> None:
    """Opens a page on a wide and on a narrow, dark screen."""
    for width, scheme in ((1300, "light"), (390, "dark")):
        page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        errors, requests = [], []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: requests.append(request.url))
        page.goto(url)
        page.wait_for_timeout(1500 if is_served else 300)
        label = f"{name}, {width} px, {scheme}"
        check(f"{label}: names of users run nothing", not page.evaluate(INJECTED))
        check(f"{label}: markup is text", not has_names or "<img src=x" in page.inner_text("body"))
        check(f"{label}: no template is evaluated", "}} 49" not in page.inner_text("body"))
        check(f"{label}: no error", not errors, errors)
        foreign = [other for other in requests if not other.startswith(("file:", "data:", "blob:", "http://127.0.0.1:"))]
        check(f"{label}: no network", not foreign, foreign)
        check(f"{label}: not wider than the screen", page.evaluate(SIDEWAYS) <= 0, page.evaluate(SIDEWAYS))
        faults = [found for found in Axe().run(page).response["violations"] if found["impact"] in SERIOUS]
        check(f"{label}: accessible", not faults, [(found["id"], found["nodes"][0]["html"][:90]) for found in faults])
        if not is_served and scheme == "light":
            has_shell(page, label)
        page.close()


def served(program: str, folder: pathlib.Path, browser: Browser) -> None:
    """The list, one folder, and a comparison by `softdock serve`."""
    named = folder / f"results/named {MARKUP}"
    campaign = hostile(ROOT / "campaigns/smoke.toml", folder / "campaigns/smoke.toml")
    softdock(program, "run", campaign, "--runs", 16, "--backend", "cpu", "--out", named)
    server = subprocess.Popen([program, "serve", str(folder / "results"), "--address", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        lines = iter(server.stdout.readline, "")
        address = next(line.split()[1] for line in lines if line.startswith("pages"))
        looked_at(browser, address, "serve, list", is_served=True)
        page = browser.new_page(viewport={"width": 1300, "height": 900})
        page.goto(address)
        page.wait_for_selector("#folders tr")
        page.get_by_role("link", name=f"named {MARKUP}").first.click()
        page.wait_for_selector("#detail table")
        check("serve, state of a folder: names of users run nothing", not page.evaluate(INJECTED))
        check("serve, state of a folder: requirements", "SMOKE-020" in page.inner_text("#detail"))
        boxes = page.query_selector_all("#folders input:enabled")
        boxes[0].check()
        boxes[0].check()
        for box in [box for box in boxes if not box.is_checked()][:1]:
            box.check()
        page.click("#compare")
        page.wait_for_selector("#detail pre")
        check("serve, comparison: names of users run nothing", not page.evaluate(INJECTED))
        page.close()
    finally:
        server.terminate()
        check("serve ends with the signal", server.wait(timeout=20) == 0, server.returncode)


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("softdock")
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--all", action="store_true")
    arguments.add_argument("--chromium", default="chromium")
    given = arguments.parse_args()
    folder = given.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    pages = made(given.softdock, folder)
    bare = without_names(given.softdock, folder) if given.all else []
    with sync_playwright() as playwright:
        program = shutil.which(given.chromium) or given.chromium
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        for path in pages:
            looked_at(browser, path.as_uri(), path.parent.name, is_served=False)
        for path in bare:
            looked_at(browser, path.as_uri(), path.stem, is_served=False, has_names=False)
        served(given.softdock, folder, browser)
        browser.close()
    print(f"{len(pages) + len(bare)} pages and the served ones: {len(failures)} faults", flush=True)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
