#!/usr/bin/env python3
"""Readability of the README and of the book's first chapters: Flesch's reading ease of their prose.

Needs textstat 0.7.3 (`pip install textstat==0.7.3`). Code, tables, formulas, headings and the targets of links are left out; an item
of a list ends a sentence.

usage: tests/readability.py              prints each page with its figure
       tests/readability.py --self-test  measures texts whose figure is known
exit:  0 every page has the least figure or more; 1 one has less; 75 textstat is not there.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LEAST = 45.0
CHAPTERS = 4


def pages():
    """The README and the first chapters, by the book's own list; chapters below another one are not counted."""
    listed = re.findall(r"^- \[.*?\]\((\w+\.md)\)", (ROOT / "book/src/SUMMARY.md").read_text(encoding="utf8"), re.M)
    return [ROOT / "README.md", *(ROOT / "book/src" / name for name in listed[:CHAPTERS])]


def prose(text):
    """Sentences of a page, one paragraph or item a line."""
    text = re.sub(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[ \t]*$", "", text)
    text = re.sub(r"(?s)<!--.*?-->|\$\$.*?\$\$|\\\\\(.*?\\\\\)|\\\\\[.*?\\\\\]", "", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"(?m)^[ >]*(?:\||#).*$", "", text)
    text = re.sub(r"(?m)^[ >]*(?:[-*]|\d+\.) ", "\n", text)
    parts = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text)]
    parts = [re.sub(r"[*_`]", "", part) for part in parts if part]
    return "\n".join(part if part[-1] in ".!?" else re.sub(r"[:;,]?$", ".", part, count=1) for part in parts)


def ease(text):
    import textstat

    return textstat.flesch_reading_ease(prose(text))


def self_test():
    """A page of short words is easy whatever its code says; long words and sentences are not."""
    easy = "# Incomprehensibility\n\nThe cat sat on the mat. It is red.\n\n```\nincomprehensibilities\n```\n\n| antidisestablishmentarianism |\n"
    hard = "Notwithstanding considerable multidimensional interdependencies, incomprehensible characterisations necessarily proliferate.\n"
    missed = [
        what
        for what, wrong in [
            ("an easy page", ease(easy) < 100),
            ("a hard page", ease(hard) > LEAST),
            ("items without a full stop", prose("- one\n- two:\n") != "one.\ntwo."),
            ("a link", prose("See [the book](book/src/a.md).\n") != "See the book."),
            ("the pages", [page.stem for page in pages()] != ["README", "first_run", "concepts", "cookbook", "signals"]),
        ]
        if wrong
    ]
    print("\n".join(missed) or "readability: 5 checks, all hold")
    return bool(missed)


def main(arguments):
    try:
        import textstat  # noqa: F401
    except ImportError:
        print("readability: textstat is not there: pip install textstat==0.7.3", file=sys.stderr)
        return 75
    if arguments == ["--self-test"]:
        return self_test()
    low = 0
    for page in pages():
        figure = ease(page.read_text(encoding="utf8"))
        low += figure < LEAST
        print(f"readability of {page.relative_to(ROOT)}: {figure:.1f} (at least {LEAST:.0f})")
    return low > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
