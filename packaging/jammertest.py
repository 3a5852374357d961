#!/usr/bin/env python3
"""The pack jammertest from the catalogue of Jammertest (data/jammertest, MIT licence).

packs/jammertest/pack.toml follows from the catalogue's tests, its measurements of jammers and the tables below.
Distances are not in the catalogue unless a test's name has them, and routes never are: the entry states what is
assumed. A test that no scene says is listed with its reason. Usage: packaging/jammertest.py --write | --check
"""

import json
import math
import re
import sys
from datetime import datetime, timedelta
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT / "data" / "jammertest"
PACK = ROOT / "packs" / "jammertest" / "pack.toml"

L1_HZ = 1575.42e6
# Half the band of the base scene's samples.
HALF_BAND_HZ = 2e6
# Distances that the catalogue leaves open.
LOW_POWER_M, HIGH_POWER_M = 100, 1000
# Receivers of a meaconer, metres north and east of the antenna, and its delay through cable and amplifier.
RX1_M, RX2_M, DELAY_S = (300, 0), (0, 300), 1e-6
# Power of a satellite at the antenna, for spoofers: IS-GPS-200N, 6.3.1.
SATELLITE_DBW = -158.5
BEGIN_S, END_S, STEP_S = 32, 48, 0.5
# Jammers of the same source and producer (their descriptions in equipment.json).
LIKE = {"H1.4": "H1.1", "H1.5": "H1.1", "H1.6": "H1.1", "H1.7": "H1.1"}
BANDS_HZ = {"L1": 1575.42e6, "G1": 1602e6, "L2": 1227.6e6, "L5": 1176.45e6}
# Scenes of other bands: centre and half of the band of their samples.
SCENES = {"L1": ("base.toml", L1_HZ, HALF_BAND_HZ), "G1": ("base_g1.toml", 1602e6, 4.5e6),
          "L5": ("base_l5.toml", 1176.45e6, 6e6), "L2": ("base_l2.toml", 1227.6e6, 1.3e6)}
# The antenna of all scenes, and metres of a degree there: WGS 84.
LATITUDE_DEG, LONGITUDE_DEG, HEIGHT_M = 69.27547832, 15.96832496, 35
NORTH_DEG, EAST_DEG = 1 / 111_560, 1 / 39_540
START = {"base.toml": datetime(2010, 7, 1, 8, 5, 58), "drive.toml": datetime(2010, 7, 1, 8, 5, 58),
         "base_e1.toml": datetime(2020, 11, 29, 12, 50, 30)}
# Satellites in view of base.toml, whose spoofed messages are wrong.
IN_VIEW = ["G07", "G10", "G05", "G13", "G08", "G16", "G02", "G23"]
# Reason for which the verdict of a test with another claimed time is recorded and not held against the pack.
OTHER_SKY = "the judge holds observations against the true sky, and a captured receiver has those of the claimed time"
# Loss of a jammer's power through the body of a car, and through the decks of a ship.
LOSS_DB = 20
# The first pattern that is in a test's code, name or description says why no scene says it.
UNSAID = [
    (r"Deprecated", "the catalogue has withdrawn it"),
    (r"PRN 37", "satellites of GPS have the numbers 1 to 32 here, and no code of number 37"),
    (r"^2\.8\.", "a spoofer sends no messages of SBAS of its own, such as that which forbids the use of GPS"),
]

def number(text):
    """First number of a cell, with a decimal point or comma; None without one."""
    found = re.search(r"\d+(?:[.,]\d+)?", text)
    return float(found[0].replace(",", ".")) if found else None


def jammers():
    """Sources of each jammer by its identity: centre, width, period, power and modulation of each row."""
    found = {}
    for one in json.loads((DATA / "equipment.json").read_text()):
        rows = []
        for row in (one["table"] or [])[1:]:
            port = row[0] if len(row) == 8 else ""
            centre, width, _, total, _, period, modulation = row[-7:]
            rows.append((port.upper(), number(centre), number(width), number(total) if total != "N/A" else None,
                         number(period), modulation))
        found[one["id"]] = rows
    for ident, other in LIKE.items():
        found[ident] = found[other]
    return found


def waveform(width_mhz, period_us, modulation):
    """Waveform of a measured source as keys of [[interference]]."""
    width_hz = width_mhz * 1e6
    kind = modulation.lower()
    if kind.startswith("cw"):
        return {"kind": "cw"}
    if kind.startswith("prn"):
        return {"kind": "matched"} if "1 MHz" in modulation else {"kind": "noise", "bandwidth_hz": width_hz}
    if kind.startswith("sinus"):
        return {"kind": "sine_fm", "deviation_hz": width_hz / 2, "rate_hz": round(1e6 / period_us, 3)}
    if kind.startswith("triangle"):
        return {"kind": "fmcw", "sweep_hz": width_hz, "sweep_s": period_us / 2e6}
    # The widest sweep of a scene is 100 MHz: what is cut off at both ends takes its share of the period with it.
    part = min(1, 100e6 / width_hz)
    return {"kind": "chirp", "sweep_hz": width_hz * part, "sweep_s": round(period_us / 1e6 * part, 12)}


