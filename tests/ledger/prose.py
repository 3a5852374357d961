"""Figures in prose: the markers that bring them from the ledger, and numbers with a unit that have no source.

`<!--=id-->0.31 m<!--/-->` shows a row of the ledger with its unit, `<!--#id-->0.31<!--/-->` the number alone. `<!--const-->` in a
paragraph or table, or on a line of its own before it, says that its numbers are definitions, settings or examples;
`<!--const section-->` below a heading of level 2 or deeper says so of all text up to the next heading of that level. A page as a whole
cannot be declared so.
"""

import re

MARKER = re.compile(r"<!--\s*(?P<kind>[=#])\s*(?P<id>[\w.\-]+)\s*-->(?P<text>.*?)<!--\s*/\s*-->", re.S)
OPEN = re.compile(r"<!--\s*[=#]\s*[\w.\-]+\s*-->")
# CommonMark takes a line that begins with a comment as HTML: Markdown in the rest of it is not read.
FIRST = re.compile(r"^[ \t]*(?:[-*+>] +|\d+[.)] +)*<!--\s*[=#]", re.M)
CONST = re.compile(r"<!--\s*const\s*-->")
CONST_SECTION = re.compile(r"<!--\s*const section\s*-->")

UNITS = (
    r"dB-?Hz|dB(?:FS|c|m|W|i)?|[kMG]?Hz(?:/s)?|Mcps|km/s|m/s(?:²|\^2|2)?|(?:m/s/s)|[nµμm]s|min(?:utes?)?|seconds?|hours?|days?|s|h|"
    r"[cmkn]?m|metres?|kilometres?|centimetres?|millimetres?|°|deg(?:rees?)?|m?rad(?:ians?)?|cycles?|chips?|%|per ?cent|×|"
    r"times (?:faster|slower|real)|[KMG]i?B|[kM]B|g(?:/s)?|ppm|ppb|TECU|of (?:the )?\d[\d  ]*"
)
FIGURE = re.compile(rf"(?<![\w.,/^-])[-+−±≤≥<>~≈]?\s?\d[\d  ]*(?:[.,]\d+)*(?:e[-+−]?\d+)?[  -]?(?:{UNITS})(?![\w/])")
# What defines a signal, a statistic or a setting, and is no result.
CONSTANTS = [
    re.compile(pattern)
    for pattern in (
        # Carriers and chip rates of the interface documents.
        r"(?:1575\.42|1227\.60?|1176\.45|1278\.75|1207\.14|1191\.795|1561\.098|1268\.52|2492\.028|1602(?:\.0)?|1246(?:\.0)?) MHz",
        r"(?:0\.5625|0\.4375|0\.511|0\.5115|1\.023|2\.046|4\.092|5\.115|6\.138|10\.23|12\.276|15\.345) (?:MHz|Mcps)",
        # Lengths of codes and symbols in whole chips.
        r"\d[\d  ]* chips?",
        # Levels of confidence and the standard error's share.
        r"(?:50|68|90|95|99|99\.7) %",
    )
]
# Tables that explain keys, flags and files: their numbers are ranges and defaults.
KEYS = re.compile(r"^\|\s*`?(?:keys?|options?|flags?|tables?|files?|columns?|fields?|parameters?|settings?|commands?)\b", re.I)


def blank(text, pattern):
    """The text with matches overwritten by spaces: places and lines stay."""
    return re.sub(pattern, lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def visible(text):
    """Prose as read: without code, formulas, addresses and the figures that have a source. Places and lines stay."""
    text = blank(text, re.compile(r"^[ >]*(`{3,}|~{3,}).*?^[ >]*\1[ \t]*$", re.S | re.M))
    text = blank(text, MARKER)
    for pattern in (r"(`+)[^\n]*?(?:\n[^\n]+?)?\1", r"\$\$.*?\$\$", r"\\\\\(.*?\\\\\)", r"\\\\\[.*?\\\\\]"):
        text = blank(text, re.compile(pattern, re.S))
    return blank(text, re.compile(r"\]\([^)\n]*\)|https?://\S+"))


def paragraphs(text):
    """Place and text of each run of lines without a blank line; a heading stands alone."""
    start = 0
    lines = text.splitlines(keepends=True)
    block, begun = [], 0
    for line in [*lines, "\n"]:
        heading = re.match(r"#{1,6} ", line)
        if (not line.strip() or heading) and block:
            yield begun, "".join(block)
            block = []
        if heading:
            yield start, line
        elif line.strip():
            if not block:
                begun = start
            block.append(line)
        start += len(line)


def declared(text):
    """Places whose numbers are declared to be constants."""
    spans, open_level, level = [], None, 0
    for begun, block in paragraphs(text):
        heading = re.match(r"(#{1,6}) ", block)
        if heading:
            level = len(heading[1])
            if open_level is not None and level <= open_level:
                open_level = None
        if CONST_SECTION.search(block) and level > 1:
            open_level = level
        if open_level is not None or CONST.search(block) or KEYS.match(re.sub(r"\A\s*<!--.*?-->\n", "", block)):
            spans.append((begun, begun + len(block)))
    return spans


def of_a_page(text):
    """Places where all numbers of a page are declared to be constants."""
    level = 0
    for begun, block in paragraphs(re.sub(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[ \t]*$", lambda found: re.sub(r"[^\n]", "x", found[0]), text)):
        heading = re.match(r"(#{1,6}) ", block)
        level = len(heading[1]) if heading else level
        found = CONST_SECTION.search(block)
        if found and level < 2 and "`" not in block[: found.start()][-1:]:
            yield begun + found.start()


def without_source(text):
    """Place and text of each number with a unit that neither a marker nor a declaration covers."""
    shown = visible(text)
    spans = declared(re.sub(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[ \t]*$", lambda found: re.sub(r"[^\n]", "x", found[0]), text))
    constant = [found.span() for pattern in CONSTANTS for found in pattern.finditer(shown)]
    for found in FIGURE.finditer(re.sub(r"<!--.*?-->", lambda c: " " * len(c[0]), shown, flags=re.S)):
        # Not the blank before it: a number may begin its paragraph.
        start, end = found.span()
        start += len(found[0]) - len(found[0].lstrip())
        inside = any(a <= start < b for a, b in spans)
        if not inside and not any(a < end and start < b for a, b in constant):
            yield start, found[0].strip()


def line_of(text, place):
    return text.count("\n", 0, place) + 1


def markers(text):
    """Every marker outside of code: place, kind, id, text, and its match."""
    code = [found.span() for found in re.finditer(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[ \t]*$|(?<!`)`[^`\n]+`", text)]
    for found in MARKER.finditer(text):
        if not any(a <= found.start() < b for a, b in code):
            yield found


def unclosed(text):
    """Places of markers that open and do not close, or that open a line."""
    closed = {found.start() for found in MARKER.finditer(text)}
    code = [found.span() for found in re.finditer(r"(?ms)^[ >]*(`{3,}).*?^[ >]*\1[ \t]*$|(?<!`)`[^`\n]+`", text)]
    for found in OPEN.finditer(text):
        if found.start() not in closed and not any(a <= found.start() < b for a, b in code):
            yield found.start(), "a marker without its end"
    for found in FIRST.finditer(text):
        if not any(a <= found.start() < b for a, b in code):
            yield found.start(), "a marker begins the line"
