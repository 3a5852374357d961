#!/usr/bin/env python3
"""The Python module against the command line: the same work in turn, by the clock and in processor time of all threads.

usage: python benches/python.py GNSS_TWIN_BINARY [ROUNDS]     (default: 5 rounds; the module is that of this Python)

Both are to be release builds. Of the module that is timed which a program does after its imports and the opening of the scene; of
the command line the whole process. Each makes, receives and judges `scenarios/static.toml`: the command line by files, the module in
memory and, where the last row says so, by files too.
"""

import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENE = str(ROOT / "scenarios/static.toml")
BEGIN = "import resource, sys, time\nimport gnss_twin\nscene = gnss_twin.Scene.open(sys.argv[1])\n"
MEASURE = """
def spent():
    own = resource.getrusage(resource.RUSAGE_SELF)
    return own.ru_utime + own.ru_stime, time.perf_counter()
begun = spent()
WORK
print(*(after - before for before, after in zip(begun, spent())))
"""
# What both do: a name, arguments of the command line, and the lines of Python.
WORK = [
    (
        "make the samples of a minute",
        ["generate", SCENE, "--out", "{room}/made.sigmf-data"],
        "count = sum(len(batch.samples) for batch in gnss_twin.Generator(scene))\nassert count == 156_000_000",
    ),
    (
        "receive them",
        ["receive", "{room}/kept.sigmf-data", "--out", "{room}/rx"],
        "metadata, samples = gnss_twin.open_recording(sys.argv[2] + '/kept.sigmf-data')\n"
        "assert len(gnss_twin.receive(samples, metadata).tables['fixes']['sample']) > 300",
    ),
    (
        "both in one run, its tables and the verdict in files",
        ["run", SCENE, "--out", "{room}/run"],
        "run = gnss_twin.run(scene, out=sys.argv[2] + '/run')",
    ),
]


def main() -> None:
    twin = str(pathlib.Path(sys.argv[1]).resolve())
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    with tempfile.TemporaryDirectory() as room:
        subprocess.run([twin, "generate", SCENE, "--out", f"{room}/kept.sigmf-data"], check=True, capture_output=True)
        print("|work|measured|Python (s)|command line (s)|Python over command line|each round|\n|---|---|---|---|---|---|")
        for name, arguments, work in WORK:
            arguments = [argument.replace("{room}", room) for argument in arguments]
            times = [(by_python(work, room), by_command([twin, *arguments], room)) for _ in range(rounds)]
            for index, kind in enumerate(["processor", "clock"]):
                pairs = [(python[index], command[index]) for python, command in times]
                ratios = sorted(python / command for python, command in pairs)
                python, command = (statistics.median(one) for one in zip(*pairs))
                row = [name, kind, f"{python:.2f}", f"{command:.2f}", f"{python / command:.3f}", f"{ratios[0]:.3f} to {ratios[-1]:.3f}"]
                print(f"|{'|'.join(row)}|", flush=True)


def by_python(work: str, room: str) -> list[float]:
    program = BEGIN + MEASURE.replace("WORK", work)
    done = subprocess.run([sys.executable, "-c", program, SCENE, room], check=True, capture_output=True, text=True)
    clear(room)
    return [float(field) for field in done.stdout.split()[-2:]]


def by_command(command: list[str], room: str) -> list[float]:
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    after, ended = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    clear(room)
    return [after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, ended - begun]


def clear(room: str) -> None:
    subprocess.run(f"cd '{room}' && rm -rf made* rx run", shell=True, check=True)


if __name__ == "__main__":
    main()
