"""Copies a campaign with markup in every name that a user may write: `inject.py CAMPAIGNS_FOLDER OUT`.

Writes OUT/probe_drogue.toml beside copies of the files that it names. Its limit of the contact force is lower, so that the
facility fails runs that pass in space, and it keeps fewer traces.
"""

import pathlib
import shutil
import sys

MARKUP = "<img src=x onerror=window.injected=1></script><script>window.injected=1</script>"


def main() -> None:
    campaigns, out = map(pathlib.Path, sys.argv[1:])
    shutil.copytree(campaigns, out)
    path = out / "probe_drogue.toml"
    lines = []
    for line in path.read_text().splitlines():
        key = line.split("=")[0].strip()
        line = line.replace('at_most = "250 N"', 'at_most = "40 N"')
        line = line.replace('keep = ["nominal", "worst:10", "random:20"]', 'keep = ["nominal", "worst:2", "random:2"]')
        lines.append(f"{key} = {line.split('=', 1)[1].split('#')[0].strip()[:-1]} {MARKUP}\"" if key in ("title", "text", "source") else line)
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