def of_jammer(known, ident, text, distance_m, gain_db=0):
    """Sources of a measured jammer that reach the base scene's band; a reason if there is none."""
    rows = known.get(ident)
    if not rows:
        return None, f"the catalogue has no measurement of {ident}"
    words = text.upper()
    if ident in ("H1.1", *LIKE):
        # A jammer with settings: modulation and power as the test says, else wide band and high power.
        mode = next((m for key, m in (("SWEEP", "CHIRP"), ("CHIRP", "CHIRP"), (" CW", "CW"), (" NB", "NB"), (" WB", "WB"))
                     if key in words), "WB")
        power = "LOW PWR" if "LOW PWR" in words else "HIGH PWR"
        rows = [row for row in rows if row[0] == f"L1, {mode}, {power}"]
    sources = []
    for _, centre, width, total_dbm, period, modulation in rows:
        centre_hz = centre * 1e6
        if abs(centre_hz - L1_HZ) > width * 5e5 + HALF_BAND_HZ:
            continue
        if total_dbm is None:
            return None, f"the power of {ident} was not measured"
        source = waveform(width, period, modulation)
        source |= {"center_hz": centre_hz, "eirp_dbw": round(total_dbm - 30 + gain_db, 2), "distance_m": distance_m}
        sources.append(source)
    return (sources, None) if sources else (None, f"{ident} is outside the band of the base scene (GPS L1)")


def band_of(name, description):
    """Band of the scene for a test of F8.1: that of GPS L1 where it is jammed, else another one that is."""
    if re.search(r"L1|1545|1620", name) or "pyramid" in name and "L1" in description:
        return "L1"
    return "L5" if "drift" in name else next(band for band in ("G1", "L5", "L2") if band in name)


def high_power(name, description, power_w, center_hz):
    """Source of F8.1 in a band as a test's name says it."""
    text = f"{name} {description}"
    source = {"center_hz": center_hz}
    if "drift" in name:
        low, high = (float(x) * 1e6 for x in re.search(r"(\d{4}) to (\d{4})", name).groups())
        # The widest sweep of a scene is 100 MHz.
        part = min(1, 100e6 / abs(high - low))
        middle = (low + high) / 2 if part == 1 else min(low, high) + 50e6
        source = {"kind": "chirp", "center_hz": middle, "sweep_hz": (high - low) * part, "sweep_s": round(10 * part, 6)}
    elif "CW" in name:
        source["kind"] = "cw"
    elif re.search("sweep", name, re.I):
        rate = re.search(r"(\d+) kHz", re.sub(r"BW.*?MHz", "", text)) or re.search(r"(100)kHz", text)
        width = re.search(r"BW: ?(\d+)", text)
        source |= {"kind": "chirp", "sweep_hz": float(width[1] if width else 20) * 1e6,
                   "sweep_s": 1e-3 / float(rate[1]) if rate else 1e-5}
    elif "white noise" in text or "WB jamming" in name:
        source |= {"kind": "noise", "bandwidth_hz": 20e6}
    else:
        rate = re.search(r"Chiprate: (\d+) MHz", name)
        source |= {"kind": "noise", "bandwidth_hz": float(rate[1] if rate else 3) * 1e6}
    source |= {"eirp_dbw": round(dbw(power_w), 2), "distance_m": HIGH_POWER_M}
    return source


def dbw(power_w):
    """Power in dBW."""
    return 10 * math.log10(power_w)


def ramp(source, key, low, high, step):
    """The source once for each step of its power, upwards."""
    steps, level = [], low
    while level < high + step:
        begin = BEGIN_S + STEP_S * len(steps)
        steps.append(source | {key: round(min(level, high), 2), "on_s": begin, "off_s": begin + STEP_S})
        level += step
    return steps


def timed(sources, begin=BEGIN_S, end=END_S):
    """Sources that are on for that time."""
    return [source | {"on_s": begin, "off_s": end} for source in sources]


def apart(sources):
    """The sources, of which those that are alike and on at one time have crystals of their own, 3 ppm apart."""
    found = []
    for source in sources:
        alike = [one for one in found if all(one.get(key) == source.get(key) for key in ("kind", "on_s"))
                 and abs(one["center_hz"] - source["center_hz"]) < 1e5]
        own = 1 + 3e-6 * len(alike)
        found.append(source | {"center_hz": round(source["center_hz"] * own, 1)} if alike else source)
        if alike and "sweep_s" in source:
            found[-1]["sweep_s"] = float(f"{source['sweep_s'] * own:.9g}")
    return found


def static(sources):
    """Keys of a scene in which the antenna is at rest; a ramp may outlast the base scene."""
    sources = apart(sources)
    end = max(source["off_s"] for source in sources)
    keys = {"interference": sources}
    if end > END_S:
        keys |= longer(end + 12)
    return keys


