#!/usr/bin/env python3
"""The recipes of `book/src/extending.md`, each followed by a patch in `tests/recipes`.

usage: tests/recipes.py --check           compares every patch with the tree and with the text of its recipe; compiles nothing
       tests/recipes.py --follow [NAME…]  applies each patch to a copy of the tree in target/recipes, and runs its commands there
       tests/recipes.py --write NAME      writes the changes of the working tree into tests/recipes/NAME.patch; its opening lines stay
       tests/recipes.py --self-test       plants faults in a small repository; each must be found
       CARGO_TARGET_DIR names the directory of the copy's builds [default: target/recipes/target].
exit:  0 all as it must be; 1 not, each finding with its file and its cure; 2 a wrong command line.

A patch begins with lines of its own, which `git apply` skips:
    What: the extension in one sentence.
    Left out: PATH: the reason for which this extension does not touch a file of the recipe's steps.
    Run: a command that must succeed with the patch.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CHAPTER = "book/src/extending.md"
PATCHES = "tests/recipes"
# Steps that change the program; a recipe of one list has no such line.
STEPS = "In the program itself:"
ROOTS = "src|tests|benches|examples|scenarios|studies|assets|python|book|packaging"
PATH = re.compile(rf"(?:{ROOTS})/[\w./<>-]*[\w/>]|[A-Z]+\.md")
# Files that the program prints, by the command that prints them.
GENERATED = {
    "REFERENCE.md": "reference",
    **{f"assets/{name}.schema.json": f"schema {name}" for name in ("scenario", "receiver", "study", "limits")},
}


# Characters of a line that two generated files have by chance.
SHORT = 40


class Recipe:
    """A section of the chapter: its paths, those of its steps, and the commands of its steps."""

    def __init__(self, name, line, text):
        self.name, self.line, self.text = name, line, text
        program = text.split(STEPS, 1)[-1]
        program = re.split(r"(?m)^In .*:$", program)[0]
        # A step with the indented lines that continue it.
        steps = "\n".join(re.findall(r"(?m)^\d+\. .*(?:\n {2,}\S.*)*", program))
        spans = [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", steps)]
        self.steps = [span for span in spans if PATH.fullmatch(span)]
        self.commands = [span for span in spans if span.startswith("cargo ")]
        self.paths = [span for span in re.findall(r"`([^`\n]+)`", text) if PATH.fullmatch(span)]


def slug(title):
    """Name of a recipe's patch: its title without the article."""
    return re.sub(r"^an? ", "", title.lower()).replace(" ", "_")


def recipes(root):
    """The chapter's opening and its recipes."""
    text = (root / CHAPTER).read_text()
    opening, *sections = re.split(r"(?m)^(?=## \d+\. )", text)
    found, line = [], opening.count("\n") + 1
    for section in sections:
        title = re.match(r"## \d+\. (.*)", section)[1]
        found.append(Recipe(slug(title), line, section))
        line += section.count("\n")
    return opening, found


class Patch:
    """A patch with its opening lines, and the files that it touches."""

    def __init__(self, path):
        self.path = path
        text = path.read_text()
        self.header, _, rest = text.partition("diff --git ")
        body = "diff --git " + rest
        self.files = re.findall(r"(?m)^diff --git a/(\S+) b/\S+$", body)
        self.added = len(re.findall(r"(?m)^\+(?!\+\+ )", body))
        self.removed = len(re.findall(r"(?m)^-(?!-- )", body))
        self.left_out = dict(re.findall(r"(?m)^Left out: (.+?): (.+)$", self.header))
        self.commands = re.findall(r"(?m)^Run: (.+)$", self.header)
        self.made = re.findall(r"(?m)^diff --git a/(\S+) b/\S+\nnew file", body)
        parts = zip(self.files, re.split(r"(?m)^diff --git .*\n", body)[1:])
        self.taken = {path: [line.strip() for line in re.findall(r"(?m)^-(?!-- )(.*)", part)] for path, part in parts}


