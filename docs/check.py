#!/usr/bin/env python3
"""Checks every link of the Markdown pages: files, anchors, pictures, and that each page of the book is in its SUMMARY.md.

External addresses are checked by their syntax alone. Usage: docs/check.py [ROOT]; exit code 1 if a link is broken.
"""

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlparse

LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(\s*<?([^)\s>]*)>?(?:\s+\"[^\"]*\")?\s*\)")
CODE = re.compile(r"(`+)(.+?)\1")


def prose(text):
    """Lines of a page with their numbers, code blocks and code spans left out."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark:
            if fence is None:
                fence = mark.group(1)
            elif mark.group(1).startswith(fence):
                fence = None
            continue
        if fence is None:
            yield number, line


def anchors(text):
    """Anchors of the headings of a page, as mdBook and GitHub make them."""
    seen, found = {}, set()
    for _, line in prose(text):
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*$", line)
        if not heading:
            continue
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.group(1))
        name = "".join(c for c in words.lower() if c.isalnum() or c in "-_ ").replace(" ", "-")
        count = seen.get(name, 0)
        seen[name] = count + 1
        found.add(f"{name}-{count}" if count else name)
    return found


def problem(page, target, pages, root):
    """What is wrong with a link, or None."""
    url = urlparse(target)
    if url.scheme or target.startswith("//"):
        if url.scheme in ("http", "https"):
            return None if re.fullmatch(r"[\w.-]+\.\w+(:\d+)?", url.netloc) else "is no address"
        return None if url.scheme == "mailto" and "@" in url.path else f"has the unknown scheme {url.scheme}"
    path = (page.parent / unquote(url.path)).resolve() if url.path else page
    if not path.exists():
        return "names a file that does not exist"
    if root not in path.parents and path != root:
        return "leaves the repository"
    book = root / "docs"
    if book in page.parents and book not in path.parents:
        return "leaves the book: write the path in backticks"
    if url.fragment:
        if path not in pages:
            return "has an anchor, but names no page"
        if unquote(url.fragment) not in pages[path]:
            return f"names an anchor that does not exist; there are {', '.join(sorted(pages[path]))}"
    return None


def main():
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent).resolve()
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=root, capture_output=True, text=True, check=True
    )
    files = [root / name for name in listed.stdout.splitlines() if (root / name).is_file()]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    pages = {file: anchors(text) for file, text in texts.items()}
    links, broken = 0, []
    for page, text in texts.items():
        for number, line in prose(text):
            for match in LINK.finditer(CODE.sub("", line)):
                links += 1
                wrong = problem(page, match.group(3), pages, root)
                if wrong:
                    broken.append(f"{page.relative_to(root)}:{number}: `{match.group(3)}` {wrong}")
    book = root / "docs"
    contents = texts.get(book / "SUMMARY.md", "")
    for page in pages:
        if book in page.parents and page.name != "SUMMARY.md":
            name = page.relative_to(book).as_posix()
            if f"({name})" not in contents:
                broken.append(f"docs/SUMMARY.md: does not list {name}")
    for line in broken:
        print(line, file=sys.stderr)
    print(f"{links} links on {len(pages)} pages, {len(broken)} broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
