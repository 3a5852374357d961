#!/usr/bin/env python3
"""Names in the book: links and their headings, files, and in the recipes the items of the code, must exist. So must what other
pages of the repository link to, and what they show.

usage: tests/book_names.py               checks every page
       tests/book_names.py --self-test   plants names that do not exist; each must be reported
exit:  0 every name exists, or every planted one is found; 1 not, each with its chapter and line; 2 a wrong command line.
"""

import re
import sys
import tempfile
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
# A link in a sentence, with a title or without, and the definition of one by reference.
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)|^\[[^\]]+\]:\s*<?([^\s>]+)", re.M)
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
    for found in LINK.finditer(text):
        target, _, heading = (found[1] or found[2]).partition("#")
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


CHAPTER = "# First\n\n## A heading, with `code`\n\n```\n# no heading\n```\n"
# A text below the chapter's seven lines, and the fault that it must have in its line, if any.
PLANTED = [
    ("[a](second.md)", None),
    ("[a](second.md#second-page)", None),
    ("[a](#a-heading-with-code)", None),
    ("[a](https://example.com/none.md)", None),
    ("[a](third.md)", "no file third.md"),
    ("[a](second.md \"title\") and [b](third.md \"title\")", "no file third.md"),
    ("![a](picture.png)", "no file picture.png"),
    ("[a]: third.md", "no file third.md"),
    ("[a](second.md#third-page)", "second.md has no heading #third-page"),
    ("[a](#no-heading)", "first.md has no heading #no-heading"),
    ("Read `src/gnss/lib.rs`, `gnss/lib.rs` and `src/*/lib.rs`.", "no file gnss/lib.rs"),
    ("Call `known_item(2)`, `Room::known_item` and `unknown_item`.", "no item unknown_item in the code"),
]


def self_test():
    """Plants each name alone; returns whether one was missed."""
    missed = []
    with tempfile.TemporaryDirectory() as place:
        page = Path(place, "first.md")
        Path(place, "second.md").write_text("# Second page\n", encoding="utf8")
        for text, expected in PLANTED:
            text = f"{CHAPTER}{text}\n"
            page.write_text(text, encoding="utf8")
            named = "fn known_item() {} // code"
            found = [*links(page, text), *files("first", text)] + ([*items(text, named)] if "Call" in text else [])
            if found != ([(8, expected)] if expected else []):
                missed.append(f"{text.splitlines()[-1]!r}: {found}, expected {expected!r} in line 8")
    print("\n".join(missed) or f"book: {len(PLANTED)} planted names, all judged right")
    return bool(missed)


match sys.argv[1:]:
    case []:
        sys.exit(main())
    case ["--self-test"]:
        sys.exit(self_test())
print(__doc__, file=sys.stderr)
sys.exit(2)
