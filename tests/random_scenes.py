#!/usr/bin/env python3
"""Draws random sound scenes of all systems, runs each with `gnss-twin run --check`, and lists the failed ones.

    python3 tests/random_scenes.py target/release/gnss-twin --seed 1 --count 100 --out /tmp/scenes
    python3 tests/random_scenes.py target/release/gnss-twin --seed 1 --only 17 --out /tmp/scenes

A scene is sound where the receiver is set for what the scene has: the verdict must hold, and a failed row is a fault
of the judge, of the receiver or of the generator. Scene K of a seed depends on the seed and on K alone.
The directory keeps every scene, its verdict and what it printed, and the results of those that failed.
"""

import argparse
import concurrent.futures
import datetime
import math
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import time

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent

# Signal: carrier in Hz, sampling rates in Msps that hold its main lobes and are not commensurate with its chips.
SIGNALS = {
    "GPS L1 C/A": (1575.42e6, (2.6, 3.1, 4.3)),
    "GPS L1C": (1575.42e6, (5.2, 6.5)),
    "GPS L2C": (1227.60e6, (2.6, 3.1)),
    "GPS L5": (1176.45e6, (21.3,)),
    "Galileo E1": (1575.42e6, (5.2, 6.5)),
    "Galileo E5a": (1176.45e6, (21.3,)),
    "Galileo E5b": (1207.14e6, (21.3,)),
    "Galileo E5": (1191.795e6, (65.0,)),
    "Galileo E6": (1278.75e6, (10.7, 11.9)),
    "GLONASS G1": (1602e6, (9.0, 9.7)),
    "GLONASS G2": (1246e6, (7.2, 8.3)),
    "BeiDou B1I": (1561.098e6, (4.3, 5.3)),
    "BeiDou B2I": (1207.14e6, (4.3, 5.3)),
    "BeiDou B3I": (1268.52e6, (21.3,)),
    "BeiDou B1C": (1575.42e6, (5.2, 6.5)),
    "BeiDou B2a": (1176.45e6, (21.3,)),
    "BeiDou B2b": (1207.14e6, (21.3,)),
    "NavIC L5": (1176.45e6, (2.6, 3.1)),
    "NavIC S": (2492.028e6, (2.6, 3.1)),
    "NavIC L1": (1575.42e6, (5.2, 6.5)),
    "QZSS L1 C/A": (1575.42e6, (2.6, 3.1)),
    "QZSS L1C": (1575.42e6, (5.2, 6.5)),
    "QZSS L2C": (1227.60e6, (2.6, 3.1)),
    "QZSS L5": (1176.45e6, (21.3,)),
    "SBAS L1": (1575.42e6, (2.6, 3.1)),
}
# Blind searches for codes of 10 and 20 ms are long: later ones only for satellites that are foreseen.
LONG_CODES = ("L1C", "L2C", "B1C", "NavIC L1")


class Sky:
    """What a navigation file has: the times and places at which satellites are in view, and what is broadcast."""

    def __init__(self, name, file, first, last, latitude, longitude, models, groups):
        self.name, self.file, self.first, self.last = name, file, first, last
        self.latitude, self.longitude, self.models, self.groups = latitude, longitude, models, groups


def alone(system, *names):
    """Groups of one signal each."""
    return [[f"{system} {name}"] for name in names]


