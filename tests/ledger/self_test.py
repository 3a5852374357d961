"""Faults planted in a small repository with a ledger of its own: each must be found, with its file, its line and its cure."""

import subprocess
import tempfile
from pathlib import Path

import check
import confirm
import digest
import make
from figures import Figure

SOURCE = '''//! A room.
/// Speed of light in m/s.
pub const C: f64 = 299_792_458.0; // a comment
pub fn text() -> &'static str {
    "// no comment"
}

#[cfg(test)]
mod tests {
    #[test]
    fn c_is_large() {
        assert!(super::C > 1.0);
    }
}
'''
README = '''# Twin

The error is <!--=a.error_m-->0.31 m<!--/--> at rest, of <!--#a.bias_m-->−0.05<!--/--> m east on average.

The carrier is 1575.42 MHz; an epoch is 100 ms long.
<!--const-->

```
error 17 m
```

| key | range |
| --- | --- |
| `mask_deg` | 0 to 90 ° |

All <!--=a.cells-->3 of 3<!--/--> cells fit, and `0.7 m` is code.
'''
PAGE = "# Page\n\nMeasured at commit 1234567 on 2026-01-02, a processor.\n\n3 of 3 cells fit.\n"


class Given:
    """A figure whose value nothing makes."""

    command = "measure"


FIGURES = {
    figure.id: figure
    for figure in (
        Figure("a.error_m", "an error", "m", Given(), ("src/room",)),
        Figure("a.bias_m", "a bias", "m", Given(), ("src/room",)),
    )
}


class Place:
    """A small repository, sound until something in it is changed."""

    def __init__(self, root):
        self.root = Path(root)
        for folder in ("src/room", "reports", "book/src"):
            (self.root / folder).mkdir(parents=True)
        self.put("src/room/lib.rs", SOURCE)
        self.put("README.md", README)
        self.put("book/src/first.md", "# First\n\nNothing is measured here.\n")
        self.put("book/src/second.md", "# Second\n\nThe code fits in <!--=a.cells-->3 of 3<!--/--> cells.\n")
        self.put("reports/page.md", PAGE)
        page = make.Page(str(self.root / "reports/page.md"), "bench", pattern=r"^(\d+ of \d+) cells")
        cells = Figure("a.cells", "cells that fit", "", page, ("src/room",), "all")
        self.figures = {**FIGURES, cells.id: cells}
        code = digest.of(self.root, ["src/room"])
        row = dict(zip(check.COLUMNS, ["a.error_m", "an error", "0.31", "m", "≤ 0.5", "yes", "measure", "1234567", "2026-01-02",
                                          "a processor", "1", "src/room", code]))
        bias = {**row, "id": "a.bias_m", "what": "a bias", "value": "-0.05", "bar": "", "met": "–"}
        cells = {**row, "id": "a.cells", "what": "cells that fit", "value": "3 of 3", "unit": "", "bar": "all", "command": "bench"}
        check.save(self.root, {each["id"]: each for each in (row, bias, cells)})

    def put(self, path, text):
        (self.root / path).write_text(text, encoding="utf8")

    def change(self, path, old, new):
        text = (self.root / path).read_text(encoding="utf8")
        assert old in text, f"{path} has no {old!r}"
        self.put(path, text.replace(old, new, 1))

    def found(self):
        digest.of_room.cache_clear()
        return check.check(self.root, self.figures)