def is_of(named, path, made):
    """True if `path` is the named file, a new one that a placeholder stands for, or one directly in the named directory."""
    if "<" in named.rsplit("/", 1)[-1] and path not in made:
        return False
    pattern = "".join(r"\w+" if part.startswith("<") else re.escape(part) for part in re.split(r"(<\w+>)", named.rstrip("/")))
    return re.fullmatch(pattern if re.search(r"\.\w+$", named) else rf"{pattern}/[^/]+", path) is not None


def missing(root, recipe, made):
    """Findings about paths that are neither in the tree nor made by the recipe's patch."""
    for name in dict.fromkeys(recipe.paths):
        if "<" not in name and not (root / name).exists() and name not in made:
            yield f"{CHAPTER}:{recipe.line}: {recipe.name}: no file {name} in the tree, and no patch makes it: name the file as it is called now"


def check_one(root, opening, recipe, patch):
    """Findings about one recipe and its patch."""
    where, file = f"{CHAPTER}:{recipe.line}: {recipe.name}", patch.path.relative_to(root)
    yield from missing(root, recipe, patch.made)
    shared = [name for name in re.findall(r"`([^`\n]+)`", opening) if PATH.fullmatch(name) and not name.startswith(("src", "book"))]
    for path in patch.files:
        if not any(is_of(name, path, patch.made) for name in [*recipe.steps, *shared]):
            yield f"{where}: {file} touches {path}, which no step of the recipe names: add it to its step"
    for name in dict.fromkeys(recipe.steps):
        touched = any(is_of(name, path, patch.made) for path in patch.files)
        if not touched and name not in patch.left_out:
            yield f"{file}: does not touch {name}, which a step of {recipe.name} names: follow it, or say `Left out: {name}: REASON`"
        if touched and name in patch.left_out:
            yield f"{file}: touches {name} and says that it is left out: remove the line"
    for name in patch.left_out.keys() - set(recipe.steps) - set(recipe.commands):
        yield f"{file}: leaves out {name}, which no step of {recipe.name} names: remove the line"
    for command in recipe.commands:
        if not any(command in run for run in patch.commands) and command not in patch.left_out:
            yield f"{file}: does not run `{command}`, which a step of {recipe.name} names: add `Run: {command}`"
    for name in GENERATED.keys() - set(patch.files):
        lines = {line.strip() for line in (root / name).read_text().splitlines()} if (root / name).exists() else set()
        for other in GENERATED.keys() & set(patch.files):
            shared = next((line for line in patch.taken[other] if len(line) > SHORT and line in lines), None)
            if shared:
                yield f"{file}: changes a line of {other} that {name} has too ({shared[:60]}…): write {name} as the patched program prints it"
    if not re.search(r"(?m)^What: .+$", patch.header) or not patch.commands:
        yield f"{file}: expected lines `What:` and `Run:` before its first file"
    apply = subprocess.run(["git", "apply", "--check", str(patch.path)], cwd=root, capture_output=True, text=True, env=bare(root))
    if apply.returncode:
        cure = f"git apply --3way {file}, mend it, tests/recipes.py --write {recipe.name}"
        yield f"{file}: does not apply to this tree ({apply.stderr.strip().splitlines()[0]}): {cure}"


def bare(root):
    """Environment in which git takes `root` for a plain directory unless it is a repository itself."""
    return {**os.environ, "GIT_CEILING_DIRECTORIES": str(root.parent)}


def check(root):
    """Findings about all recipes, and the lines of a table."""
    opening, all_recipes = recipes(root)
    found, table = [], []
    for recipe in all_recipes:
        path = root / PATCHES / f"{recipe.name}.patch"
        if not path.exists():
            found.append(f"{CHAPTER}:{recipe.line}: {recipe.name}: no patch {PATCHES}/{recipe.name}.patch follows it: make one")
            found += missing(root, recipe, [])
            table.append(f"{recipe.name:15} no patch")
            continue
        patch = Patch(path)
        found += check_one(root, opening, recipe, patch)
        table.append(f"{recipe.name:15} {len(patch.files):5} {patch.added:+6} {-patch.removed:+6}")
    known = {recipe.name for recipe in all_recipes}
    for path in sorted((root / PATCHES).glob("*.patch")):
        if path.stem not in known:
            found.append(f"{path.relative_to(root)}: follows no recipe of {CHAPTER}: name it as its heading, or remove it")
    return found, table, all_recipes