# Models of the ionosphere are those whose coefficients the file has, by the letter of the system that sends them.
SKIES = [
    Sky("gps_2010", None, "2010-07-01T00:30:00", "2010-07-01T22:00:00", (-75, 75), (-180, 180), {"G": "klobuchar"},
        alone("GPS", "L1 C/A")),
    Sky("day_2020", None, "2020-11-29T11:35:00", "2020-11-29T13:20:00", (25, 55), (-25, 25), {"E": "nequick_g"},
        alone("Galileo", "E1", "E5a", "E5b", "E5") + alone("GLONASS", "G1", "G2")
        + alone("BeiDou", "B1I", "B2I", "B3I", "B1C", "B2a", "B2b")
        + [["Galileo E1", "Galileo E5a"], ["Galileo E1", "Galileo E5b"], ["Galileo E1", "Galileo E6"],
           ["GLONASS G1", "GLONASS G2"], ["BeiDou B1I", "BeiDou B2I"], ["BeiDou B1I", "BeiDou B1C"],
           ["GPS L1 C/A", "Galileo E1"], ["GPS L1 C/A", "GLONASS G1"], ["GPS L1 C/A", "BeiDou B1I"],
           ["GPS L1 C/A", "GPS L2C"], ["BeiDou B1C", "BeiDou B2a"],
           ["GPS L1 C/A", "Galileo E1", "BeiDou B1C"], ["GPS L1 C/A", "GLONASS G1", "Galileo E1"]]),
    Sky("japan_2025", "gps_2025-08-21_06h_08h.rnx", "2025-08-21T06:10:00", "2025-08-21T07:50:00", (15, 55),
        (110, 165), {"G": "klobuchar"},
        alone("GPS", "L1 C/A", "L2C", "L5") + [["GPS L1 C/A", "GPS L2C"], ["GPS L1 C/A", "GPS L5"]]),
    Sky("block_3_2026", "gps_2026-03-09_10h_12h.rnx", "2026-03-09T09:40:00", "2026-03-09T11:40:00", (-10, 35),
        (20, 65), {"G": "klobuchar"},
        alone("GPS", "L1C", "L2C", "L5", "L1 C/A") + [["GPS L1 C/A", "GPS L1C"], ["GPS L1C", "GPS L2C"]]),
    Sky("waas_2026", "gps_waas_2026-03-09_11h.rnx", "2026-03-09T10:30:00", "2026-03-09T11:20:00", (25, 60),
        (-125, -85), {}, alone("GPS", "L1 C/A") + 2 * [["GPS L1 C/A", "SBAS L1"]]),
    Sky("navic_2026", "navic_2026-03-09_10h_12h.rnx", "2026-03-09T10:05:00", "2026-03-09T11:50:00", (-15, 40),
        (55, 105), {"I": "klobuchar"},
        alone("NavIC", "L5", "S", "L1") + [["NavIC L5", "NavIC S"], ["NavIC L5", "NavIC L1"]]),
    Sky("qzss_2023", "qzss_2023-03-12_02h_04h.rnx", "2023-03-12T01:40:00", "2023-03-12T03:50:00", (-20, 40),
        (115, 160), {},
        alone("QZSS", "L1 C/A", "L1C", "L2C", "L5") + [["QZSS L1 C/A", "QZSS L2C"], ["QZSS L1 C/A", "QZSS L1C"]]),
    Sky("bangkok_2026", "full_sky_2026-03-09_10h_12h.rnx", "2026-03-09T10:20:00", "2026-03-09T11:30:00", (0, 30),
        (85, 120), {"G": "klobuchar"},
        alone("GPS", "L1 C/A") + alone("Galileo", "E1", "E5a") + alone("BeiDou", "B1I", "B1C", "B2a", "B3I")
        + alone("NavIC", "L5") + [["GPS L1 C/A", "QZSS L1 C/A"], ["GPS L1 C/A", "Galileo E1"],
                                  ["GPS L1 C/A", "BeiDou B1I"], ["NavIC L5", "NavIC S"], ["Galileo E1", "BeiDou B1C"],
                                  ["GPS L1 C/A", "Galileo E1", "QZSS L1 C/A"], ["BeiDou B1I", "BeiDou B3I"]]),
]
# Every group of signals is as likely as any other, but for wide ones.
GROUPS = [(sky, group) for sky in SKIES for group in sky.groups]


def width_msps(group):
    """Narrowest sampling rates of a group's bands, together."""
    bands = {}
    for signal in group:
        carrier, rates = SIGNALS[signal]
        bands[carrier] = max(bands.get(carrier, 0), rates[0])
    return sum(bands.values())


def scene(seed, number, samples_max):
    """The text of a scene, its sky and its signals."""
    draw = random.Random(f"{seed} {number}")
    # The cost of a scene grows with its rate: those of 20 Msps and more are drawn a third as often, E5 a tenth.
    weights = [1 if width_msps(group) < 20 else 1 / 3 if width_msps(group) < 60 else 0.1 for _, group in GROUPS]
    sky, signals = draw.choices(GROUPS, weights)[0]
    first, last = (datetime.datetime.fromisoformat(text) for text in (sky.first, sky.last))
    start = first + datetime.timedelta(seconds=draw.randrange(int((last - first).total_seconds())))
    longest = min(150, max(50, samples_max / (1e6 * width_msps(signals))))
    out = [
        f'name = "random_{seed}_{number}"',
        f"start = {start.isoformat()}",
        f"duration_s = {draw.randint(45, int(longest))}",
        f"seed = {draw.randrange(1, 10**6)}",
        f"signals = {quoted(signals)}",
        "[navigation]",
    ]
    if sky.file:
        out.append(f'file = "{sky.file}"')
    if sky.name == "day_2020" and draw.random() < 0.5:
        out.append(f"galileo_ahead_ns = {draw.uniform(-50, 50):.1f}")
    out += motion(draw, sky)
    out += ["[satellites]", f"mask_deg = {draw.uniform(3, 15):.1f}"]
    power = draw.random()
    out += ["[power]", f"cn0_dbhz = {draw.uniform(35, 50):.1f}" if power < 0.6 else 'kind = "link_budget"']
    out += clock(draw)
    out += ["[noise]"]
    air, settings = atmosphere(draw, sky, signals)
    out += air
    out += front_ends(draw, signals)
    out += settings
    if any(word in signal for signal in signals for word in LONG_CODES):
        out += ["[receiver.operation]", "search_interval_s = 100"]
    return "\n".join(out) + "\n", sky, signals