# What is changed, and what one finding must then say. A change that nothing may report has no text.
FAULTS = [
    ("nothing", [], None),
    ("a figure in prose", [("README.md", "0.31 m<", "0.12 m<")], "README.md:3: a.error_m is shown as '0.12 m', the ledger has '0.31 m'; fill it by: --write"),
    ("a number alone", [("README.md", "−0.05<", "−0.04<")], "README.md:3: a.bias_m is shown as '−0.04'"),
    ("an id", [("README.md", "=a.error_m", "=a.errors_m")], "README.md:3: no figure a.errors_m in reports/evidence.csv; the nearest is a.error_m"),
    ("a figure typed by hand", [("README.md", "an epoch is 100 ms long.\n<!--const-->", "the error is 0.2 m.")], "README.md:5: '0.2 m' has no source"),
    ("a figure in the book", [("book/src/first.md", "Nothing", "12 of 12 cells fit. Nothing")], "book/src/first.md:3: '12 of 12' has no source"),
    ("a figure in a table of results", [("README.md", "| key |", "| error |")], "README.md:14: '90 °' has no source"),
    ("a page declared as a whole", [("book/src/first.md", "# First\n", "# First\n\n<!--const section-->\n\n12 m.\n")],
     "book/src/first.md:3: all numbers of a page are declared constants; declare sections or paragraphs"),
    ("a figure of such a page", [("book/src/first.md", "# First\n", "# First\n\n<!--const section-->\n\n12 m.\n")],
     "book/src/first.md:5: '12 m' has no source"),
    ("a section declared", [("book/src/first.md", "# First\n", "# First\n\n## A\n\n<!--const section-->\n\n12 m.\n")], None),
    ("a marker without an end", [("README.md", "0.31 m<!--/-->", "0.31 m")], "README.md:3: "),
    ("a marker that begins a line", [("README.md", "The error is <", "<")], "README.md:3: a marker begins the line; put a word before it"),
    ("code", [("src/room/lib.rs", "458.0", "459.0")], "reports/evidence.csv:2: stale: a.bias_m, a.error_m: of src/room, made at 1234567; make again by: --make a."),
    ("text in code", [("src/room/lib.rs", "// no comment", "// a comment")], "stale: a.bias_m, a.error_m: of src/room"),
    ("a comment", [("src/room/lib.rs", "// a comment", "// another comment")], None),
    ("a comment of the library", [("src/room/lib.rs", "/// Speed of light in m/s.", "/// Speed of light.\n\n")], None),
    ("layout", [("src/room/lib.rs", "() -> &'static str {", "() ->\n    &'static str\n{")], None),
    ("a test", [("src/room/lib.rs", "C > 1.0", "C > 2.0")], None),
    ("a value in the ledger", [("reports/evidence.csv", "3 of 3", "4 of 4")], "reports/evidence.csv:3: a.cells is 4 of 4, its source says 3 of 3; make it again"),
    ("a page made again", [("reports/page.md", "1234567", "7654321")], "a.cells is of 1234567, its page of 7654321"),
    ("a page without its commit", [("reports/page.md", "Measured at commit 1234567 on", "Of")], "does not say at which commit it was measured"),
    ("a missed bar that is called met", [("reports/evidence.csv", "≤ 0.5", "≤ 0.2")], "reports/evidence.csv:4: a.error_m: met says yes of 0.31 against ≤ 0.2"),
    ("a row without its commit", [("reports/evidence.csv", "≤ 0.5,yes,measure,1234567", "≤ 0.5,yes,measure,")],
     "a.error_m: a measured figure without the commit of its code; make it again by: --make a.error_m"),
    ("words of a row", [("reports/evidence.csv", "an error", "a tiny error")], "a.error_m: what is 'a tiny error', declared 'an error'"),
    ("a row that nobody declared", [("reports/evidence.csv", "a.bias_m", "a.bios_m")], "a.bios_m is not declared in tests/ledger/figures.py"),
    ("a row too few", [("reports/evidence.csv", "a.bias_m", "a.bios_m")], "reports/evidence.csv:1: a.bias_m: declared without a row; make by: --make a."),
]


def run():
    """Plants each fault alone; returns whether one was missed."""
    missed = []
    for what, changes, expected in FAULTS:
        with tempfile.TemporaryDirectory() as root:
            place = Place(root)
            for path, old, new in changes:
                place.change(path, old, new)
            found, _ = place.found()
            if expected is None and found:
                missed.append(f"{what}: reported though it is no fault: {found}")
            elif expected and not any(text.startswith(expected) or expected in text for text in found):
                missed.append(f"{what}: expected {expected!r} in {found}")
    missed += write_mends_what_it_can() + the_readme_prints_the_ledger() + a_stale_page_says_so() + a_page_is_confirmed_by_its_digits()
    print("\n".join(missed) or f"evidence: {len(FAULTS) + len(COMPARED) + 12} planted faults, all found")
    return bool(missed)


OUTPUT = '''```text
sky · 60 s at 6.5 Msps · seed 1
first fix     27.1 s, 329 fixes
position east (m)              -0.0125      0.0087      0.0258
position north (m)              0.0612      0.0200      0.0932
position up (m)                -0.0915      0.1582      0.2441
0 losses of lock, 0 cycle slips
```
'''


