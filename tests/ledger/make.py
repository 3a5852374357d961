"""How a figure is made: a source gives its value, and with what it was made."""

import csv
import datetime
import functools
import io
import json
import math
import os
import re
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

import digest

ROOT = Path(__file__).resolve().parent.parent.parent
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"


class NotMade(Exception):
    """Why a figure could not be made."""


@dataclass(frozen=True)
class Made:
    """A value with its circumstances. `bar` replaces the declared one; `commit` is None for the code as it lies here."""

    value: str | float
    processor: str = "any"
    runs: str = "1"
    bar: str | None = None
    commit: str | None = None
    date: str | None = None


def twin():
    """The program under measurement."""
    named = os.environ.get("GNSS_TWIN", "")
    if not named or not Path(named).is_file():
        raise NotMade("GNSS_TWIN names no program; build one (cargo build --release) and set GNSS_TWIN=target/release/gnss-twin")
    return str(Path(named).resolve())


def output(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT, **options).stdout


def processor():
    """Model and cores of this machine."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    model = re.search(r"^model name\s*: (.*)$", text, re.M)
    return f"{model[1] if model else os.uname().machine}, {len(os.sched_getaffinity(0))} cores"


@functools.cache
def run(program, scene):
    """Summary and verdict of a scene, run in a directory that is gone afterwards."""
    with tempfile.TemporaryDirectory() as place:
        done = subprocess.run([program, "run", str(ROOT / scene), "--quiet", "--out", f"{place}/run"], capture_output=True, text=True)
        summary, verdict = Path(place, "run/summary.json"), Path(place, "run/verdict.csv")
        if done.returncode != 0 or not summary.is_file():
            raise NotMade(f"{program} run {scene} ended with {done.returncode}: {done.stderr.strip()[-300:]}")
        return json.loads(summary.read_text()), list(csv.DictReader(io.StringIO(verdict.read_text())))


def at(summary, path):
    """What a summary holds at a path such as `position.bias_enu_m.0`."""
    for step in path.split("."):
        summary = summary[int(step)] if isinstance(summary, list) else summary.get(step)
        if summary is None:
            raise NotMade(f"summary.json has no {path}")
    return summary


@dataclass(frozen=True)
class Run:
    """A figure of a scene's run: the same on every machine. Its bar is the limit that the verdict holds it to, if any. A row of the
    verdict that takes a known bias out before judging has another value, and its limit is no bar of the figure."""

    scene: str
    path: str

    @property
    def command(self):
        return f"gnss-twin run {self.scene}"

    def make(self):
        summary, verdict = run(twin(), self.scene)
        value = at(summary, self.path)
        rows = [row for row in verdict if row["path"] == self.path and row["limit"]]
        limits = [row["limit"] for row in rows if math.isclose(float(row["value"]), value, rel_tol=1e-3)]
        return Made(value, bar=limits[0] if limits else None)


@dataclass(frozen=True)
class Script:
    """A figure that a script prints, and its bar."""

    command: str
    pattern: str
    text: str = r"\1"

    def make(self):
        if "GNSS_TWIN" in self.command:
            twin()
        found = re.search(self.pattern, printed(self.command), re.S if "(?s)" in self.pattern else 0)
        if not found:
            raise NotMade(f"{self.command} printed nothing like {self.pattern}")
        return Made(found.expand(self.text), bar=f"≤ {found[2]}" if found.re.groups > 1 and self.text == r"\1" else None)


@dataclass(frozen=True)
class Text(Script):
    """A figure of a page's text. It has the commit at which it was made and is never stale: `.ci/long` holds the text of the day."""

    text_of: str = ""

    def make(self):
        today = str(datetime.datetime.now(datetime.timezone.utc).date())
        return Made(super().make().value, commit=head_commit((self.text_of,)), date=today)


@functools.cache
def printed(command):
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True)
    return done.stdout + done.stderr


@dataclass(frozen=True)
class Count:
    """How often a pattern stands in files (or its number, where it captures one), or how many files there are. Never stale."""

    pattern: str | None
    files: str

    @property
    def command(self):
        return f"counted in {self.files}"

    def make(self):
        paths = sorted(ROOT.glob(self.files))
        if self.pattern is None:
            return Made(str(len(paths)), "", "")
        found = [match for path in paths for match in re.finditer(self.pattern, path.read_text(), re.M)]
        captured = [match[1] for match in found if match.re.groups]
        return Made(captured[0] if captured else str(len(found)), "", "")