def quoted(names):
    """A TOML array of texts."""
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def motion(draw, sky):
    """At rest, or a route of three or four points at the speed of a walk to that of a car."""
    latitude, longitude = draw.uniform(*sky.latitude), draw.uniform(*sky.longitude)
    height = draw.uniform(0, 1500)
    if draw.random() < 0.6:
        return ["[motion]", 'kind = "static"', f"latitude_deg = {latitude:.5f}", f"longitude_deg = {longitude:.5f}",
                f"height_m = {height:.1f}"]
    out = ["[motion]", 'kind = "waypoints"', f"acceleration_mps2 = {draw.uniform(1.5, 3):.2f}"]
    # Turns of at most two radians, which a route takes without a stop.
    speed, points, heading = draw.uniform(1, 20), draw.randint(3, 4), draw.uniform(-math.pi, math.pi)
    for point in range(points):
        rests = point in (0, points - 1)
        out += ["[[motion.point]]", f"latitude_deg = {latitude:.6f}", f"longitude_deg = {longitude:.6f}",
                f"height_m = {height:.1f}", f"speed_mps = {0 if rests else round(speed, 1)}"]
        if point == 0:
            out.append(f"hold_s = {draw.randint(0, 40)}")
        # A hundredth of a degree is a kilometre: long enough to turn and to stop.
        step_deg, heading = draw.uniform(0.009, 0.02), heading + draw.uniform(-2, 2)
        latitude += step_deg * math.cos(heading)
        longitude += step_deg * math.sin(heading) / math.cos(math.radians(latitude))
        height += draw.uniform(-5, 5)
    return out


def clock(draw):
    """No clock error, a bias and a drift, or an oscillator's noise besides."""
    kind = draw.random()
    if kind < 0.15:
        return []
    out = ["[receiver_clock]", f"bias_s = {draw.uniform(-5e-4, 5e-4):.3e}",
           f"drift_sps = {draw.uniform(-3e-7, 3e-7):.2e}"]
    if kind > 0.7:
        out.append(f'oscillator = "{draw.choice(("tcxo", "ocxo1", "ocxo2", "rubidium1", "cesium1"))}"')
    return out


def atmosphere(draw, sky, signals):
    """Troposphere and ionosphere, and settings of the receiver that suit them."""
    out, settings = [], ["[receiver.position]"]
    if draw.random() < 0.75:
        out += ["[troposphere]", 'model = "saastamoinen"']
    else:
        settings.append('troposphere = "none"')
    letters = {"GPS": "G", "Galileo": "E", "NavIC": "I", "BeiDou": "C", "GLONASS": "R", "QZSS": "J", "SBAS": "S"}
    model = {sky.models.get(letters[signal.split()[0]]) for signal in signals} - {None}
    if not model or draw.random() < 0.4:
        return out, settings + ['ionosphere = "none"']
    # By its default the receiver takes Klobuchar's model first: NeQuick-G has to be named where both are sent.
    chosen = draw.choice(sorted(model))
    bands = {SIGNALS[signal][0] for signal in signals}
    settings.append(f'ionosphere = "{chosen if len(bands) == 1 or draw.random() < 0.3 else "combined"}"')
    settings.append("require_ionosphere = true")
    return out + ["[ionosphere]", f'model = "{chosen}"'], settings