def the_readme_prints_the_ledger():
    """Numbers of the README's output against rows of the ledger: sound, a digit too large, a line too few, a row too few."""
    values = {"first_fix_s": "27.1", "fixes": "329", "east_m": "-0.013", "north_m": "0.061", "up_m": "-0.092",
              "vertical_p95_m": "0.24", "losses": "0", "slips": "0"}
    table = {f"accuracy.sky.{name}": {"id": f"accuracy.sky.{name}", "value": value} for name, value in values.items()}
    missed = []
    with tempfile.TemporaryDirectory() as root:
        place = Place(root)
        for change, rows, expected in [
            (("0.2441", "0.2441"), table, None),
            (("0.2441", "0.2541"), table, "README.md:6: the output has 0.2541, accuracy.sky.vertical_p95_m is 0.24"),
            (("0 losses of lock", "1 loss of lock"), table, "README.md:1: the output has no line like"),
            (("329", "329"), {name: row for name, row in table.items() if "fixes" not in name}, "README.md:3: no figure accuracy.sky.fixes"),
        ]:
            place.put("README.md", OUTPUT.replace(*change))
            found = check.printed_in_readme(place.root, rows)
            if bool(found) != bool(expected) or (expected and not found[0].startswith(expected)):
                missed.append(f"the README's output with {change}: expected {expected!r} in {found}")
    return missed


def write_mends_what_it_can():
    with tempfile.TemporaryDirectory() as root:
        place = Place(root)
        place.change("README.md", "0.31 m<", "9 km<")
        check.write(place.root, place.figures)
        found, _ = place.found()
        same = (place.root / "README.md").read_text(encoding="utf8") == README
        return [] if not found and same else [f"--write: {found}"]


def a_stale_page_says_so():
    """A page of an expensive command may be older than the code where it says so; it is warned of, and never silently."""
    with tempfile.TemporaryDirectory() as root:
        place = Place(root)
        place.change("src/room/lib.rs", "458.0", "459.0")
        silent, warnings = place.found()
        check.write(place.root, place.figures)
        told, again = place.found()
        text = (place.root / "reports/page.md").read_text(encoding="utf8")
        page, chapter = "reports/page.md", "book/src/second.md"
        good = (
            all(any(f"{path}:3: the page does not say" in one for one in silent) for path in (page, chapter))
            and len(warnings) == len(again) == 1
            and not any(path in one for one in told for path in (page, chapter))
            and any("README.md:16: a.cells is older than the code" in one for one in told)
            and "*Older than the code: measured at commit 1234567 on 2026-01-02. `bench` makes it again.*" in text
            and "*Older than the code: a.cells, measured at commit 1234567 on 2026-01-02. `bench` measures again.*"
            in (place.root / chapter).read_text(encoding="utf8")
        )
        return [] if good else [f"a stale page: {silent} {warnings} {told}"]


CELLS = [{"bandwidth_hz": "8", "error_m": "2.5", "error_m.low": "2", "error_m.high": "3", "error_m.count": "2", "theory.error_m": "2"}]
CASES = [{"case": str(k), "seed": "7", "repetition": str(k), "bandwidth_hz": "8", "error_m": value, "theory.error_m": "2"}
         for k, value in enumerate(("2", "3"))]
# What is changed of a case (the last one) and of the cell, whether the cell is whole then, and what its difference must say.
COMPARED = [
    ("nothing", {}, {}, 1, None),
    ("a digit", {"error_m": "3.0000001"}, {}, 1, "error_m at bandwidth_hz = 8: 2.5, now 2.5"),
    ("a figure of theory", {"theory.error_m": "3"}, {}, 1, "theory.error_m at bandwidth_hz = 8: 2, now 2.5"),
    ("a case too few", {"bandwidth_hz": "9"}, {}, 0, None),
    ("a value too few", {"error_m": ""}, {}, 1, "error_m at bandwidth_hz = 8: of 2 values, now of 1"),
    ("a value more", {}, {"error_m": "2", "error_m.count": "1"}, 1, "error_m at bandwidth_hz = 8: of 1 values, now of 2"),
    ("no value on the page", {}, {"error_m": "", "error_m.count": ""}, 1, "error_m at bandwidth_hz = 8: empty, now 2.5"),
    ("no theory on the page", {}, {"theory.error_m": ""}, 1, "theory.error_m at bandwidth_hz = 8: empty, now 2.0"),
    ("a word on the page", {}, {"error_m": "none"}, 1, "error_m at bandwidth_hz = 8: none, now 2.5"),
    ("another axis value on the page", {}, {"bandwidth_hz": "9"}, 1, "the cell at bandwidth_hz = 8: 2 cases of 2, not on the page"),
    ("a column of today", {"sigma_m": "1"}, {}, 0, "columns of the page or of today alone: sigma_m"),
    ("a column of the page", {}, {"sigma_m": "1", "sigma_m.count": "2"}, 0, "columns of the page or of today alone: sigma_m"),
]


