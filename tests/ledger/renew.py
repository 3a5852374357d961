"""Makes figures again: runs what a figure's declaration names, and writes its row."""

import datetime
import functools
import sys
import tempfile
from pathlib import Path

import check
import digest
import make


def chosen(figures, prefixes):
    """Figures whose ids or pages begin so, and all others of the pages that they are read from."""
    begin = tuple(prefixes) or ("",)
    some = [figure for name, figure in figures.items() if name.startswith(begin) or getattr(figure.source, "page", "").startswith(begin)]
    if not some:
        sys.exit(f"no figure or page begins with {' or '.join(prefixes)}")
    read = {figure.source.page for figure in some if isinstance(figure.source, make.Page)}
    return [figure for figure in figures.values() if figure in some or getattr(figure.source, "page", None) in read]


def stamp(path):
    """Says in a page that its command just wrote at which commit, when and on what. A page as it is in git is not new."""
    text = path.read_text(encoding="utf8")
    is_new = make.output("git", "status", "--porcelain", "--", str(path)).strip() != ""
    if is_new and not make.STAMP.search(text) and not make.BENCHED.search(text):
        title, rest = text.split("\n\n", 1)
        today = datetime.datetime.now(datetime.timezone.utc).date()
        line = f"Measured at commit {make.head_commit(('src', 'tests'))} on {today}, {make.processor()}."
        path.write_text(f"{title}\n\n{line}\n\n{rest}", encoding="utf8")


@functools.cache
def digest_at(commit, rooms):
    """Digest of rooms at a commit; unknown where they were not there."""
    with tempfile.TemporaryDirectory() as place:
        make.tree_of(commit, place)
        try:
            return digest.of(Path(place), rooms)
        except FileNotFoundError:
            return "unknown"


def row_of(figure, old):
    """A figure made again."""
    source = figure.source
    if isinstance(source, make.Page) and not source.mark and (make.ROOT / source.page).is_file():
        stamp(make.ROOT / source.page)
    if isinstance(source, make.Run):
        make.warn_of_old_program(figure.rooms)
    made = source.make()
    value, bar = check.rounded(made.value, figure.digits), made.bar if made.bar is not None else figure.bar
    rooms = " ".join(figure.rooms)
    commit = made.commit or (make.head_commit(figure.rooms) if figure.rooms else "")
    if old and made.commit == old["commit"] and rooms == old["rooms"]:
        code = old["digest"]
    elif made.commit and made.commit.rstrip("+") != make.head_commit().rstrip("+"):
        # Of a tree with changes its commit is the nearest that is known.
        code = digest_at(made.commit.rstrip("+"), figure.rooms)
    else:
        code = digest.of(make.ROOT, figure.rooms) if figure.rooms else ""
    today = str(datetime.datetime.now(datetime.timezone.utc).date()) if figure.rooms else ""
    cells = (figure.id, figure.what, value, figure.unit, bar, check.met(value, bar), source.command, commit, made.date or today,
             made.processor, made.runs, rooms, code)
    return dict(zip(check.COLUMNS, cells))


def make_all(figures, prefixes):
    table, failed = check.read(make.ROOT), 0
    for name in table.keys() - figures.keys():
        del table[name]
    for figure in chosen(figures, prefixes):
        try:
            old = table.get(figure.id)
            table[figure.id] = row = row_of(figure, old)
            before = f" (was {old['value']})" if old and old["value"] != row["value"] else ""
            bar = f", {row['bar']}: {row['met']}" if row["bar"] else ""
            print(f"{figure.id}: {check.shown(row, '=')}{before}{bar}", flush=True)
        except (make.NotMade, OSError) as error:
            failed += 1
            print(f"{figure.id}: not made: {error}", file=sys.stderr)
        check.save(make.ROOT, table)
    check.write(make.ROOT, figures)
    return failed > 0


def compare(figures, prefixes):
    """Makes what is the same on every machine, and says where the ledger has another value."""
    table, failed = check.read(make.ROOT), 0
    for figure in chosen(figures, prefixes):
        if not isinstance(figure.source, (make.Run, make.Count, make.Asserted)):
            continue
        try:
            value = check.rounded(figure.source.make().value, figure.digits)
        except (make.NotMade, OSError) as error:
            value = f"not made ({error})"
        recorded = table.get(figure.id, {}).get("value", "nothing")
        if value != recorded:
            failed += 1
            print(f"{figure.id} is {value}, {check.LEDGER} has {recorded}; make it again by: --make {figure.id}")
    return failed > 0