def longer(duration_s, begin_s=30):
    """Keys of a scene that lasts longer than the base scene."""
    interval = {"from_s": begin_s, "to_s": duration_s, "losses": "any", "fix": "any", "errors": "any",
                "reason": "the jammer, and what is lost after it"}
    return {"duration_s": duration_s, "expect": {"interval": [interval]}}


def drive(sources, places_m):
    """Keys of a scene in which a car passes jammers by the road, 5 m aside."""
    placed = []
    for source, at_m in zip(sources, places_m, strict=True):
        source = {key: value for key, value in source.items() if key != "distance_m"}
        placed.append(source | {"latitude_deg": round(LATITUDE_DEG + 5 * NORTH_DEG, 8),
                                "longitude_deg": round(LONGITUDE_DEG + at_m * EAST_DEG, 8), "height_m": 36, "on_s": 30})
    return {"scene": "drive.toml", "interference": placed}


def jammed(test, known):
    """Keys and what they leave out, or a reason: tests of jamming."""
    code, name, description = test["test_code"], test["name"], test["description"]
    text = f"{name} {description}"
    group = int(code.split(".")[1])
    idents = [ident for ident in test["equipment"] if re.fullmatch(r"[SUH]\d\.\d|F6\.1", ident)]
    assumed = ""
    if "symphony" in name:
        return symphony(known)
    if "TBD" in test["equipment"]:
        idents, assumed = ["S1.1", "S2.1", "S2.4"], "S1.1, S2.1 and S2.4 for jammers that the catalogue leaves open"
    top_w = float(test["max_power_w"]) or (100 if group == 16 else 50)
    metres = re.search(r"at (\d+) meters", name)
    distance_m = int(metres[1]) if metres else LOW_POWER_M
    if group == 25:
        kind = {"kind": "noise", "bandwidth_hz": 20e6} if "AWGN" in name else {"kind": "noise", "bandwidth_hz": 3e6}
        step = int(re.search(r"(\d) dB incr", name)[1])
        note = f"three directions as one source, ramp upwards alone with {STEP_S} s a step"
        if "pulse duration" in name:
            kind = {"kind": "pulse", "width_s": 1e-3, "rate_hz": 100}
            note += "; pulses of a carrier for pulses of a spread code"
        return static(ramp(kind | {"center_hz": L1_HZ}, "js_db", 0, 80, step)), note
    if idents and group not in (24,):
        gain_db = 10 if "10dB gain" in name else 0
        if group == 13 and re.search(r"inside car|inside public", name):
            gain_db, assumed = -LOSS_DB, f"{LOSS_DB} dB lost on the way through the car or the deck"
        if group == 23:
            # A circle about the antenna at that height: its radius is the catalogue's 50 m.
            distance_m = round((50**2 + distance_m**2) ** 0.5, 1)
        if group in (11, 13):
            distance_m = 30
        if group == 20 and (sequence := re.search(r"JAMMER (A[ +BC]*)", description)):
            idents = idents[: sequence[1].count("+") + 1]
        each = [of_jammer(known, ident, text, distance_m, gain_db) for ident in idents]
        found = [sources for sources, _ in each if sources]
        if not found:
            return None, each[0][1]
        left = "; ".join(filter(None, [assumed, *(reason for sources, reason in each if not sources)]))
        if "overtaking" in name:
            note = "the overtaking as its relative motion: the test vehicle passes the jammer at 35 km/h"
            return drive([found[0][0]], [150]), "; ".join(filter(None, [note, left]))
        if re.search(r"parked car", name):
            places = [150 + 100 * number for number in range(len(found))]
            firsts = [sources[0] for sources in found]
            return drive(firsts, places), left
        if "starting in" in name:
            keys = static(timed(sum(found, []), 0.1, 24))
            return keys | {"duration_s": 75, "expect": {"interval": [
                {"from_s": 0, "to_s": 75, "losses": "any", "fix": "any", "errors": "any",
                 "reason": "the receiver starts beside a jammer"}]}}, left
        if "sequentially" in name and group == 12:
            sources = sum((timed(sources, BEGIN_S + 5 * n) for n, sources in enumerate(found)), [])
            return static(sources), left
        return static(timed(sum(found, []))), left
    if group == 21:
        noise = {"kind": "noise", "bandwidth_hz": 1.4e6}
        wide = 40e3 if "40 kHz" in text else 1.4e6
        kind = noise if "OFDM" in name else {"kind": "chirp", "sweep_hz": wide, "sweep_s": 1e-3}
        source = kind | {"center_hz": L1_HZ, "eirp_dbw": round(dbw(top_w), 2), "distance_m": HIGH_POWER_M}
        note = "the waveform of LTE as Gaussian noise" if "OFDM" in name else ""
        if "ramp" not in name:
            return static(timed([source])), note
        levels = [dbw(top_w * share) for share in (0.1, 0.2, 0.5, 1)]
        sources = [source | {"eirp_dbw": round(level, 2), "on_s": BEGIN_S + second + 0.25 * part,
                             "off_s": BEGIN_S + second + 0.25 * (part + 1)}
                   for second in range(4) for part, level in enumerate(levels)]
        return static(sources), "; ".join(filter(None, [note, "four periods of the ramp"]))
    band = band_of(name, description)
    scene, center_hz, _ = SCENES[band]
    source = high_power(name, description, top_w, center_hz)
    keys, notes = steady(test, group, top_w, source, center_hz)
    if band != "L1":
        keys["scene"] = scene
        notes.append(f"the scene receives {band}")
    return keys, "; ".join(notes)


