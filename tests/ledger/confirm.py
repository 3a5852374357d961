"""Confirms pages of studies: makes some of their cases again, and compares them with what the page has.

A change of code makes a page stale whether it changes a figure or not. A study is deterministic, so that a few of its cells, made by
today's program, tell both apart: all their digits are those of the page, or the page is made again.
"""

import csv
import datetime
import math
import re
import subprocess
import tempfile
from pathlib import Path

import check
import digest
import make

# Shards that are made again, spread over the study; each is at most a minute of one core.
SHARDS = 5
# Means are summed in another order here.
RELATIVE = 1e-9
LINE = re.compile(r"^Confirmed at commit [0-9a-f]+ on [\d-]{10}: .*\n\n?", re.M)


def study(command, *arguments):
    done = subprocess.run([make.twin(), "study", command, *map(str, arguments)], cwd=make.ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise make.NotMade(f"study {command} ended with {done.returncode}: {done.stderr.strip()[-300:]}")
    return done.stdout


def chosen(count, repetitions):
    """Shards from the first to the last: groups of neighbours that hold the repetitions of a cell, evenly."""
    groups = count // repetitions
    some = min(max(2, SHARDS // repetitions), groups)
    first = sorted({round(k * (groups - 1) / max(1, some - 1)) * repetitions for k in range(some)})
    return [number + k for number in first for k in range(repetitions)] or list(range(count))


def table(text):
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def made_again(name):
    """Cases of some shards of a study."""
    with tempfile.TemporaryDirectory() as place:
        planned = study("plan", make.ROOT / f"studies/{name}.toml", "--out", place)
        count = int(re.search(r"in (\d+) shards", planned)[1])
        repeated = re.search(r"(\d+) repetitions", planned)
        for number in chosen(count, int(repeated[1]) if repeated else 1):
            study("run", place, "--shard", number)
        return [row for path in sorted(Path(place, "shards").glob("*.csv")) for row in table(path.read_text())]


def compared(cases, cells):
    """How many cells the cases make whole, and how each one differs that does."""
    whole, different = 0, []
    for cell in cells:
        figures = [key.removesuffix(".count") for key in cell if key.endswith(".count")]
        axes = [key for key in cell if not any(key == figure or key.startswith(f"{figure}.") for figure in figures)]
        own = [case for case in cases if all(case[key] == cell[key] for key in axes)]
        counts = {figure: [float(case[figure]) for case in own if case[figure]] for figure in figures}
        if not own or any(len(values) < int(cell[f"{figure}.count"]) for figure, values in counts.items()):
            continue
        whole += 1
        for figure, values in counts.items():
            mean = sum(values) / len(values) if values else math.nan
            if values and not math.isclose(mean, float(cell[figure]), rel_tol=RELATIVE, abs_tol=1e-12):
                where = ", ".join(f"{key} = {cell[key]}" for key in axes)
                different.append(f"{figure} at {where}: {cell[figure]}, now {mean}")
    return whole, different


def confirm(figures, names):
    """Confirms the pages of studies that have stale figures, or those of these names; true if one cannot be."""
    ledger, failed = check.read(make.ROOT), False
    pages = {}
    for figure in figures.values():
        found = re.fullmatch(r"reports/studies/(\w+)/report\.md", getattr(figure.source, "page", ""))
        if found and figure.id in ledger and (found[1] in names if names else check.is_stale(make.ROOT, ledger[figure.id])):
            pages.setdefault(found[1], []).append(figure)
    for name, own in pages.items():
        page = make.ROOT / f"reports/studies/{name}/report.md"
        try:
            whole, different = compared(made_again(name), table((page.parent / "cells.csv").read_text()))
        except make.NotMade as error:
            whole, different = 0, [str(error)]
        if different or not whole:
            failed = True
            print("\n".join(f"{name}: {text}" for text in different or ["no cell became whole"]))
            continue
        write_line(page, whole)
        for figure in own:
            ledger[figure.id]["digest"] = digest.of(make.ROOT, figure.rooms)
        print(f"{name}: {whole} cells made again, the same digits", flush=True)
    check.save(make.ROOT, ledger)
    check.write(make.ROOT, figures)
    return failed


def write_line(page, whole):
    """Says in a page by what it was confirmed."""
    text = LINE.sub("", page.read_text(encoding="utf8"))
    today = datetime.datetime.now(datetime.timezone.utc).date()
    stamp = make.STAMP.search(text) or make.BENCHED.search(text)
    line = f"Confirmed at commit {make.head_commit()} on {today}: {whole} cells made again, the same digits.\n\n"
    end = text.index("\n", stamp.end()) + 1
    rest = text[end:].lstrip("\n")
    page.write_text(f"{text[:end]}\n{line}{rest}", encoding="utf8")
