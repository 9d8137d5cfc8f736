"""Wrong values that an editor must mark: each is written into a shipped file, which Taplo checks by its schema.

    python3 tests/schemas.py TAPLO [SCHEMAS]

SCHEMAS is a folder of *.schema.json in place of campaigns/schemas. Every shipped file must pass, and at least 25 of the 30 wrong
values must be marked.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

CAMPAIGNS = pathlib.Path(__file__).resolve().parent.parent / "campaigns"
FEWEST = 25

# File, written text, text in its place.
WRONG = [
    ("probe_drogue.toml", 'schema = "campaign/2"', 'schema = "campaign/1"'),
    ("probe_drogue.toml", 'id = "probe_drogue"', 'id = "probe drogue"'),
    ("probe_drogue.toml", "runs = 2000", "runs = 0"),
    ("probe_drogue.toml", "runs = 2000", 'runs = "2000"'),
    ("probe_drogue.toml", 'backend = "auto"', 'backend = "cuda"'),
    ("probe_drogue.toml", "[execution]", "[exection]"),
    ("smoke.toml", 'parity = "25 %"', 'parity = "250 %"'),
    ("smoke.toml", 'target = "contact_friction"', 'target = "friction"'),
    ("smoke.toml", 'target = "loop_delay"', 'target = "latency"'),
    ("smoke.toml", 'min = "3 ms", max = "40 ms"', 'min = "3 mm", max = "40 ms"'),
    ("smoke.toml", 'min = "3 ms", max = "40 ms"', 'min = 3, max = "40 ms"'),
    ("smoke.toml", 'kind = "loguniform", min = "3 ms"', 'kind = "lognormal", min = "3 ms"'),
    ("smoke.toml", 'min = "3 ms", max = "40 ms"', 'min = "3 ms"'),
    ("smoke.toml", 'class = "epistemic"', 'class = "systematic"'),
    ("smoke.toml", 'at_most = "400 N"', 'at_most = "400 kg"'),
    ("smoke.toml", 'at_most = "400 N"', 'at_most = "400 Newton"'),
    ("smoke.toml", 'metric = "peak_contact_force"', 'metric = "peak_force"'),
    ("smoke.toml", 'subject = "space"', 'subject = "orbit"'),
    ("smoke.toml", 'keep = ["nominal",', 'keep = ["typical",'),
    ("scenarios/smoke.toml", "friction = 0.15", "friction = -0.15"),
    ("scenarios/smoke.toml", 'law = "power"', 'law = "powr"'),
    ("scenarios/smoke.toml", 'stiffness = "2e5 N/m"', 'stiffness = "2e5 N"'),
    ("scenarios/smoke.toml", 'stiffness = "2e5 N/m"', "stiffness = 2e5"),
    ("scenarios/smoke.toml", 'closing_speed = "', 'closing_sped = "'),
    ("scenarios/probe_drogue.toml", 'shape = "cone"', 'shape = "funnel"'),
    ("scenarios/probe_drogue.toml", "capture = true", 'capture = "yes"'),
    ("facilities/reference.toml", 'force = "', 'force = "-'),
    ("facilities/reference.toml", "[safety]", "[safty]"),
    ("models/kr300_r2500.toml", 'payload = "300 kg"', 'payload = "300 kgf"'),
    ("rigs/emps.toml", 'kind = "drive"', 'kind = "axis"'),
]


def check(taplo, folder, files):
    """Returns whether Taplo accepts files, and what it prints."""
    done = subprocess.run([str(pathlib.Path(taplo).resolve()), "check", *files], cwd=folder, capture_output=True, text=True)
    return done.returncode == 0, done.stdout + done.stderr


def main(taplo, schemas=None):
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch) / "campaigns"
        shutil.copytree(CAMPAIGNS, folder)
        for schema in pathlib.Path(schemas).glob("*.schema.json") if schemas else []:
            shutil.copy(schema, folder / "schemas" / schema.name)
        shipped = sorted(str(path.relative_to(folder)) for path in folder.rglob("*.toml"))
        passes, printed = check(taplo, folder, shipped)
        if not passes:
            sys.exit(f"shipped files are marked:\n{printed}")
        missed = []
        for name, old, new in WRONG:
            path = folder / name
            text = path.read_text()
            if old not in text:
                sys.exit(f"{name} has no `{old}`")
            path.write_text(text.replace(old, new, 1))
            if check(taplo, folder, [name])[0]:
                missed.append(f"{name}: {new}")
            path.write_text(text)
    marked = len(WRONG) - len(missed)
    print(f"{len(shipped)} shipped files pass; {marked} of {len(WRONG)} wrong values are marked")
    for line in missed:
        print(f"  not marked: {line}")
    if marked < FEWEST:
        sys.exit(f"at least {FEWEST} must be marked")


if __name__ == "__main__":
    main(*sys.argv[1:])