def symphony(known):
    """Keys and what they leave out: all kinds of sources, one after the other."""
    sources = []
    for number, ident in enumerate(("S1.1", "S1.2", "S1.3", "S2.1", "S2.2")):
        sources += timed(of_jammer(known, ident, "", LOW_POWER_M)[0], BEGIN_S + 3 * number, 65)
    porcus = {"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ, "eirp_dbw": round(dbw(50), 2),
              "distance_m": HIGH_POWER_M}
    keys = longer(75) | static(sources + timed([porcus], BEGIN_S + 15, 65))
    keys["spoofer"] = [meaconer(RX1_M, 10, BEGIN_S + 18)]
    return keys, "S1.1, S1.2, S1.3, S2.1 and S2.2 as the small jammers, 3 s for two minutes, meaconing of 10 W"


def steady(test, group, top_w, source, center_hz):
    """Keys and notes of a test with the source of F8.1 at rest."""
    code, name, description = test["test_code"], test["name"], test["description"]
    text = f"{name} {description}"
    notes = []
    if source["kind"] == "noise" and "PRN" in text:
        notes.append("the spread code as Gaussian noise of the chip rate's bandwidth")
    if "drift" in name:
        notes.append("the drift in 10 s")
        if "gaussian" in name:
            # Noise has one centre: it steps through the band of the base scene, 0.5 MHz at a time.
            speed = source["sweep_hz"] / 10
            dwell = round(0.5e6 / abs(speed), 6)
            notes.append("one pass in steps of 0.5 MHz")
            steps = range(-5, 6) if speed > 0 else range(5, -6, -1)
            noise = {"kind": "noise", "bandwidth_hz": 0.5e6, "eirp_dbw": source["eirp_dbw"], "distance_m": HIGH_POWER_M}
            return static([noise | {"center_hz": center_hz + 0.5e6 * step, "on_s": round(BEGIN_S + dwell * n, 6),
                                    "off_s": round(BEGIN_S + dwell * (n + 1), 6)} for n, step in enumerate(steps)]), \
                notes
    if group in (6, 7, 14) or "increments" in name:
        low = re.search(r"\((-\d+)dBm\)", name)
        low_dbw = int(low[1]) - 30 if low else -70
        notes.append(f"ramp upwards alone with {STEP_S} s a step")
        return static(ramp(source, "eirp_dbw", low_dbw, dbw(top_w), 2)), notes
    if group in (8, 9):
        # L1 is the last band that is added, or the first; the other bands are not received.
        if "inverted" in name:
            return static(timed([source], BEGIN_S, BEGIN_S + 4) + timed([source], END_S - 4)), [*notes, "steps of 4 s"]
        span = (BEGIN_S + 6, BEGIN_S + 10) if "ending at L1" in name else (BEGIN_S, END_S)
        return static(timed([source], *span)), [*notes, "steps of 4 s"]
    if code == "1.15.1":
        return static(ramp(source, "eirp_dbw", -10, 0, 10)), [f"ramp upwards alone with {STEP_S} s a step"]
    if code in ("1.15.3", "1.15.4"):
        span = (BEGIN_S + 8, END_S) if "then L1" in name else (BEGIN_S, BEGIN_S + 8)
        return static(timed([source], *span)), ["G1 is not received"]
    if "two locations" in name:
        return static(timed([source, dict(source)])), notes
    return static(timed([source])), notes


def over_db(dbm, distance_m=HIGH_POWER_M):
    """Power of a spoofer over that of a satellite, behind the free-space loss of L1: 96.4 dB for a kilometre."""
    return round(dbm - 30 - 96.4 - 20 * math.log10(distance_m / 1000) - SATELLITE_DBW, 1)


def place(north_m, east_m, height_m=HEIGHT_M):
    """A position by its distance from the antenna of the scenes."""
    return {"latitude_deg": round(LATITUDE_DEG + north_m * NORTH_DEG, 8),
            "longitude_deg": round(LONGITUDE_DEG + east_m * EAST_DEG, 8), "height_m": height_m}


def at_rest(north_m, east_m, height_m=HEIGHT_M):
    """Motion of an antenna that stays."""
    return {"kind": "static"} | place(north_m, east_m, height_m)


