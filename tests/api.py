"""Lists the library's public items from the pages of `cargo doc --no-deps`: one line each with its declaration, methods indented.

usage: tests/api.py [--write]     compares with tests/api.txt, or writes it
exit:  0 as listed; 1 not: a change of the interface is meant (write the list, say it in the changelog) or a slip; 1 too where
       there are more items than a stranger can take in, or an example of the facade takes a name from a room.

What the rooms export beyond the facade is internal and not listed.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "tests/api.txt"
PAGES = ROOT / "target/doc"
# The facade. Its command line is hidden and no library.
CRATE = "gnss_twin"
MOST_ITEMS = 180
# Crates of the rooms, which a user's program does not name.
ROOMS = ("analysis", "generator", "gnss", "live", "receiver", "study", "twin")
# Headings under which a page has what traits bring.
TRAITS = ("trait-implementations", "synthetic-implementations", "blanket-implementations")
KINDS = ("struct", "enum", "trait", "fn", "constant", "type", "static", "macro")


class Declarations(HTMLParser):
    """Texts of an item's declaration and of its own methods: not of those that traits bring."""

    def __init__(self):
        super().__init__()
        self.found = []
        self.depth = 0
        self.skipped = False

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        classes = (attributes.get("class") or "").split()
        if attributes.get("id") in TRAITS:
            self.skipped = True
        if self.depth:
            self.depth += tag not in ("br", "wbr", "img")
        elif not self.skipped and ("item-decl" in classes or "code-header" in classes):
            self.depth = 1
            self.found.append("")

    def handle_endtag(self, tag):
        if self.depth:
            self.depth -= tag not in ("br", "wbr", "img")

    def handle_data(self, data):
        if self.depth:
            self.found[-1] += data


def pages():
    # Pages of an earlier run, with private items, may lie there too; this one is of the last run.
    links = re.findall(r'<a href="([^"#]+\.html)"', (PAGES / CRATE / "all.html").read_text())
    return sorted({PAGES / CRATE / link for link in links if "://" not in link and not link.startswith("..")})


def items():
    """Lists of lines, one list an item: its declaration and those of its methods."""
    for page in pages():
        kind, _, name = page.stem.partition(".")
        if kind not in KINDS:
            continue
        reader = Declarations()
        reader.feed(page.read_text())
        path = "::".join((*page.relative_to(PAGES / CRATE).parts[:-1], name))
        texts = [" ".join(re.sub(r"[\u200b\xa0]", " ", text).split()) for text in reader.found]
        # Variants, and a trait's methods, stand in the declaration already; headings of `impl` blocks say nothing more.
        own = [text for text in texts[1:] if not text.startswith("impl") and text.rstrip(",") not in texts[0]]
        yield [f"{path}: {text}" for text in texts[:1]] + [f"    {path}: {text}" for text in own]


def foreign_examples():
    """Examples on the facade's pages that import from a room: a user's program cannot."""
    for page in [*pages(), *sorted((PAGES / CRATE).rglob("index.html"))]:
        for example in re.findall(r'(?s)<pre class="rust rust-example-rendered">(.*?)</pre>', page.read_text()):
            words = re.sub(r"<[^>]*>", "", example)
            if found := re.search(rf"\buse (?:::)?({'|'.join(ROOMS)})::", words):
                yield f"{page.relative_to(PAGES)}: an example imports from {found[1]}: expected {CRATE}::"


def main():
    if not (PAGES / CRATE / "all.html").is_file():
        sys.exit(f"{PAGES}: no pages of {CRATE}: expected those of cargo doc --no-deps")
    public = list(items())
    now = [line for lines in public for line in lines]
    if "--write" in sys.argv[1:]:
        LIST.write_text("".join(f"{line}\n" for line in now))
        return
    faults = list(foreign_examples())
    if len(public) > MOST_ITEMS:
        faults.append(f"{len(public)} public items: expected {MOST_ITEMS} at most")
    listed = set(LIST.read_text().splitlines())
    for sign, lines in (("-", listed - set(now)), ("+", set(now) - listed)):
        for line in sorted(lines):
            print(sign, line)
    if listed != set(now):
        faults.append("the public interface is not as listed: tests/api.py --write, and a line in CHANGELOG.md")
    if faults:
        sys.exit("\n".join(faults))
    print(f"{len(public)} public items with {len(now) - len(public)} methods, as listed")


main()