def front_ends(draw, signals):
    """A front end for each carrier of the signals."""
    bands = {}
    for signal in signals:
        carrier, rates = SIGNALS[signal]
        bands[carrier] = max(bands.get(carrier, 0), draw.choice(rates))
    out = []
    for place, (carrier, rate) in enumerate(bands.items()):
        table = "front_end" if len(bands) == 1 else "[front_end]"
        out += [f"[{table}]", f"center_hz = {carrier:.6e}", f"sample_rate_hz = {rate}e6",
                f'format = "{draw.choice(("ci8", "ci8", "ci8", "cu8", "ci16"))}"']
        if len(bands) > 1:
            out.append(f'name = "band{place}"')
        if draw.random() < 0.15:
            out += ["[front_end.adc]", f"bits = {draw.choice((2, 3, 4))}"]
    return out


def run(arguments, number):
    """Runs a scene: its verdict, its text's signals, seconds, and the lines that say what failed."""
    text, sky, signals = scene(arguments.seed, number, 1e9 * arguments.gigasamples)
    folder = pathlib.Path(arguments.out)
    path = folder / f"random_{arguments.seed}_{number}.toml"
    path.write_text(text)
    results = folder / f"random_{arguments.seed}_{number}"
    shutil.rmtree(results, ignore_errors=True)
    begun = time.monotonic()
    done = subprocess.run(
        [arguments.program, "run", path, "--check", "--threads", "1", "--out", results],
        capture_output=True, text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
    seconds = time.monotonic() - begun
    lines = done.stdout + done.stderr
    verdict = {0: "holds", 3: "FAIL"}.get(done.returncode, f"exit {done.returncode}")
    # A sky with nothing in it is no scene of the hundred: the verdict must fail there, and by that row.
    none = re.search(r"^FAIL +satellites in view 0", lines, re.MULTILINE)
    if none or done.returncode not in (0, 3) and "in view" in lines:
        verdict = "empty"
    (folder / f"random_{arguments.seed}_{number}.log").write_text(lines)
    if (results / "verdict.csv").exists():
        shutil.copy(results / "verdict.csv", folder / f"random_{arguments.seed}_{number}.verdict.csv")
    if verdict in ("holds", "empty") and not arguments.keep:
        shutil.rmtree(results, ignore_errors=True)
    # The table of what broke a limit ends what is printed; an error ends it where nothing was judged.
    shown = lines.splitlines()
    begin = next((place for place, line in enumerate(shown) if line.startswith("figure ")), max(0, len(shown) - 3))
    told = [] if verdict in ("holds", "empty") else shown[begin:]
    return number, verdict, sky.name, signals, seconds, told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=1, help="number of the first scene")
    parser.add_argument("--count", type=int, default=100, help="scenes")
    parser.add_argument("--only", type=int, nargs="*", help="these scenes alone")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--gigasamples", type=float, default=1.2, help="most samples of a scene; 50 s are drawn always")
    parser.add_argument("--minutes", type=float, default=1e9, help="no scene begins after this time")
    parser.add_argument("--draw", action="store_true", help="write the scenes and do not run them")
    parser.add_argument("--keep", action="store_true", help="keep the results of scenes that hold too")
    parser.add_argument("--out", required=True, help="directory for scenes and results")
    arguments = parser.parse_args()
    folder = pathlib.Path(arguments.out)
    folder.mkdir(parents=True, exist_ok=True)
    for sky in SKIES:
        if sky.file:
            shutil.copy(REPOSITORY / "scenarios" / sky.file, folder)
    numbers = arguments.only or range(arguments.first, arguments.first + arguments.count)
    if arguments.draw:
        for number in numbers:
            text, _, _ = scene(arguments.seed, number, 1e9 * arguments.gigasamples)
            (folder / f"random_{arguments.seed}_{number}.toml").write_text(text)
        return 0
    begun, counts, by_signal, failed = time.monotonic(), {}, {}, []
    late = lambda: time.monotonic() - begun > 60 * arguments.minutes
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for done in pool.map(lambda number: None if late() else run(arguments, number), numbers):
            if done is None:
                continue
            number, verdict, sky, signals, seconds, told = done
            counts[verdict] = counts.get(verdict, 0) + 1
            print(f"{number:4} {verdict:6} {seconds:6.1f} s  {sky}: {', '.join(signals)}", flush=True)
            for line in told:
                print(f"       {line}", flush=True)
            if verdict == "empty":
                continue
            for signal in signals:
                by_signal[signal] = by_signal.get(signal, 0) + 1
            if verdict != "holds":
                failed.append(number)
    print("\nscenes:", ", ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items())))
    for signal in SIGNALS:
        print(f"  {signal:14} {by_signal.get(signal, 0)}")
    if failed:
        print("failed:", *failed)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
