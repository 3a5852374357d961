#!/usr/bin/env bash
# The book's commands, run as they stand there: every chapter in an empty directory with an empty environment, its output compared.
# In a `console` block a line that begins with "$ " is a command, "> " continues it, and what follows is its output, both streams
# together; "…" stands for any text within a line, and alone in a line for any lines. The chapter "readme" is the first command of the
# README and the block of text that it says the command ends with.
#
# usage: tests/book.sh [GNSS_TWIN_BINARY [CHAPTER…]]     (default: target/release/gnss-twin, all chapters and the README)
#        BOOK_PYTHON names a Python that has the module gnss_twin; without it a wheel is built for the chapter that wants one.
# exit:  0 every command ends with 0 and prints what the book says; 1 one does not; 75 the Python module could not be built.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
shift || true
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin"
ln -s "$twin" "$work/bin/gnss-twin"

chapters=("$@")
if [ ${#chapters[@]} -eq 0 ]; then
    mapfile -t chapters < <(echo readme; sed -n 's/.*](\([a-z_]*\)\.md).*/\1/p' "$root/book/src/SUMMARY.md")
fi
if [[ " ${chapters[*]} " == *" python "* ]]; then
    if [ -z "${BOOK_PYTHON:-}" ]; then
        python3 -m venv "$work/env"
        "$work/env/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9.4,<2' numpy || {
            echo "book: cannot install maturin and numpy here" >&2
            exit 75
        }
        (cd "$root" && "$work/env/bin/maturin" build --quiet --locked --manifest-path python/Cargo.toml --profile dev --out "$work/wheels")
        "$work/env/bin/pip" install --quiet --disable-pip-version-check --no-deps "$work"/wheels/*.whl
        BOOK_PYTHON=$work/env/bin/python
    fi
    # Not a link: an environment of Python's is found by the place of its program.
    printf '#!/bin/sh\nexec "%s" "$@"\n' "$BOOK_PYTHON" >"$work/bin/python"
    chmod +x "$work/bin/python"
fi

python3 - "$root/book/src" "$work" "${chapters[@]}" <<'END'
import difflib
import os
import pathlib
import re
import subprocess
import sys

book, work = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
environment = {"PATH": f"{work}/bin:/usr/local/bin:/usr/bin:/bin", "HOME": str(work), "LANG": "C.UTF-8", "LC_ALL": "C.UTF-8"}


def commands(text):
    """Every command of a chapter with its line and the output that the book prints."""
    for block in re.finditer(r"^```console\n(.*?)^```$", text, re.M | re.S):
        line = text.count("\n", 0, block.start(1)) + 1
        found = []
        for number, row in enumerate(block.group(1).splitlines(), line):
            if row.startswith("$ "):
                found.append([number, [row[2:]], []])
            elif not found:
                sys.exit(f"book: line {number}: a block begins with a command")
            elif row.startswith("> ") or row == ">":
                found[-1][1].append(row[2:])
            else:
                found[-1][2].append(row)
        yield from found


def of_readme(text):
    """The program without arguments, which the README's first command is, and the lines with which the README says that it ends."""
    first = re.search(r"^```\ncargo run --release +#.*?^```text\n(.*?)^```$", text, re.M | re.S)
    if not first:
        sys.exit("book: README.md: expected a block with `cargo run --release` and a block ```text of its output")
    yield text.count("\n", 0, first.start(1)), ["gnss-twin"], ["…", *first[1].splitlines()]


def pattern(rows):
    parts = []
    for row in rows:
        parts.append(r"(?:[^\n]*\n)*?" if row == "…" else r"[^\n]*?".join(map(re.escape, row.split("…"))) + r"\n")
    return re.compile("".join(parts))


failed = count = 0
for chapter in sys.argv[3:]:
    place = work / chapter
    place.mkdir()
    page = book.parent.parent / "README.md" if chapter == "readme" else book / f"{chapter}.md"
    for line, words, expected in (of_readme if chapter == "readme" else commands)(page.read_text()):
        count += 1
        done = subprocess.run(["bash", "-c", "\n".join(words)], cwd=place, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=900)
        rows = [row.rstrip() for row in done.stdout.splitlines()]
        # Blank lines at the end of a block are the book's.
        while expected and not expected[-1]:
            expected.pop()
        while rows and not rows[-1]:
            rows.pop()
        printed = "".join(row + "\n" for row in rows)
        if done.returncode != 0 or not pattern(expected).fullmatch(printed):
            failed += 1
            print(f"book: {page.name}, line {line}: $ {words[0]} (exit code {done.returncode})")
            print("\n".join(difflib.unified_diff(expected, rows, "the book", "the program", lineterm="")))
print(f"book: {count} commands of {len(sys.argv) - 3} chapters, {failed} of them not as printed")
sys.exit(failed > 0 or count == 0)
END
