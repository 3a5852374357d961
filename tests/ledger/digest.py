"""Digests of code: the same where only comments, layout or tests of a room changed.

A room is a file or a folder. Rust sources count without comments, white space, trailing commas and tests; TOML files without
comment lines; Markdown does not count; any other file counts byte by byte.
"""

import functools
import hashlib
import re
from pathlib import Path

DIGITS = 12
# Comments, strings, characters, white space: alternatives in the order in which Rust's lexer would meet them.
TOKEN = re.compile(
    r"""(?P<drop>//[^\n]*|/\*.*?\*/|\s+)|(?P<keep>\bb?c?r(?P<hashes>\#*)".*?"(?P=hashes)|"(?:\\.|[^"\\])*"|'(?:\\.[^']*|[^'\\\n])')""",
    re.S,
)
# An item of tests: it ends on its own line, or at the closing brace of its own indentation (rustfmt).
TESTS = re.compile(r"^([ ]*)#\[cfg\(test\)\]\n(?:\1#[^\n]*\n)*\1(?:[^\n]*[;}]\n|.*?^\1\}[;,]?\n)", re.S | re.M)


def rust(text):
    """Code of a Rust source without comments, white space outside of strings, trailing commas and items of tests."""
    code = TOKEN.sub(lambda found: found["keep"] or "", TESTS.sub("", text))
    return re.sub(r",([)\]}])", r"\1", code)


def toml(text):
    return "\n".join(line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#"))


def is_test(path):
    return path.name == "tests.rs" or path.name.endswith("_tests.rs") or "tests" in path.parts[:-1]


def files(root, room):
    """Files that count in a room, in order."""
    place = root / room
    if place.is_file():
        return [place]
    inside = sorted(path for path in place.rglob("*") if path.is_file())
    return [p for p in inside if p.suffix != ".md" and not (p.suffix == ".rs" and is_test(p.relative_to(place)))]


@functools.lru_cache(maxsize=None)
def of_room(root, room):
    """Digest of one room, or None where it holds no file."""
    total = hashlib.sha256()
    found = files(Path(root), room)
    for path in found:
        data = path.read_bytes()
        if path.suffix == ".rs":
            data = rust(data.decode()).encode()
        elif path.suffix == ".toml":
            data = toml(data.decode()).encode()
        total.update(f"{path.relative_to(root)}\n{len(data)}\n".encode())
        total.update(data)
    return total.hexdigest() if found else None


def of(root, rooms):
    """Digest of several rooms; the names of those that are not there are an error."""
    each = [of_room(str(root), room) for room in rooms]
    missing = [room for room, one in zip(rooms, each) if one is None]
    if missing:
        raise FileNotFoundError(", ".join(missing))
    return hashlib.sha256("\n".join(each).encode()).hexdigest()[:DIGITS]
