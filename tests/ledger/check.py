"""The ledger, and what must hold between it, the code, the pages and the prose.

A row has the commit and the date at which its figure was measured. Counts and bounds that tests assert have neither: every check reads
them in the sources again, so that they are today's or a finding.
"""

import csv
import difflib
import math
import re
from collections import defaultdict
from pathlib import Path

import digest
import make
import prose

LEDGER = "reports/evidence.csv"
COLUMNS = "id what value unit bar met command commit date processor runs rooms digest".split()
# Where every number with a unit needs a source, and where markers are filled besides.
PROSE = ("README.md", "book/src/**/*.md")
MARKED = (*PROSE, "CONTRIBUTING.md", "python/README.md", "reports/*.md")
NOTICE = re.compile(r"^\*Older than the code: .*\*\n\n?", re.M)


def read(root):
    path = root / LEDGER
    if not path.is_file():
        return {}
    with path.open(newline="", encoding="utf8") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def save(root, table):
    with (root / LEDGER).open("w", newline="", encoding="utf8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table[name] for name in sorted(table))


def some(names):
    """The first names, and how many there are."""
    return ", ".join(names) if len(names) < 4 else f"{', '.join(names[:2])} and {len(names) - 2} more"


def line_of_row(root, name):
    lines = (root / LEDGER).read_text(encoding="utf8").splitlines()
    return next((number for number, line in enumerate(lines, 1) if line.startswith(f"{name},")), 1)


def rounded(value, digits):
    """A value as it is published: text as it is, a number with so many significant digits and no exponent."""
    if isinstance(value, str):
        return value
    if digits is None or value == 0:
        return f"{value:.0f}"
    return f"{value:.{max(0, digits - 1 - math.floor(math.log10(abs(value))))}f}"


def met(value, bar):
    """Whether a value meets its bar: `≤ 1`, `≥ 1`, `= 0`, or `all` of so many."""
    if not bar:
        return "–"
    if bar == "all":
        some, whole = value.split(" of ")
        return "yes" if some == whole else "no"
    sign, limit = bar.split(" ", 1)
    value, limit = float(value), float(limit)
    return "yes" if {"≤": value <= limit, "≥": value >= limit, "=": value == limit}[sign] else "no"


def shown(row, kind):
    number = re.sub(r"^-", "−", row["value"])
    space = "" if row["unit"] == "°" else " "
    return f"{number}{space}{row['unit']}" if kind == "=" and row["unit"] else number


def pages(root, patterns):
    return [path for pattern in patterns for path in sorted(root.glob(pattern))]


def notices(root, table, figures):
    """What each page with stale figures has to say below its title: the page that a long command wrote, and chapters that show them."""
    stale = {name: row for name, row in table.items() if isinstance(source_of(figures, name), make.Page) and is_stale(root, row)}
    found, shown_in = defaultdict(dict), defaultdict(list)
    for name, row in stale.items():
        source = figures[name].source
        part = f", part “{source.mark}”" if source.mark else ""
        found[root / source.page][row["commit"], row["date"], source.command] = (
            f"*Older than the code: measured at commit {row['commit']} on {row['date']}{part}. `{source.command}` makes it again.*\n"
        )
    for path in pages(root, MARKED[1:]):
        for marker in prose.markers(path.read_text(encoding="utf8")):
            if marker["id"] in stale:
                row = stale[marker["id"]]
                shown_in[path, row["commit"], row["date"], figures[marker["id"]].source.command].append(marker["id"])
    for (path, commit, date, command), names in shown_in.items():
        text = f"*Older than the code: {some(names)}, measured at commit {commit} on {date}. `{command}` measures again.*\n"
        found[path].setdefault((commit, date, command), text)
    return {page: "\n".join(texts.values()) + "\n" for page, texts in found.items()}


def source_of(figures, name):
    return figures[name].source if name in figures else None


def pages_with_notices(root, figures):
    """Pages that long commands write, and all that show figures but the README, which shows no stale ones."""
    measured = {root / figure.source.page for figure in figures.values() if isinstance(figure.source, make.Page)}
    return sorted({*filter(Path.is_file, measured), *pages(root, MARKED[1:])})


def is_stale(root, row):
    rooms = row["rooms"].split()
    try:
        return bool(rooms) and digest.of(root, rooms) != row["digest"]
    except FileNotFoundError:
        return True


def said(text):
    return "".join(found[0] for found in NOTICE.finditer(text))


def check(root, figures):
    """Findings and warnings, each with place and cure."""
    table = read(root)
    found, stale, old_runs = [], defaultdict(list), defaultdict(list)
    missing = defaultdict(list)
    for name in sorted(figures.keys() - table.keys()):
        missing[name.rpartition(".")[0]].append(name)
    for family, names in missing.items():
        found.append(f"{LEDGER}:1: {some(names)}: declared without a row; make by: --make {family}.")
    for name, row in table.items():
        place = f"{LEDGER}:{line_of_row(root, name)}"
        if name not in figures:
            found.append(f"{place}: {name} is not declared in tests/ledger/figures.py; declare it or remove the row")
            continue
        found += [f"{place}: {text}" for text in faults_of_row(row, figures[name])]
        if is_stale(root, row):
            source = figures[name].source
            if isinstance(source, make.Page):
                stale[source.page, row["commit"], source.command].append(name)
            else:
                old_runs[name.rpartition(".")[0], row["rooms"], row["commit"]].append(name)
    for (family, rooms, commit), names in old_runs.items():
        place = f"{LEDGER}:{line_of_row(root, names[0])}"
        found.append(f"{place}: stale: {some(names)}: of {rooms}, made at {commit}; make again by: --make {family}.")
    expected = notices(root, table, figures)
    for page in pages_with_notices(root, figures):
        if said(page.read_text(encoding="utf8")) != expected.get(page, ""):
            found.append(f"{page.relative_to(root)}:3: the page does not say which of its figures are older than the code; fill it by: --write")
    warnings = [
        f"{page}: {len(names)} figures are older than the code, made at {commit} ({some(names)}); "
        f"make them again by: {command}, then --make"
        for (page, commit, command), names in stale.items()
    ]
    # The first page that a stranger reads shows nothing that is older than the code.
    old = {name for names in stale.values() for name in names}
    return found + of_prose(root, table) + old_in_readme(root, old) + printed_in_readme(root, table), warnings


def faults_of_row(row, figure):
    """What a row says otherwise than its declaration and its source."""
    name, source = row["id"], figure.source
    again = f"make it again by: --make {name}"
    declared = {"what": figure.what, "unit": figure.unit, "command": source.command, "rooms": " ".join(figure.rooms)}
    faults = [f"{name}: {key} is {row[key]!r}, declared {text!r}; {again}" for key, text in declared.items() if row[key] != text]
    if not row["commit"] and not isinstance(source, (make.Count, make.Asserted)):
        faults.append(f"{name}: a measured figure without the commit of its code; {again}")
    if row["met"] != met(row["value"], row["bar"]):
        faults.append(f"{name}: met says {row['met']} of {row['value']} against {row['bar']}; {again}")
    if isinstance(source, (make.Count, make.Asserted, make.Page)):
        try:
            made = source.make()
        except (make.NotMade, OSError) as error:
            return [*faults, f"{name}: {error}"]
        value = rounded(made.value, figure.digits)
        if value != row["value"]:
            faults.append(f"{name} is {row['value']}, its source says {value}; {again}")
        elif made.commit and made.commit != row["commit"]:
            faults.append(f"{name} is of {row['commit']}, its page of {made.commit}; {again}")
    return faults


def of_prose(root, table):
    found = []
    for path in pages(root, MARKED):
        text, name = path.read_text(encoding="utf8"), path.relative_to(root)
        for start, what in prose.unclosed(text):
            cure = "end it by <!--/-->" if "end" in what else "put a word before it: Markdown takes such a line as HTML"
            found.append(f"{name}:{prose.line_of(text, start)}: {what}; {cure}")
        for marker in prose.markers(text):
            place = f"{name}:{prose.line_of(text, marker.start())}"
            if marker["id"] not in table:
                near = difflib.get_close_matches(marker["id"], table, 1)
                hint = f"the nearest is {near[0]}" if near else "declare it in tests/ledger/figures.py"
                found.append(f"{place}: no figure {marker['id']} in {LEDGER}; {hint}")
            elif marker["text"] != shown(table[marker["id"]], marker["kind"]):
                right = shown(table[marker["id"]], marker["kind"])
                found.append(f"{place}: {marker['id']} is shown as {marker['text']!r}, the ledger has {right!r}; fill it by: --write")
    for path in pages(root, PROSE):
        text, name = path.read_text(encoding="utf8"), path.relative_to(root)
        for start in prose.of_a_page(text):
            found.append(f"{name}:{prose.line_of(text, start)}: all numbers of a page are declared constants; declare sections or paragraphs")
        for start, figure in prose.without_source(text):
            found.append(
                f"{name}:{prose.line_of(text, start)}: {figure!r} has no source; show a row of the ledger, "
                "or put <!--const--> into the paragraph where it is a definition, a setting or an example"
            )
    return found


# Lines of the README's output, and the rows of the ledger that have their numbers. `tests/book.sh` runs the command (`.ci/long`).
PRINTED = [
    (r"^first fix +([\d.]+) s, (\d+) fixes$", ("first_fix_s", "fixes")),
    (r"^position east \(m\) +(-?[\d.]+) ", ("east_m",)),
    (r"^position north \(m\) +(-?[\d.]+) ", ("north_m",)),
    (r"^position up \(m\) +(-?[\d.]+) +[\d.]+ +([\d.]+)$", ("up_m", "vertical_p95_m")),
    (r"^(\d+) losses of lock, (\d+) cycle slips$", ("losses", "slips")),
]


def printed_in_readme(root, table):
    """Numbers of the README's block of output that are not those of the ledger."""
    text = (root / "README.md").read_text(encoding="utf8")
    block = re.search(r"^```text\n(\w+) · .*?^```$", text, re.M | re.S)
    if not block:
        return []
    found = []
    for pattern, names in PRINTED:
        line = re.search(pattern, block[0], re.M)
        if not line:
            found.append(f"README.md:{prose.line_of(text, block.start())}: the output has no line like {pattern}")
            continue
        for group, name in enumerate(names, 1):
            row = table.get(f"accuracy.{block[1]}.{name}")
            place = f"README.md:{prose.line_of(text, block.start() + line.start())}"
            if row is None:
                found.append(f"{place}: no figure accuracy.{block[1]}.{name} in {LEDGER}")
            elif not agrees(line[group], row["value"]):
                found.append(f"{place}: the output has {line[group]}, {row['id']} is {row['value']}; run the command again and put in what it prints")
    return found


def agrees(shown, value):
    """Whether two decimal numbers are one, to half a step of the coarser one."""
    step = max(10.0 ** -len(number.partition(".")[2]) for number in (shown, value))
    return abs(float(shown) - float(value)) <= 0.5001 * step


def old_in_readme(root, old):
    text = (root / "README.md").read_text(encoding="utf8")
    return [
        f"README.md:{prose.line_of(text, marker.start())}: {marker['id']} is older than the code; make it again, or leave it out here"
        for marker in prose.markers(text)
        if marker["id"] in old
    ]


def write(root, figures):
    """Fills markers and notices; returns the pages that changed."""
    table, changed = read(root), []
    expected = notices(root, table, figures)
    paged = pages_with_notices(root, figures)
    for path in sorted({*pages(root, MARKED), *paged}):
        text = new = path.read_text(encoding="utf8")
        for marker in reversed(list(prose.markers(text))):
            if marker["id"] in table:
                start, end = marker.span("text")
                new = new[:start] + shown(table[marker["id"]], marker["kind"]) + new[end:]
        notice = expected.get(path, "")
        if path in paged and said(new) != notice:
            title, rest = NOTICE.sub("", new).split("\n\n", 1)
            new = f"{title}\n\n{notice}{rest}"
        if new != text:
            path.write_text(new, encoding="utf8")
            changed.append(str(path.relative_to(root)))
    return changed


def list_open(root, figures):
    table = read(root)
    unknown = defaultdict(list)
    for path in pages(root, MARKED):
        text = path.read_text(encoding="utf8")
        for marker in prose.markers(text):
            if marker["id"] not in table:
                unknown[marker["id"]].append(f"{path.relative_to(root)}:{prose.line_of(text, marker.start())} {marker['text']!r}")
    for name in sorted(unknown):
        print(f"{name}: {', '.join(unknown[name])}")
    print(f"{len(unknown)} ids without a row")
    for line in of_prose(root, table):
        if "has no source" in line:
            print(line.split(";")[0])
