#!/usr/bin/env python3
"""The pack jammertest from the catalogue of Jammertest (data/jammertest, MIT licence).

packs/jammertest/pack.toml follows from the catalogue's tests, its measurements of jammers and the tables below.
Distances are not in the catalogue unless a test's name has them. A test that today's keys cannot say is listed with
its reason. Usage: packaging/jammertest.py --write | --check
"""

import json
import math
import re
import sys
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
ROUTE = "its route is in no data of the catalogue"
# The first pattern that is in a test's code, name or description says why no scene says it.
UNSAID = [
    (r"^2\.[14678]\.|^2\.6|^2\.9", "a spoofer has the ephemerides, the health and the time of the true satellites"),
    (r"^3\.[45]", "spoofing or jammers beside meaconing, on a route that is in no data of the catalogue"),
    (r"^3\.2\.(6|7|9|1)", "the durations between which it switches are in no data of the catalogue"),
    (r"^2\.10\.|^1\.24\.", "spoofing or meaconing beside jammers, on a route that is in no data of the catalogue"),
    (r"Deprecated", "the catalogue has withdrawn it"),
    (r"^2.*Galileo (only|E1$)|^2.*E1$", "the spoofed signals are Galileo's, and the base scene receives GPS L1 C/A"),
    (r"Time offset", "the clock of a spoofer is within 1 s of GPS time"),
    (r"Pseudorange error", "the catalogue leaves the rate open (x ns/s)"),
    (r"Nav data manip|UTC-param|PRN 37", "a spoofer sends the messages of the true satellites"),
    (r"[Rr]oute|Long duration|Longer period", ROUTE),
    (r"overtaking|in vehicle being", "an emitter does not move"),
    (r"inside car|inside public", "the loss through a car or a deck is in no data of the catalogue"),
    (r"pulse duration", "pulses of a spread code"),
    (r"Three jammers in the moving", "the catalogue leaves the jammers open (TBD)"),
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


def high_power(name, description, power_w):
    """Source of F8.1 on L1 as a test's name says it; a reason where L1 is not jammed."""
    text = f"{name} {description}"
    if not re.search(r"L1|1545|1620", name):
        return None, "no band of it is within that of the base scene (GPS L1)"
    source = {"center_hz": L1_HZ}
    if "drift" in name:
        low, high = (float(x) * 1e6 for x in re.search(r"(\d{4}) to (\d{4})", name).groups())
        if not low < L1_HZ < high and not high < L1_HZ < low:
            return None, "no band of it is within that of the base scene (GPS L1)"
        source = {"kind": "chirp", "center_hz": (low + high) / 2, "sweep_hz": high - low, "sweep_s": 10}
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
    return source, None


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


def longer(duration_s):
    """Keys of a scene that lasts longer than the base scene."""
    interval = {"from_s": 30, "to_s": duration_s, "losses": "any", "fix": "any", "errors": "any",
                "reason": "the jammer, and what is lost after it"}
    return {"duration_s": duration_s, "expect": {"interval": [interval]}}


def drive(sources, places_m):
    """Keys of a scene in which a car passes jammers by the road, 5 m aside."""
    # Metres of a degree at that latitude: WGS 84.
    north_deg, east_deg = 1 / 111_560, 1 / 39_540
    latitude, longitude = 69.27547832, 15.96832496
    placed = []
    for source, at_m in zip(sources, places_m, strict=True):
        source = {key: value for key, value in source.items() if key != "distance_m"}
        placed.append(source | {"latitude_deg": round(latitude + 5 * north_deg, 8),
                                "longitude_deg": round(longitude + at_m * east_deg, 8), "height_m": 36, "on_s": 30})
    return {"scene": "drive.toml", "interference": placed}


def jammed(test, known):
    """Keys and what they leave out, or a reason: tests of jamming."""
    code, name, description = test["test_code"], test["name"], test["description"]
    text = f"{name} {description}"
    group = int(code.split(".")[1])
    idents = [ident for ident in test["equipment"] if re.fullmatch(r"[SUH]\d\.\d|F6\.1", ident)]
    top_w = float(test["max_power_w"]) or (100 if group == 16 else 50)
    metres = re.search(r"at (\d+) meters", name)
    distance_m = int(metres[1]) if metres else LOW_POWER_M
    if group == 25:
        kind = {"kind": "noise", "bandwidth_hz": 20e6} if "AWGN" in name else {"kind": "noise", "bandwidth_hz": 3e6}
        step = int(re.search(r"(\d) dB incr", name)[1])
        note = f"three directions as one source, ramp upwards alone with {STEP_S} s a step"
        return static(ramp(kind | {"center_hz": L1_HZ}, "js_db", 0, 80, step)), note
    if idents and group not in (24,):
        gain_db = 10 if "10dB gain" in name else 0
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
        left = "; ".join(reason for sources, reason in each if not sources)
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
    source, reason = high_power(name, description, top_w)
    if source is None:
        return None, reason
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
            return static([noise | {"center_hz": L1_HZ + 0.5e6 * step, "on_s": round(BEGIN_S + dwell * n, 6),
                                    "off_s": round(BEGIN_S + dwell * (n + 1), 6)} for n, step in enumerate(steps)]), \
                "; ".join(notes)
    if group in (6, 7, 14) or "increments" in name:
        low = re.search(r"\((-\d+)dBm\)", name)
        low_dbw = int(low[1]) - 30 if low else -70
        notes.append(f"ramp upwards alone with {STEP_S} s a step")
        return static(ramp(source, "eirp_dbw", low_dbw, dbw(top_w), 2)), "; ".join(notes)
    if group in (8, 9):
        # L1 is the last band that is added, or the first; the other bands are not received.
        span = (BEGIN_S + 6, BEGIN_S + 10) if "ending at L1" in name else (BEGIN_S, END_S)
        return static(timed([source], *span)), "; ".join([*notes, "steps of 4 s"])
    if code == "1.15.1":
        return static(ramp(source, "eirp_dbw", -10, 0, 10)), f"ramp upwards alone with {STEP_S} s a step"
    if code in ("1.15.3", "1.15.4"):
        span = (BEGIN_S + 8, END_S) if "then L1" in name else (BEGIN_S, BEGIN_S + 8)
        return static(timed([source], *span)), "G1 is not received"
    if "two locations" in name:
        return static(timed([source, dict(source)])), "; ".join(notes)
    return static(timed([source])), "; ".join(notes)


def spoofed(test):
    """Keys and what they leave out, or a reason: tests of spoofing with the true ephemerides."""
    name, description = test["name"], test["description"]

    def over_db(dbm):
        # Free-space loss of 1 km at L1.
        return round(dbm - 30 - 96.4 - SATELLITE_DBW, 1)

    # 25 dBm is the power of most, and of those that leave it open.
    top = dbw(float(test["max_power_w"]) or 0.316) + 30
    spoofer = {"power_db": over_db(top), "on_s": BEGIN_S}
    notes = ["power at 1 km"]
    if "ramp" in name:
        low, high = (int(dbm) for dbm in re.search(r"(-\d+) dBm to \+?(\d+) dBm", description).groups())
        spoofer |= {"power_start_db": over_db(low), "power_db": over_db(high), "ramp_s": 16}
        notes.append("the power grows evenly within 16 s")
    place = re.search(r"(\d\d[.,]?\d*) ?N?, (\d\d[.,]?\d*)(?: E)?(?:, (\d+) m)?", description)
    if "position jump" in name and place:
        north, east, height = (float(x.replace(",", ".")) if x else 35.0 for x in place.groups())
        spoofer["motion"] = {"kind": "static", "latitude_deg": north, "longitude_deg": east, "height_m": height}
    if "Frequency step" in name:
        spoofer["clock_drift_sps"] = 1e-8
    if "circular position drift" in name:
        spoofer["drag"] = {"start_s": BEGIN_S + 4, "azimuth_deg": 45, "speed_mps": 3}
        notes.append("the second period, straight on")
    keys = {"spoofer": [spoofer]} | longer(75)
    if "jamming" in name and "No jamming" not in description:
        jammer = {"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ, "eirp_dbw": 3, "distance_m": HIGH_POWER_M}
        keys["interference"] = timed([jammer], 26, BEGIN_S)
        notes.append("6 s of jamming before it")
    return keys, "; ".join(notes)


def meaconed(test):
    """Keys and what they leave out: tests of meaconing, where a spoofer is at a receiver's position and late."""
    name, description = test["name"], test["description"]
    north_deg, east_deg = 1 / 111_560, 1 / 39_540
    top_w = float(test["max_power_w"]) or 10

    def at(place_m, power_w, begin=BEGIN_S, end=None):
        place = {"kind": "static", "latitude_deg": round(69.27547832 + place_m[0] * north_deg, 8),
                 "longitude_deg": round(15.96832496 + place_m[1] * east_deg, 8), "height_m": 35}
        power = {"power_db": round(dbw(power_w) - 96.4 - SATELLITE_DBW, 1), "on_s": begin}
        return power | ({"off_s": end} if end else {}) | {"clock_bias_s": -DELAY_S, "motion": place}

    both = [at(RX1_M, top_w), at(RX2_M, top_w)]
    notes = ["receivers 300 m from the antenna, 1 µs late, heard at 1 km"]
    growth = {"power_start_db": round(-30 - 96.4 - SATELLITE_DBW, 1), "ramp_s": 16}
    if "alternating" in name:
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
    if "jamming" in f"{name} {description}":
        jammer = {"kind": "noise", "bandwidth_hz": 3e6, "center_hz": L1_HZ, "distance_m": HIGH_POWER_M,
                  "eirp_dbw": 0 if "30 dBm" in description else 17}
        pauses = [(BEGIN_S + 4, BEGIN_S + 8), (BEGIN_S + 12, BEGIN_S + 16)] if "in breaks" in name else [(26, BEGIN_S)]
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
        return json.dumps(value, ensure_ascii=False)
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
                    tell = {1: lambda test: jammed(test, known), 2: spoofed, 3: meaconed}[kind["type_id"]]
                    keys, note = tell(test)
                    reason = note if keys is None else None
                head = f"name = {toml(code)}\ngroup = {toml(title)}\n"
                if keys is None:
                    unsaid.append(f"[[not_said]]\n{head}description = {toml(name)}\nreason = {toml(reason)}\n")
                    continue
                text = f"{name} ({note})" if note else name
                scene = keys.pop("scene", "base.toml")
                lines = "".join(f"set.{key} = {toml(value)}\n" for key, value in keys.items())
                entries.append(f"[[entry]]\n{head}description = {toml(text)}\nscene = {toml(scene)}\n{lines}")
    top = (
        "# Made by `packaging/jammertest.py --write` from data/jammertest: edit the script, not this file.\n"
        'name = "jammertest"\n'
        'title = "Jammertest: the catalogue of tests as scenes of GPS L1"\n'
        'like = "Jammertest 2024 of the Norwegian Public Roads Administration and others. Times are compressed to '
        f'scenes of a minute, distances are assumed where the catalogue has none ({LOW_POWER_M} m, {HIGH_POWER_M} m '
        'for F8.1, 30 m in a motorcade and on a ship), and sources outside the band of GPS L1 are left out."\n'
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