# Claimed routes, of which the catalogue has names alone: where they begin, the way in five minutes and the speed.
ROUTES = {
    "driving": ((0, 0, HEIGHT_M), (4200, 0), 14, "straight north at 14 m/s for the route"),
    "drone": ((171, 40, HEIGHT_M + 50), (0, 3000), 10, "straight east at 10 m/s and 50 m up for the route"),
    "ship": ((300, -300, HEIGHT_M), (-2400, 0), 8, "straight south at 8 m/s for the route"),
    "helicopter": ((1000, 0, 200), (0, 18000), 60, "straight east at 60 m/s for the route"),
    "south": ((0, 0, HEIGHT_M), (-2916, 0), 9.72, "at 35 km/h from 36 s on"),
    "north fast": ((0, 0, HEIGHT_M), (0, 8340), 27.8, "east at 100 km/h for the route along the road"),
    "west": ((0, 0, HEIGHT_M), (0, -2916), 9.72, "west at 35 km/h for the opposite direction"),
    "aside": ((0, 0, HEIGHT_M), (1458, 2525), 9.72, "at 35 km/h and 30 degrees off the road for the route"),
}


def route(kind, begin=BEGIN_S + 4):
    """Motion along a claimed route, at rest until `begin`."""
    (north, east, height), (way_north, way_east), speed, _ = ROUTES[kind]
    points = [place(north, east, height) | {"speed_mps": 0, "hold_s": begin},
              place(north + way_north, east + way_east, height) | {"speed_mps": speed}]
    return {"kind": "waypoints", "acceleration_mps2": 2, "turn_acceleration_mps2": 2, "jerk_mps3": 2, "point": points}


def other_time(name, description, start):
    """Claimed time of a test that is not the true one, and whether the data of the scene reach there; else None."""
    if minutes := re.search(r"Time offset (-?\d+) minutes", name):
        return start + timedelta(minutes=int(minutes[1])), True
    if "1 year, 1 day" in name:
        return start + timedelta(days=366, hours=1, minutes=15), False
    if "1 hour and 15 minutes" in name:
        return start + timedelta(hours=1, minutes=15), True
    if "2038" in f"{name} {description}":
        # GPS time: 18 s ahead of UTC. The counter of 32 bits ends at 03:14:07 UTC, 43 s after the scene's start.
        return datetime(2038, 1, 19, 3, 13, 24) + timedelta(seconds=18), False
    if years := re.search(r"(\d+) years (backwards|forwards)", name):
        return start + timedelta(days=365 * int(years[1]) * (-1 if years[2] == "backwards" else 1)), False
    if "April 2019" in name:
        return datetime(2019, 4, 1, 12), False
    if "time jump" in name or "Simulated start time: 01.10" in description:
        return start + timedelta(days=14), False
    return None


def on_the_road(name, description):
    """Claimed motion in a motorcade, the scene and what is assumed: tests of a mobile spoofer."""
    scene = "base.toml" if re.search("stationary", name) else "drive.toml"
    found = re.search(r"(\d\d[.,]\d+) ?N, (\d+[.,]\d+) ?E", description)
    if found and "tunnel" not in name:
        north, east = (float(x.replace(",", ".")) for x in found.groups())
        return {"kind": "static", "latitude_deg": north, "longitude_deg": east, "height_m": HEIGHT_M}, scene, []
    if "tunnel" in name:
        north, east = (float(x.replace(",", ".")) for x in found.groups())
        here = {"latitude_deg": north, "longitude_deg": east, "height_m": HEIGHT_M, "speed_mps": 0, "hold_s": 28}
        there = here | {"latitude_deg": round(north + 2916 * NORTH_DEG, 8), "speed_mps": 9.72}
        del there["hold_s"]
        motion = {"kind": "waypoints", "acceleration_mps2": 2, "turn_acceleration_mps2": 2, "jerk_mps3": 2}
        return motion | {"point": [here, there]}, scene, ["north at 35 km/h, without what follows inside the tunnel"]
    kind = ("south" if "moving south" in name and "Nordmela" not in name else "aside" if "terrain" in name
            else "west" if "southbound" in name else "north fast" if "higher speed" in name else None)
    return (route(kind), scene, [ROUTES[kind][3]]) if kind else (None, scene, [])


def power_of(test, distance_m):
    """Keys of the power of one or two spoofers, and what is assumed of it."""
    name, description = test["name"], test["description"]
    # 25 dBm is the power of most, and of those that leave it open.
    top = dbw(float(test["max_power_w"]) or 0.316) + 30
    low_high = re.search(r"(-\d+) ?dBm to \+?(\d+) ?dBm", description)
    if "uW to mW" in description:
        growth = {"power_start_db": over_db(-30, distance_m), "power_db": over_db(0, distance_m), "ramp_s": 16}
        return [{"on_s": BEGIN_S} | growth], ["the power grows evenly within 16 s"]
    if low_high and "ramp" in f"{name} {description}":
        low, high = (int(dbm) for dbm in low_high.groups())
        growth = {"power_start_db": over_db(low, distance_m), "power_db": over_db(high, distance_m), "ramp_s": 16}
        return [{"on_s": BEGIN_S} | growth], ["the power grows evenly within 16 s"]
    if "ramp" in name:
        growth = {"power_start_db": over_db(top - 40, distance_m), "power_db": over_db(top, distance_m), "ramp_s": 16}
        return [{"on_s": BEGIN_S} | growth], ["the power grows evenly by 40 dB within 16 s"]
    if "power jump" in name:
        low = {"power_db": over_db(-20, distance_m), "on_s": BEGIN_S, "off_s": BEGIN_S + 8}
        return [low, {"power_db": over_db(top, distance_m), "on_s": BEGIN_S + 8}], ["8 s of low power"]
    return [{"power_db": over_db(top, distance_m), "on_s": BEGIN_S}], []


