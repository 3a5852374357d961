"""Confirms pages of studies: makes some of their cases again, and compares them with what the page has.

A change of code makes a page stale whether it changes a figure or not. A study is deterministic, so that a few of its cells, made by
today's program, tell both apart: all their digits are those of the page, or the page is made again.
"""

import csv
import datetime
import json
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
# What the figures of a study depend on.
ROOMS = ("src", "tests", "scenarios", "studies")
LINE = re.compile(r"^Confirmed at commit [0-9a-f]+\+? on [\d-]{10}: .*\n\n?", re.M)
# Columns of a case that are neither an axis nor a figure.
OWN = ("case", "seed", "repetition")
ENDS = ("low", "high", "count")


def study(command, *arguments):
    done = subprocess.run([make.twin(), "study", command, *map(str, arguments)], cwd=make.ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise make.NotMade(f"study {command} ended with {done.returncode}: {done.stderr.strip()[-300:]}")
    return done.stdout


class Grid:
    """The cases of a plan in its own order (`src/study/sweep/axis.rs`): axes of the signal, repetitions, axes of the receiver."""

    def __init__(self, manifest):
        try:
            axes = manifest["axes"]
            lengths = [len(axis["values"][0]) for axis in axes]
            keys = [axis["keys"] for axis in axes]
            at = keys.index(["repetition"])
            self.cases, self.shard_size = manifest["n_cases"], manifest["shard_size"]
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise make.NotMade(f"the plan's manifest is not as expected: {error!r}") from error
        if math.prod(lengths) != self.cases or self.shard_size < 1:
            raise make.NotMade(f"the plan's manifest has {self.cases} cases in shards of {self.shard_size}, its axes span {math.prod(lengths)}")
        self.axes = [key for own in keys for key in own if own != ["repetition"]]
        self.repetitions = lengths[at]
        # Neighbouring cases in which the cells of a signal are whole.
        self.signal_cases = math.prod(lengths[at:])

    def chosen(self):
        """Shards in which the cells of some signals are whole: of the first, the last and others between them, evenly."""
        signals, size = self.cases // self.signal_cases, self.shard_size
        some = min(max(2, SHARDS * size // self.signal_cases), SHARDS, signals)
        taken = {round(k * (signals - 1) / max(1, some - 1)) for k in range(some)}
        return sorted({case // size for k in taken for case in range(k * self.signal_cases, (k + 1) * self.signal_cases)})


def table(text):
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def made_again(name):
    """The grid of a study, and the cases of some of its shards."""
    with tempfile.TemporaryDirectory() as place:
        study("plan", make.ROOT / f"studies/{name}.toml", "--out", place)
        grid = Grid(json.loads(Path(place, "manifest.json").read_text(encoding="utf8")))
        for number in grid.chosen():
            study("run", place, "--shard", number)
        return grid, [row for path in sorted(Path(place, "shards").glob("*.csv")) for row in table(path.read_text(encoding="utf8"))]


def number(text):
    try:
        return float(text)
    except ValueError:
        return math.nan


def compared(cases, cells, axes, repetitions):
    """How many cells have all of their repetitions among the cases, and how each of them differs from its page."""
    head, now = list(cells[0]) if cells else [], list(cases[0]) if cases else []
    intervals = {f"{name}.{end}" for name in head for end in ENDS} & set(head)
    on_page, today = ({*head} - intervals, {*now} - {*OWN})
    if on_page != today or not {*axes} <= today:
        names = sorted((on_page ^ today) | ({*axes} - today))
        return 0, [f"columns of the page or of today alone: {', '.join(names)}"]
    page = {tuple(cell[key] for key in axes): cell for cell in cells}
    found = {}
    for case in cases:
        found.setdefault(tuple(case[key] for key in axes), []).append(case)
    whole, different = 0, []
    for place, own in found.items():
        if len(own) < repetitions:
            continue
        whole += 1
        where = ", ".join(f"{key} = {value}" for key, value in zip(axes, place))
        if len(own) > repetitions or place not in page:
            different.append(f"the cell at {where}: {len(own)} cases of {repetitions}, {'on' if place in page else 'not on'} the page")
            continue
        cell = page[place]
        for figure in (name for name in head if name in today and name not in axes):
            values = [number(case[figure]) for case in own if case[figure]]
            mean = sum(values) / len(values) if values else math.nan
            least = 1e-12 * max(map(abs, values), default=0.0)
            count = cell.get(f"{figure}.count", "")
            if count and count != str(len(values)):
                different.append(f"{figure} at {where}: of {count} values, now of {len(values)}")
            elif bool(cell[figure]) != bool(values):
                different.append(f"{figure} at {where}: {cell[figure] or 'empty'}, now {mean if values else 'empty'}")
            elif values and not math.isclose(mean, number(cell[figure]), rel_tol=RELATIVE, abs_tol=least):
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
        rooms = tuple(sorted({room for figure in own for room in figure.rooms}))
        try:
            make.warn_of_old_program(rooms)
            grid, cases = made_again(name)
            cells = table((page.parent / "cells.csv").read_text(encoding="utf8"))
            whole, different = compared(cases, cells, grid.axes, grid.repetitions)
        except (make.NotMade, OSError) as error:
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
    """Says in a page by what code it was confirmed."""
    text = LINE.sub("", page.read_text(encoding="utf8"))
    today = datetime.datetime.now(datetime.timezone.utc).date()
    stamp = make.STAMP.search(text) or make.BENCHED.search(text)
    line = f"Confirmed at commit {make.head_commit(ROOMS)} on {today}: {whole} cells made again, the same digits.\n\n"
    end = text.index("\n", stamp.end()) + 1
    rest = text[end:].lstrip("\n")
    page.write_text(f"{text[:end]}\n{line}{rest}", encoding="utf8")
