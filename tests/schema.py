#!/usr/bin/env python3
"""Validates the shipped scenes, studies and limits by the JSON schemas that their first lines name, with another
program's validator, and damaged ones, which must fail.

    python3 tests/schema.py [DIR]    # the repository, or a directory of copies; needs python3-jsonschema
"""

import copy
import datetime
import json
import pathlib
import sys
import tomllib

import jsonschema


def plain(value):
    """TOML's times as texts."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [plain(one) for one in value]
    return value.isoformat() if isinstance(value, (datetime.datetime, datetime.date, datetime.time)) else value


def load(path):
    text = path.read_text()
    directive, _, schema = text.splitlines()[0].partition(" ")
    assert directive == "#:schema", f"{path}: the first line names no schema"
    schema = json.loads((path.parent / schema).read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema), plain(tomllib.loads(text))


def refused(validator, document, path, value):
    """Whether a document with one value at a path, or without any where it is None, is refused."""
    damaged = copy.deepcopy(document)
    *above, last = path
    table = damaged
    for key in above:
        table = table[key]
    if value is None:
        del table[last]
    else:
        table[last] = value
    return not validator.is_valid(damaged)


root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent)
below = ["scenarios", "studies"] if (root / "scenarios").is_dir() else ["."]
files = sorted(path for part in below for path in (root / part).rglob("*.toml"))
assert files, f"{root}: no files"
for path in files:
    validator, document = load(path)
    errors = [f"{'.'.join(map(str, error.absolute_path))}: {error.message}" for error in validator.iter_errors(document)]
    assert not errors, f"{path}: {errors[:3]}"

if below != ["."]:
    validator, static = load(root / "scenarios/static.toml")
    for path, value in [
        (["sed"], 1),
        (["name"], None),
        (["seed"], -1),
        (["duration_s"], "60"),
        (["motion", "kind"], "statc"),
        (["motion", "latitude_deg"], 91),
        (["motion", "latitude_deg"], None),
        (["motion", "file"], "ride.csv"),
        (["front_end", "format"], 8),
        (["ionosphere"], {"model": "ionex"}),
        (["receiver", "positon"], {}),
        (["receiver", "position", "require_ionosphere"], 1),
    ]:
        assert refused(validator, static, path, value), f"static.toml with {'.'.join(path)} = {value} is accepted"
    validator, limits = load(root / "scenarios/limits.toml")
    for path, value in [
        (["position.horizontal_p96_m"], {"max": 1}),
        (["position.horizontal_p95_m"], {"most": 1}),
        (["satellites", "usd"], {"min": 8}),
    ]:
        assert refused(validator, limits, path, value), f"limits.toml with {path} = {value} is accepted"
print(f"{len(files)} files fit their schemas, and damaged ones do not")