def report_check(root):
    found, table, all_recipes = check(root)
    print(f"{'recipe':15} {'files':>5} {'lines':>6}")
    print("\n".join(table))
    print("\n".join(found), end="\n" if found else "")
    followed = len(all_recipes) - len([line for line in table if "no patch" in line])
    print(f"recipes: {followed} of {len(all_recipes)} have a patch; {len(found)} findings")
    return bool(found)


def tracked():
    """Files of the present tree, committed or not."""
    listed = subprocess.run(["git", "ls-files", "-z", "-c", "-o", "--exclude-standard"], cwd=ROOT, capture_output=True, check=True)
    return [name for name in listed.stdout.decode().split("\0") if name and (ROOT / name).is_file()]


def copy_tree(tree):
    """Makes `tree` equal to the present tree. A file keeps its time where it is the same, so that nothing is built twice."""
    names = set(tracked())
    for path in [path for path in tree.rglob("*") if path.is_file() and str(path.relative_to(tree)) not in names]:
        path.unlink()
    for name in names:
        here, there = ROOT / name, tree / name
        if not there.exists() or there.read_bytes() != here.read_bytes():
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(here, there)


def follow(names):
    """Applies each patch alone to a copy of the tree and runs its commands; true if one fails."""
    work = ROOT / "target/recipes"
    tree = work / "tree"
    tree.mkdir(parents=True, exist_ok=True)
    build = Path(os.environ.get("CARGO_TARGET_DIR", work / "target")).resolve()
    data = os.environ.get("GNSS_TWIN_DATA", str(ROOT.parent / "shared/data"))
    environment = {**bare(tree), "CARGO_TARGET_DIR": str(build), "GNSS_TWIN_DATA": data, "RUST_BACKTRACE": "0"}
    house = f"CARGO_MANIFEST_DIR=$PWD rustc --edition 2024 --test tests/house.rs -o '{work}/house' && '{work}/house' --quiet"
    failed, lines = False, []
    for recipe in recipes(ROOT)[1]:
        path = ROOT / PATCHES / f"{recipe.name}.patch"
        if names and recipe.name not in names:
            continue
        if not path.exists():
            lines.append(f"{recipe.name:15} no patch")
            failed = True
            continue
        copy_tree(tree)
        begun = time.monotonic()
        generated = [
            f"'{build}/debug/gnss-twin' {command} | diff - {name} || {{ echo '{name} is not what the program prints'; exit 1; }}"
            for name, command in GENERATED.items()
        ]
        steps = [f"git apply '{path}'", "cargo fmt --all --check", house, "cargo build", *generated, *Patch(path).commands]
        wrong = None
        for step in steps:
            print(f"{recipe.name}: {step}", flush=True)
            done = subprocess.run(["bash", "-o", "pipefail", "-c", step], cwd=tree, env=environment, capture_output=True, text=True)
            # A filter that no test matches passes too.
            is_idle = "cargo test" in step and not any(int(count) for count in re.findall(r"(\d+) passed", done.stdout))
            if done.returncode or is_idle:
                wrong = f"{step} ran no test" if is_idle and not done.returncode else step
                print((done.stdout + done.stderr)[-6000:])
                break
        failed |= wrong is not None
        seconds = time.monotonic() - begun
        lines.append(f"{recipe.name:15} {seconds:6.0f} s  {'pass' if wrong is None else f'FAIL: {wrong}'}")
    copy_tree(tree)
    print("\n".join(lines))
    return failed


def write(name):
    """Writes the changes of the working tree into a patch, below the opening lines that it has."""
    path = ROOT / PATCHES / f"{name}.patch"
    header = Patch(path).header if path.exists() else "What: \nRun: \n\n"
    apart = [f":(exclude){PATCHES}", f":(exclude){CHAPTER}"]
    subprocess.run(["git", "add", "--intent-to-add", "--all", "."], cwd=ROOT, check=True)
    diff = subprocess.run(["git", "diff", "--no-color", "HEAD", "--", ".", *apart], cwd=ROOT, capture_output=True, text=True, check=True)
    path.write_text(header + diff.stdout)
    print(f"{path.relative_to(ROOT)}: {len(Patch(path).files)} files")
    return False