@dataclass(frozen=True)
class Asserted:
    """A bound that a test of `.ci/run` asserts, as its source has it: it holds while the test passes."""

    test: str
    pattern: str
    text: str = r"\1"

    @property
    def command(self):
        return f"asserted by {self.test}"

    def make(self):
        found = re.search(self.pattern, (ROOT / self.test).read_text(), re.M)
        if not found:
            raise NotMade(f"{self.test} has nothing like {self.pattern}")
        return Made(found.expand(self.text), "", "")


STAMP = re.compile(r"^Measured at commit (?P<commit>[0-9a-f]{7,}\+?) on (?P<date>[\d-]{10}), (?P<processor>.*)\.$", re.M)
# The line of benches (`benches/shared/machine.rs`).
BENCHED = re.compile(r"^(?P<processor>[^;\n]*); rustc [^;\n]*;.*?(?P<date>\d{4}-\d\d-\d\d); commit (?P<commit>[0-9a-f]{7,}\+?)", re.M)


@dataclass(frozen=True)
class Page:
    """A figure of a page that a long command writes: a cell of a table, or a sentence's."""

    page: str
    command: str
    pattern: str = ""
    text: str = r"\1"
    row: str = ""
    less: str = ""
    per: float = 1
    column: str = "value"
    which: int = 0
    mark: str = ""
    after: str = ""
    counted: str = ""
    summed: int = 0
    runs: str = "1"

    def value(self):
        text = self.part()
        if self.counted:
            return str(len(re.findall(self.counted, text, re.M)))
        if self.summed:
            return str(sum(int(row[self.summed]) for row in rows(text) if row[self.summed].isdigit()))
        if self.pattern:
            found = re.search(self.pattern, text, re.M)
            if not found:
                raise NotMade(f"{self.page} has nothing like {self.pattern}")
            return found.expand(self.text)
        text = text[text.index(self.after) :]
        return (self.cell(text, self.row) - (self.cell(text, self.less) if self.less else 0.0)) / self.per

    def cell(self, text, name):
        head = []
        for row in rows(text):
            if row[0].strip("`") == name and self.column in head:
                return float(re.findall(NUMBER, row[head.index(self.column)])[self.which])
            head = row if self.column in row else head
        raise NotMade(f"{self.page} has no row {name!r} with a column {self.column!r}")

    def part(self):
        text = (ROOT / self.page).read_text()
        if not self.mark:
            return text
        return text.split(f"<!-- {self.mark} -->\n", 1)[1].split(f"<!-- end of {self.mark} -->", 1)[0]

    def make(self):
        found = STAMP.search(self.part()) or BENCHED.search(self.part())
        if not found:
            raise NotMade(f"{self.page} does not say at which commit it was measured; if {self.command} just wrote it: --make")
        return Made(self.value(), found["processor"], self.runs, commit=found["commit"], date=found["date"])


def rows(text):
    for line in text.splitlines():
        if line.startswith("|"):
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if len(cells) > 1:
                yield cells


def head_commit(rooms=()):
    """The commit of the code as it lies here, with a plus where rooms differ from it."""
    changed = output("git", "status", "--porcelain", "--", *rooms).strip() if rooms else ""
    return output("git", "rev-parse", "--short=9", "HEAD").strip() + ("+" if changed else "")


def tree_of(commit, place):
    """Puts the files of a commit into a directory."""
    done = subprocess.run(["git", "archive", commit.rstrip("+")], cwd=ROOT, capture_output=True)
    if done.returncode != 0:
        raise NotMade(f"commit {commit} is not in this repository")
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        archive.extractall(place, filter="data")


@functools.cache
def warn_of_old_program(rooms):
    """Says where the program is older than code that a figure speaks of: it may have been built of other code."""
    program = Path(twin())
    paths = [path for room in rooms for path in digest.files(ROOT, room)]
    newer = [path for path in paths if path.stat().st_mtime > program.stat().st_mtime]
    if newer:
        print(f"warning: {program} is older than {newer[0].relative_to(ROOT)}: build it again", file=sys.stderr)
