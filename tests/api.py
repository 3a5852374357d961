"""Lists the libraries' public items from the pages of `cargo doc --no-deps`, one line each with its declaration.

usage: tests/api.py [--write]     compares with tests/api.txt, or writes it
exit:  0 as listed; 1 not: a change of the interface is meant (write the list, say it in the changelog) or a slip.
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "tests/api.txt"
PAGES = ROOT / "target/doc"
# Crates that `gnss_twin` hands on. Its own item, the command line, is no library.
CRATES = ("analysis", "generator", "gnss", "live", "receiver", "study", "twin")
# Switches of planted faults are for tests.
OUTSIDE = {"plant"}
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


def pages(crate):
    # Pages of an earlier run, with private items, may lie there too; this one is of the last run.
    links = re.findall(r'<a href="([^"#]+\.html)"', (PAGES / crate / "all.html").read_text())
    return sorted({PAGES / crate / link for link in links if "://" not in link and not link.startswith("..")})


def items():
    for page in (page for crate in CRATES for page in pages(crate)):
        kind, _, name = page.stem.partition(".")
        modules = page.relative_to(PAGES).parts[:-1]
        if kind not in KINDS or OUTSIDE.intersection(modules):
            continue
        reader = Declarations()
        reader.feed(page.read_text())
        path = "::".join((*modules, name))
        texts = [" ".join(re.sub(r"[\u200b\xa0]", " ", text).split()) for text in reader.found]
        # Variants, and a trait's methods, stand in the declaration already; headings of `impl` blocks say nothing more.
        own = [text for text in texts[1:] if not text.startswith("impl") and text.rstrip(",") not in texts[0]]
        for text in texts[:1] + own:
            yield f"{path}: {text}"


def main():
    missing = [crate for crate in CRATES if not (PAGES / crate / "all.html").is_file()]
    if missing:
        sys.exit(f"{PAGES}: no pages of {', '.join(missing)}: expected those of cargo doc --no-deps")
    found = "".join(f"{line}\n" for line in items())
    if "--write" in sys.argv[1:]:
        LIST.write_text(found)
        return
    listed = set(LIST.read_text().splitlines())
    now = set(found.splitlines())
    for sign, lines in (("-", listed - now), ("+", now - listed)):
        for line in sorted(lines):
            print(sign, line)
    if listed != now:
        sys.exit("the public interface is not as listed: tests/api.py --write, and a line in CHANGELOG.md")
    print(f"{len(now)} public items and methods, as listed")


main()