SMALL = """# Extending

- New keys change `REFERENCE.md`.

## 1. An effect

In a program of your own:

1. `examples/own.rs` has one.

In the program itself:

1. `src/<effect>.rs`, and its line in `src/list.rs`.
2. `cargo test --lib`.
"""
GOOD = """What: leaves.
Run: cargo test --lib

diff --git a/src/leaves.rs b/src/leaves.rs
new file mode 100644
--- /dev/null
+++ b/src/leaves.rs
@@ -0,0 +1 @@
+leaves
diff --git a/src/list.rs b/src/list.rs
--- a/src/list.rs
+++ b/src/list.rs
@@ -1 +1,2 @@
 air
+leaves
diff --git a/REFERENCE.md b/REFERENCE.md
--- a/REFERENCE.md
+++ b/REFERENCE.md
@@ -1 +1 @@
-| `effect` | `air` or `water` | The effect of a ray. |
+| `effect` | one of `air`, `water`, `leaves` | The effect of a ray. |
"""
REFERENCE = "| `effect` | `air` or `water` | The effect of a ray. |\n"
SCHEMA = "assets/scenario.schema.json"
# Faults by what is changed: the file, its text, what takes its place, and words of the finding.
PLANTED = [
    ("a path that does not exist", CHAPTER, "examples/own.rs", "examples/owned.rs", "no file examples/owned.rs"),
    ("a step that lacks a file", CHAPTER, ", and its line in `src/list.rs`", "", "touches src/list.rs, which no step"),
    ("a step that the patch does not follow", CHAPTER, "`src/list.rs`", "`src/list.rs` and `src/other.rs`", "does not touch src/other.rs"),
    ("a command that nothing runs", CHAPTER, "cargo test --lib", "cargo test --all", "does not run `cargo test --all`"),
    ("a tree that has moved on", "src/list.rs", "air", "water", "does not apply"),
    ("a patch that leaves out nothing of the recipe", f"{PATCHES}/effect.patch", "Run:", "Left out: src/z.rs: no\nRun:", "leaves out src/z.rs"),
    ("a patch that runs nothing", f"{PATCHES}/effect.patch", "Run:", "Ran:", "expected lines `What:` and `Run:`"),
    ("a recipe without a patch", CHAPTER, "2. `cargo test --lib`.\n", "2. `cargo test --lib`.\n\n## 2. A system\n\n1. Nothing.\n", "no patch tests/recipes/system.patch"),
    ("a generated file that the patch leaves as it was", SCHEMA, "{}", f"{{\n  {REFERENCE}}}", f"{SCHEMA} has too"),
    ("a patch without a recipe", CHAPTER, "An effect", "An echo", "effect.patch: follows no recipe"),
]


def self_test():
    wrong = []
    for what, changed, old, new, expected in [("no fault", CHAPTER, "", "", None), *PLANTED]:
        with tempfile.TemporaryDirectory() as directory:
            root = Path(directory).resolve()
            files = {CHAPTER: SMALL, f"{PATCHES}/effect.patch": GOOD, "src/list.rs": "air\n", "src/other.rs": "", "examples/own.rs": "", SCHEMA: "{}"}
            files[changed] = files[changed].replace(old, new, 1) if old else files[changed]
            for name, text in {**files, "REFERENCE.md": REFERENCE}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            found = check(root)[0]
        is_right = not found if expected is None else any(expected in text for text in found)
        if not is_right:
            wrong.append(f"{what}: expected {expected!r}, found {found}")
    print("\n".join(wrong), end="\n" if wrong else "")
    print(f"recipes: {len(PLANTED)} planted faults, {len(wrong)} not found")
    return bool(wrong)


def main(arguments):
    match arguments:
        case ["--check"]:
            return report_check(ROOT)
        case ["--follow", *names]:
            unknown = set(names) - {recipe.name for recipe in recipes(ROOT)[1]}
            if not unknown:
                return follow(names)
            print(f"no recipe {', '.join(sorted(unknown))} in {CHAPTER}", file=sys.stderr)
            return 2
        case ["--write", name]:
            return write(name)
        case ["--self-test"]:
            return self_test()
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