def spoofed(test, known):
    """Keys and what they leave out, or a reason: tests of spoofing."""
    code, name, description = test["test_code"], " ".join(test["name"].split()), test["description"]
    group = int(code.split(".")[1])
    galileo = re.search(r"Galileo (E1 )?only|\. Galileo E1$", name) and "GPS" not in name
    scene = "base_e1.toml" if galileo else "base.toml"
    motion, notes = None, []
    if group == 6:
        motion, scene, more = on_the_road(name, description)
        notes += ["power at 100 m", *more]
    else:
        notes.append("power at 1 km")
    if galileo:
        notes.append("the scene receives Galileo E1")
    spoofers, more = power_of(test, LOW_POWER_M if group == 6 else HIGH_POWER_M)
    notes += more
    named = re.search(r"(\d\d[.,]?\d*) ?N?, (\d\d[.,]?\d*)(?: E)?(?:, (\d+) m)?", description)
    if re.search("position (and time )?jump", name) and named and group != 6:
        north, east, height = (float(x.replace(",", ".")) if x else 35.0 for x in named.groups())
        motion = {"kind": "static", "latitude_deg": north, "longitude_deg": east, "height_m": height}
    kind = next((kind for word, kind in (("drone", "drone"), ("Sailing", "ship"), ("Flying", "helicopter"),
                                         ("Simulated driving", "driving")) if word in name), None)
    if "harbour scenario" in name or "helicopter scenario" in name and "Flying" not in name:
        (north, east, height), *_ = ROUTES["ship" if "harbour" in name else "helicopter"]
        motion = at_rest(north, east, height)
        notes.append("at rest 424 m from the antenna" if "harbour" in name else "at rest 1 km north, 200 m up")
    elif kind:
        motion = route(kind)
        notes.append(ROUTES[kind][3])
    common = {}
    if "Frequency step" in name or "Pseudorange error" in name:
        common["clock_drift_sps"] = 1e-8
        if "Pseudorange" in name:
            notes.append("10 ns/s for the rate that the catalogue leaves open")
    if "circular position drift" in name or "drifting position" in name or group == 10:
        common["drag"] = {"start_s": BEGIN_S + 4, "azimuth_deg": 45, "speed_mps": 3}
        notes.append("the second period, straight on" if "circular" in name else "straight on at 3 m/s for the route")
    if "drifting position and time" in name:
        common["clock_drift_sps"] = 1e-8
        notes.append("10 ns/s of time")
    if time := other_time(name, description, START[scene]):
        then, near = time
        common["time_offset_s"] = int((then - START[scene]).total_seconds())
        if not near:
            common["navigation_moved_to"] = f"{then:%Y-%m-%d}"
            notes.append(f"the sky of the scene's day, its messages moved to {then:%Y-%m-%d}")
    if group in (1, 4) and "navigation_moved_to" not in common:
        notes.append("the ephemerides of the scene's file in place of synthetic ones")
    faults = []
    if "UTC-param" in name:
        common["leap_seconds"] = 16 if "adding" in name else -127
        notes.append(f"{common['leap_seconds']} leap seconds in place of 15, the number of the scene's day")
    if "Nav data manip" in name or "Nav. data manip" in name:
        clock = "clock" in name
        faults = [{"kind": "parameter", "spoofer": number + 1, "satellites": IN_VIEW[:4] if clock else IN_VIEW,
                   "parameter": "af0_s" if clock else "eccentricity", "add": 1e-6 if clock else 0.3,
                   "on_s": BEGIN_S + 4}
                  for number in range(len(spoofers))]
        notes.append("clocks of four satellites 1 µs off" if clock else "an eccentricity that is 0.3 too large")
    keys = {"spoofer": [one | common | ({"motion": motion} if motion else {}) for one in spoofers]}
    if faults:
        keys["message_fault"] = faults
    if scene != "drive.toml":
        keys |= longer(75)
    if scene != "base.toml":
        keys["scene"] = scene
    jammer = {"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ, "eirp_dbw": 3, "distance_m": HIGH_POWER_M}
    if group == 10:
        keys |= ring(test, known, notes)
    elif ("jamming" in name or "initial jamming" in description) and "No jamming" not in description:
        keys["interference"] = timed([jammer], 26, BEGIN_S)
        notes.append("6 s of jamming before it")
    if "interference" in keys and scene != "drive.toml":
        keys |= longer(75, 26)
    return keys, "; ".join(notes)


def ring(test, known, notes):
    """Keys of jammers in a circle about the antenna, beside a spoofer; adds what is assumed to `notes`."""
    name, description = test["name"], test["description"]
    if "SDR" in name:
        notes.append("three jammers as one source, ramp upwards alone with half a second a step")
        return {"interference": ramp({"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ}, "js_db", 0, 80, 4)}
    sources = []
    for ident in [ident for ident in test["equipment"] if re.fullmatch(r"H\d\.\d", ident)]:
        narrow = ident in ("H1.6", "H1.7") or "NB. HIGH" in description
        mode = " NB HIGH PWR" if narrow else "CHIRP HIGH PWR"
        found, _ = of_jammer(known, ident, mode, 150 if "A150, B150 and C150, with" in description else 50)
        sources += found or []
    if not sources:
        return {}
    notes.append("6 s of jamming before the spoofing" + ("; moving jammers at rest" if "moving" in name else ""))
    return {"interference": apart(timed(sources, 26, 60))}


def meaconer(place_m, power_w, begin=BEGIN_S, end=None):
    """A spoofer that repeats what a receiver in that place hears."""
    power = {"power_db": over_db(dbw(power_w) + 30), "on_s": begin}
    return power | ({"off_s": end} if end else {}) | {"clock_bias_s": -DELAY_S, "motion": at_rest(*place_m)}


def together(test, growth):
    """Meaconers and spoofers of one test, and what is assumed of them."""
    name, top_w = test["name"], float(test["max_power_w"]) or 10
    spoofer = {"power_db": over_db(25), "on_s": BEGIN_S, "motion": route("driving")}
    if "in sequence" in name:
        four = "four" in name
        sources = [meaconer(RX1_M, top_w), spoofer] + ([meaconer(RX2_M, top_w), dict(spoofer)] if four else [])
        last_s = 4 if four else 8
        for number, source in enumerate(sources):
            source |= {"on_s": BEGIN_S + last_s * number, "off_s": BEGIN_S + last_s * (number + 1) + 1}
        return sources, [f"{last_s} s an emitter, one second of both between"]
    if "Switching" in name:
        second = spoofer | {"on_s": BEGIN_S + 8, "off_s": BEGIN_S + 16}
        return [meaconer(RX1_M, top_w, BEGIN_S, BEGIN_S + 8), second], ["8 s of each"]
    if "community house" in name:
        return [meaconer(RX1_M, top_w), meaconer(RX2_M, top_w) | growth], []
    if "three emitters" in test["description"]:
        return [meaconer(RX1_M, top_w), meaconer(RX2_M, top_w), spoofer], [ROUTES["driving"][3]]
    return [meaconer(RX1_M, top_w), spoofer], [ROUTES["driving"][3]]


def meaconed(test, _known):
    """Keys and what they leave out: tests of meaconing, where a spoofer is at a receiver's position and late."""
    name, description, code = test["name"], test["description"], test["test_code"]
    top_w, at = float(test["max_power_w"]) or 10, meaconer

    both = [at(RX1_M, top_w), at(RX2_M, top_w)]
    notes = ["receivers 300 m from the antenna, 1 µs late, heard at 1 km"]
    growth = {"power_start_db": round(-30 - 96.4 - SATELLITE_DBW, 1), "ramp_s": 16}
    if code.startswith("3.4"):
        both, more = together(test, growth)
        notes += more
    elif "decreasing" in name or "frequencies" in name:
        lasts = [4, 4, 2, 2, 1, 1, 0.5, 0.5] if "decreasing" in name else [4, 4, 2, 2, 2, 2, 1, 1, 1, 1]
        both, begin = [], BEGIN_S
        for number, last_s in enumerate(lasts):
            both.append(at((RX1_M, RX2_M)[number % 2], top_w, begin, begin + last_s))
            begin += last_s
        notes.append("1 s for a minute" if "decreasing" in name else "sessions with switches after 4, 2 and 1 s")
    elif code.startswith("3.5"):
        both = [at(RX1_M, top_w) | growth]
        if "pulsed" in name:
            both = [at(RX1_M, top_w, BEGIN_S + 4 * number, BEGIN_S + 4 * number + 2) for number in range(4)]
            notes.append("2 s of meaconing, then 2 s of jamming by noise")
    elif "alternating" in name:
        step = 8 if "breaks" in name else 4
        both = [at((RX1_M, RX2_M)[n % 2], top_w, BEGIN_S + step * n, BEGIN_S + step * n + 4) for n in range(16 // step)]
        notes.append("4 s for a minute")
    elif "different times" in name:
        both = [at(RX1_M, top_w, BEGIN_S, BEGIN_S + 12), at(RX2_M, top_w, BEGIN_S + 4)]
        notes.append("4 s for five minutes")
    elif "adding RX2" in name:
        both = [at(RX1_M, 0.5), at(RX2_M, top_w, BEGIN_S + 4)]
        notes.append("4 s for five minutes")
    elif "constant" in name:
        both = [at(RX1_M, 5), at(RX2_M, top_w) | growth]
    elif "ramp" in name.lower():
        both = [at(RX1_M, top_w) | growth]
    elif "RX1 and RX2" not in name:
        both = [at(RX2_M if "RX2" in name else RX1_M, top_w)]
    if "power_start_db" in str(both):
        notes.append("the power grows evenly within 16 s")
    keys = {"spoofer": both} | longer(75)
    jams = "jamming" in f"{name} {description}" and "no background jamming" not in description
    if jams and re.search("decreasing|frequencies", name):
        notes.append("the jamming is of other bands, which are not received")
    elif jams:
        jammer = {"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ, "distance_m": HIGH_POWER_M,
                  "eirp_dbw": 0 if "30 dBm" in description else 17}
        pulses = [(BEGIN_S + 4 * number + 2, BEGIN_S + 4 * number + 4) for number in range(4)]
        breaks = [(BEGIN_S + 4, BEGIN_S + 8), (BEGIN_S + 12, BEGIN_S + 16)]
        pauses = pulses if "pulsed" in name else breaks if "in breaks" in name else [(26, BEGIN_S)]
        keys["interference"] = [one for pause in pauses for one in timed([jammer], *pause)]
        notes.append("jamming of some seconds")
    return keys, "; ".join(notes)


def toml(value):
    """A value on one line of TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return value if re.fullmatch(r"\d{4}-\d\d-\d\d", value) else json.dumps(value, ensure_ascii=False)
    return f"{value / 1e6:.10g}e6" if isinstance(value, float) and abs(value) >= 1e4 else f"{value:.12g}"


def reason_of(test):
    """Reason for which no scene says a test, by its words."""
    words = f"{test['test_code']} {test['name']}"
    return next((reason for pattern, reason in UNSAID if re.search(pattern, words)), None)


def manifest():
    """The whole pack.toml, and how many tests are said and not said."""
    known, entries, unsaid = jammers(), [], []
    for kind in json.loads((DATA / "testcatalog.json").read_text())["test_types"][1:]:
        for group in kind["test_groups"]:
            title = f"{kind['type_id']}.{group['group_id']} {group['group_name']}"
            for test in group["tests"]:
                code, name = test["test_code"], " ".join(test["name"].split())
                reason, keys, note = reason_of(test), None, ""
                if reason is None:
                    tell = {1: jammed, 2: spoofed, 3: meaconed}[kind["type_id"]]
                    keys, note = tell(test, known)
                    reason = note if keys is None else None
                head = f"name = {toml(code)}\ngroup = {toml(title)}\n"
                if keys is None:
                    unsaid.append(f"[[not_said]]\n{head}description = {toml(name)}\nreason = {toml(reason)}\n")
                    continue
                text = f"{name} ({note})" if note else name
                scene = keys.pop("scene", "base.toml")
                lines = "".join(f"set.{key} = {toml(value)}\n" for key, value in keys.items())
                verdict = ""
                if any("time_offset_s" in spoofer for spoofer in keys.get("spoofer", [])):
                    verdict = f'verdict = "any"\nreason = {toml(OTHER_SKY)}\n'
                entries.append(f"[[entry]]\n{head}description = {toml(text)}\nscene = {toml(scene)}\n{verdict}{lines}")
    top = (
        "# Made by `packaging/jammertest.py --write` from data/jammertest: edit the script, not this file.\n"
        'name = "jammertest"\n'
        'title = "Jammertest: the catalogue of tests as scenes of GPS L1"\n'
        'like = "Jammertest 2024 of the Norwegian Public Roads Administration and others. Times are compressed to '
        f'scenes of a minute, distances are assumed where the catalogue has none ({LOW_POWER_M} m, {HIGH_POWER_M} m '
        'for F8.1, 30 m in a motorcade and on a ship), and sources outside the band of GPS L1 are left out. Routes, and the '
        'times between which sources switch, are assumed and stated in each entry."\n'
        'source = "testcatalog.json and equipment.json of NPRA\'s jammertest-plan"\n'
        'licence = "MIT, copyright 2024 Norwegian Public Roads Administration (data/LICENSE-jammertest-plan.txt)"\n'
        'about = "Jammers have the centre, bandwidth, period and power that the catalogue has measured. The scene '
        'excuses losses, missing fixes and errors from the first interference on; what comes before it, and the '
        'signals and messages that the receiver reports, stay judged."\n'
    )
    return "\n".join([top, *entries, *unsaid]), len(entries), len(unsaid)


def main():
    """Writes or checks the manifest."""
    text, said, unsaid = manifest()
    print(f"jammertest: {said} tests said, {unsaid} not said")
    if sys.argv[1:] == ["--write"]:
        PACK.write_text(text)
    elif sys.argv[1:] != ["--check"]:
        sys.exit(__doc__)
    elif PACK.read_text() != text:
        sys.exit("packs/jammertest/pack.toml is not what packaging/jammertest.py --write makes")


main()