def a_page_is_confirmed_by_its_digits():
    """A cell counts where all of its repetitions are there, with values or without; each difference has a name."""
    missed = []
    for what, of_case, of_cell, whole, expected in COMPARED:
        cases = [{**CASES[0], **{key: "1" for key in of_case if key not in CASES[0]}}, {**CASES[1], **of_case}]
        found = confirm.compared(cases, [{**CELLS[0], **of_cell}], ["bandwidth_hz"], 2)
        told = [text for text in found[1] if expected and text.startswith(expected)]
        if found[0] != whole or len(found[1]) != bool(expected) or bool(told) != bool(expected):
            missed.append(f"a page confirmed, {what}: {found}")
    empty = [{**case, "error_m": ""} for case in CASES]
    for what, cells, expected in [
        ("no values today", CELLS, "error_m at bandwidth_hz = 8: of 2 values, now of 0"),
        ("no values on either side", [{**CELLS[0], "error_m": "", "error_m.count": "0"}], None),
        ("a mean of no values", [{**CELLS[0], "error_m.count": "0"}], "error_m at bandwidth_hz = 8: 2.5, now empty"),
    ]:
        found = confirm.compared(empty, cells, ["bandwidth_hz"], 2)
        if found != (1, [expected] if expected else []):
            missed.append(f"a page confirmed, {what}: {found}")
    found = confirm.compared(CASES + CASES[:1], CELLS, ["bandwidth_hz"], 2)
    if found != (1, ["the cell at bandwidth_hz = 8: 3 cases of 2, on the page"]):
        missed.append(f"a page confirmed, a repetition twice: {found}")
    return missed + shards_hold_cells() + a_page_says_by_what_it_was_confirmed()


def plan(signals, repetitions, receivers, shard_size):
    """A manifest of a study with an axis of the signal and one of the receiver."""
    axes = [(["scene", "cn0"], [list(range(signals))] * 2), (["repetition"], [list(range(repetitions))]), (["hz"], [list(range(receivers))])]
    named = [{"keys": keys, "values": values} for keys, values in axes]
    return {"axes": named, "n_cases": signals * repetitions * receivers, "shard_size": shard_size}


def shards_hold_cells():
    """Shards that are made again hold the cells of whole signals, by the plan's order; a plan of another form is refused."""
    missed = []
    for arguments, expected in [
        ((18, 5, 1, 1), [0, 1, 2, 3, 4, 85, 86, 87, 88, 89]),
        ((200, 1, 1, 1), [0, 50, 100, 149, 199]),
        ((3, 1, 4, 4), [0, 1, 2]),
        # The cases of a signal begin and end within shards.
        ((10, 5, 3, 7), [0, 1, 2, 19, 20, 21]),
        # A shard holds the cells of a signal.
        ((20, 5, 1, 5), [0, 5, 10, 14, 19]),
        ((4, 2, 3, 100), [0]),
        ((1, 2, 3, 2), [0, 1, 2]),
    ]:
        grid = confirm.Grid(plan(*arguments))
        if (grid.chosen(), grid.axes, grid.repetitions) != (expected, ["scene", "cn0", "hz"], arguments[1]):
            missed.append(f"shards of {arguments}: {grid.chosen()}, expected {expected}")
    whole = plan(3, 2, 1, 1)
    for what, bad in [
        ("without repetitions", {**whole, "axes": whole["axes"][:1]}),
        ("of other cases", {**whole, "n_cases": 7}),
        ("without axes", {"n_cases": 6, "shard_size": 1}),
    ]:
        try:
            missed.append(f"a plan {what} is taken: {confirm.Grid(bad).chosen()}")
        except make.NotMade as error:
            if "manifest" not in str(error):
                missed.append(f"a plan {what}: {error}")
    return missed


def a_page_says_by_what_it_was_confirmed():
    """The line is one, names the code's commit, and has the plus of code that differs from it."""
    with tempfile.TemporaryDirectory() as root:
        place, before = Place(root), make.ROOT
        page = place.root / "reports/page.md"
        git = ["git", "-C", root, "-c", "user.name=a", "-c", "user.email=a@example.com"]
        for command in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "all"]):
            subprocess.run([*git, *command], check=True)
        make.ROOT, texts = place.root, []
        try:
            head = make.head_commit()
            for whole, path in ((3, "reports/page.md"), (7, "src/room/lib.rs"), (9, "README.md"), (2, None)):
                confirm.write_line(page, whole)
                texts.append(page.read_text(encoding="utf8"))
                if path:
                    place.put(path, (place.root / path).read_text(encoding="utf8") + "\n")
        finally:
            make.ROOT = before
        good = all(text.count("Confirmed at") == 1 for text in texts) and not place.found()[0]
        for text, whole, mark in zip(texts, (3, 7, 9, 2), ("", "", "+", "+")):
            good = good and f"Confirmed at commit {head}{mark} on" in text and f": {whole} cells made again" in text
        return [] if good else [f"a confirmed page: {head} {texts}"]
