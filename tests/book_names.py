#!/usr/bin/env python3
"""Names in the book: links and their headings, files, and in the recipes the items of the code, must exist. So must what other
pages of the repository link to, and what they show.

usage: tests/book_names.py
exit:  0 every name exists; 1 one does not, each with its chapter and line.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BOOK = ROOT / "book/src"
# Chapters about code shorten the paths of the rooms that they describe.
ROOMS = {
    "receiver": ["src/receiver", "src/receiver/track", "src/receiver/position"],
    "judge": ["src/analysis", "src/analysis/judge"],
}
PAGES = ("*.md", "book/src/*.md", "python/*.md", "reports/**/*.md")
RECIPES = "extending"
# Files of the repository; a run writes its own into directories of `reports`.
ROOTS = "src|tests|benches|examples|scenarios|studies|assets|python|book|packaging|\\.ci"
FILE = re.compile(rf"reports/(?:studies/)?[\w.]+|(?:{ROOTS})/[\w./-]*[\w/]|[\w/]+\.rs")
ITEM = re.compile(r"[A-Za-z_]\w*(?:::[A-Za-z_]\w*)*")
# Names that a reader gives, and words of Rust and of the shell.
GIVEN = {"mod", "pub", "use", "SPLIT", "NAME", "None", "run"}


def anchors(text):
    """Headings as mdBook names them."""
    plain = re.sub(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1", "", text)
    titles = re.findall(r"(?m)^#{1,6} (.*)$", plain)
    return {re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", title.lower()).strip()) for title in titles}


def spans(text):
    """Code spans outside of code blocks, each with its line."""
    prose = re.sub(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[^\n]*$", lambda block: "\n" * block[0].count("\n"), text)
    for found in re.finditer(r"`([^`\n]+)`", prose):
        yield prose.count("\n", 0, found.start()) + 1, found[1]


def links(page, text):
    for found in re.finditer(r"\]\(([^)\s]+)\)", text):
        target, _, heading = found[1].partition("#")
        line = text.count("\n", 0, found.start()) + 1
        if re.match(r"\w+:", target):
            continue
        path = (page.parent / target) if target else page
        if not path.exists():
            yield line, f"no file {target}"
        elif heading and path.suffix == ".md" and heading not in anchors(path.read_text()):
            yield line, f"{path.name} has no heading #{heading}"


def files(chapter, text):
    for line, name in spans(text):
        if FILE.fullmatch(name) and "*" not in name:
            rooms = ["", *ROOMS.get(chapter, [])]
            if not any((ROOT / room / name).exists() for room in rooms):
                yield line, f"no file {name}"


def items(text, code):
    for line, name in spans(text):
        # Calls, constructors and fields are named by what comes before their brackets.
        name = re.split(r"[({ ]", name.lstrip("&"))[0].rstrip("!?")
        if ITEM.fullmatch(name) and not GIVEN & {name}:
            last = name.split("::")[-1]
            if not re.search(rf"\b{re.escape(last)}\b", code):
                yield line, f"no item {name} in the code"


def main():
    sources = [path for room in ("src", "examples", "tests", "benches") for path in sorted((ROOT / room).rglob("*.rs"))]
    code = "\n".join(path.read_text() for path in sources) + (ROOT / "REFERENCE.md").read_text()
    faults = 0
    for path in [path for pattern in PAGES for path in sorted(ROOT.glob(pattern))]:
        text = path.read_text()
        found = [*links(path, text)]
        if path.parent == BOOK:
            found += files(path.stem, text)
        if path.stem == RECIPES:
            found += items(text, code)
        for line, fault in found:
            print(f"{path.relative_to(ROOT)}:{line}: {fault}")
        faults += len(found)
    print(f"book: {faults} names that do not exist")
    return faults > 0


sys.exit(main())
