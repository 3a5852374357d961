#!/usr/bin/env python3
"""Licences of the crates that are compiled into the program: LICENSE-THIRD-PARTY.txt, which every package carries.

usage: packaging/licences.py            writes the file
       packaging/licences.py --check    compares the file with the crates of Cargo.lock
exit:  0 the file is as it must be; 1 it is not, or deny.toml does not allow the licence of a crate.
"""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "LICENSE-THIRD-PARTY.txt"
# What is built for; crates of other systems are not in the packages.
TARGET = "x86_64-unknown-linux-gnu"
NAMES = re.compile(r"(licen[cs]e|copying|notice|unlicense)([-._].*)?", re.IGNORECASE)
HEAD = """\
Licences of the crates that are compiled into gnss-twin. Written by packaging/licences.py from Cargo.lock.
Where a crate offers the MIT licence among others, that one is chosen.
The source of each crate is in the registry of Rust packages, under its name and version.
"""


def compiled() -> list[dict]:
    """Foreign packages that the program and the Python module are linked from, in the order of their names."""
    tree = ["cargo", "tree", "--locked", "--package", "gnss-twin", "--package", "gnss-twin-python", "--edges", "normal",
            "--target", TARGET, "--prefix", "none", "--format", "{p}"]
    metadata = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", TARGET]
    printed, described = (
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout for command in (tree, metadata)
    )
    linked = {tuple(line.split()[:2]) for line in printed.splitlines() if line}
    foreign = (package for package in json.loads(described)["packages"] if package["source"])
    found = (package for package in foreign if (package["name"], f"v{package['version']}") in linked)
    return sorted(found, key=lambda package: (package["name"], package["version"]))


def texts(package: dict) -> list[str]:
    """Licence files of a package: that of the MIT licence where it is one of several to choose from."""
    folder = Path(package["manifest_path"]).parent
    files = sorted(path for path in folder.iterdir() if path.is_file() and NAMES.fullmatch(path.name))
    mit = [path for path in files if "mit" in path.name.lower()]
    read = (path.read_text(encoding="utf-8", errors="replace") for path in mit or files)
    return ["\n".join(line.rstrip() for line in text.strip().splitlines()) for text in read]


def document(packages: list[dict]) -> str:
    """List of packages, and each text once, whatever its line breaks, below the names of those that carry it."""
    carriers: dict[str, tuple[str, list[str]]] = {}
    lines = [HEAD]
    for package in packages:
        name = f"{package['name']} {package['version']}"
        own = texts(package)
        lines.append(f"{name}: {package['license'] or 'see its text below'}" + ("" if own else "; the package has no text of it"))
        for text in own:
            carriers.setdefault(" ".join(text.split()), (text, []))[1].append(name)
    for text, names in carriers.values():
        lines += ["", "-" * 80, ", ".join(dict.fromkeys(names)), "-" * 80, "", text]
    return "\n".join(lines) + "\n"


def is_allowed(expression: str, allowed: list[str]) -> bool:
    """True if an SPDX expression can be met by allowed licences; a slash is an old form of OR."""
    words = re.findall(r"[()]|OR|AND|[^\s()]+(?: WITH [^\s()]+)?", expression.replace("/", " OR "))
    python = {"OR": "or", "AND": "and", "(": "(", ")": ")"}
    return bool(eval(" ".join(python.get(word) or str(word in allowed) for word in words)))


def main() -> int:
    packages = compiled()
    allowed = tomllib.loads((ROOT / "deny.toml").read_text(encoding="utf-8"))["licenses"]["allow"]
    refused = [package for package in packages if not is_allowed(package["license"] or "none", allowed)]
    for package in refused:
        print(f"{package['name']} {package['version']}: deny.toml does not allow {package['license']}", file=sys.stderr)
    if refused:
        return 1
    made = document(packages)
    if "--check" not in sys.argv[1:]:
        FILE.write_text(made, encoding="utf-8")
        print(f"{FILE}: {len(made)} characters")
        return 0
    if FILE.exists() and FILE.read_text(encoding="utf-8") == made:
        return 0
    print(f"{FILE.name} is not that of Cargo.lock: run packaging/licences.py", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
