#!/usr/bin/env python3
"""Logs of real receivers as `gnss-twin logs` and `gnss-twin analyze --log` read them, against other programs.

Every field of every message of the shipped logs (and of those in $GNSS_TWIN_DATA) is compared with the reading of pyubx2 and
pyrtcm. Then a run's own observations and positions are written as UBX (by pyubx2), as MSM7 of RTCM 3 and as SBF (by this
script, read again by pyrtcm and pysbf2), and the judge must give the verdict of the RINEX and NMEA files that they came from.

What `gnss-twin rtcm` writes is read by pyrtcm, every message and field as the program's own reader has it, and by RTKLIB's convbin,
whose observations and ephemerides must be those of the run's own RINEX files to the resolution of MSM4 and MSM7. RTKLIB's str2str
gets the same stream from the program's caster, and its rnx2rtkp finds the antenna by it.

usage: tests/logs.py PROGRAM      the environment needs pyubx2, pyrtcm, pysbf2 and RTKLIB: tests/logs.sh makes one
exit:  0 all fields are equal; 1 they are not.
"""
import collections
import csv
import datetime
import json
import math
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

from pyrtcm import RTCM_DATA_FIELDS, RTCMReader
from pysbf2 import SBFReader
from pyubx2 import GET, UBXMessage, UBXReader

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Message names of one program and the other.
NAMES = {"SEC-SIG-2": "SEC-SIG"}
COLUMNS = {"sec": "second"}
LIGHT_MPS = 299792458.0
WAVE_M = LIGHT_MPS / 1575.42e6
# Figures of foreign.json, and how far the resolution of the logs' fields may move them: 1 mm of a range, 1/1000 cycle of a
# carrier, 0.5 mHz of Doppler, half a dB-Hz of C/N0, 1 mm of a position in NMEA.
CLOSED = [("code", "rms_m", 1e-4), ("carrier", "rms_cycles", 1e-5), ("doppler", "rms_hz", 1e-4), ("cn0", "bias_db", 0.5),
          ("position", "horizontal_rms_m", 0.001), ("position", "up_rms_m", 0.001)]
RINEX_START = datetime.datetime(1980, 1, 6)


def program(*arguments, expect=0):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != expect:
        sys.exit(f"logs: {' '.join(map(str, arguments))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def object_of(*arguments):
    """Object that the program prints with --json."""
    done = subprocess.run([PROGRAM, *map(str, arguments), "--json"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"logs: {' '.join(map(str, arguments))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return json.loads(done.stdout)


def tables(directory):
    """Rows of each table by message name and by the byte at which the frame begins."""
    found = {}
    for path in sorted(directory.glob("*.csv")):
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                found.setdefault(path.stem, {}).setdefault(int(row["byte"]), []).append(row)
    return found


def is_same(cell, value):
    if cell == "":
        return False
    if isinstance(value, float) and math.isnan(value):
        return cell == "NaN"
    # Scaled numbers: the other program rounds to 12 decimals.
    return math.isclose(float(cell), value, rel_tol=1e-12, abs_tol=1.1e-12)


def compare_ubx(path, found):
    """Compares a log field by field; returns the fields compared."""
    known = {name: sorted(frames.items()) for name, frames in found.items()}
    compared = 0
    for name in known:
        if name in ("observations", "fixes"):
            continue
        version = {"SEC-SIG": 1, "SEC-SIG-2": 2}.get(name)
        wanted = [message for _, message in UBXReader(open(path, "rb"), protfilter=2)
                  if message and message.identity == NAMES.get(name, name) and version in (None, getattr(message, "version", None))]
        if len(wanted) != len(known[name]):
            sys.exit(f"logs: {path.name}: {len(known[name])} of {len(wanted)} {name}")
        for (byte, rows), message in zip(known[name], wanted):
            fields = {key: value for key, value in vars(message).items()
                      if not key.startswith("_") and not key.startswith("reserved")}
            for key, value in fields.items():
                base, _, index = key.rpartition("_")
                row, column = (rows[int(index) - 1], base) if index.isdigit() and base else (rows[0], key)
                column = {other: own for own, other in COLUMNS.items()}.get(column, column)
                if column not in row:
                    sys.exit(f"logs: {path.name}: {name} has no {column}")
                if isinstance(value, (int, float)):
                    high = row.get(column + "Hp")
                    if high is not None:
                        same = math.isclose(float(row[column]) + float(high), value, rel_tol=1e-12, abs_tol=1e-9)
                    else:
                        same = is_same(row[column], value)
                    if not same:
                        sys.exit(f"logs: {path.name}: byte {byte}: {name} {key} = {row[column]}, expected {value}")
                    compared += 1
    return compared


EPOCHS = ("DF004", "DF248", "DF427", "DF428", "DF546")
# Fields of MSM by satellite and by signal, with the raw value that says that there is none, and the scale.
SATELLITE = {"DF397": 255, "DF398": None, "DF399": -8192}
SIGNAL = {"DF400": -2**14 * 2.0**-24, "DF401": -2**21 * 2.0**-29, "DF402": None, "DF403": 0, "DF405": -2**19 * 2.0**-29,
          "DF406": -2**23 * 2.0**-31, "DF407": None, "DF408": 0, "DF404": -2**14 * 1e-4, "DF420": None}
NUMBERS = {"110": 100, "111": 192}


# Fields of 1020 whose scale pyrtcm leaves out.
UNSCALED = {"DF121": 2.0**-40, "DF124": 2.0**-30, "DF125": 2.0**-30, "DF133": 2.0**-31, "DF135": 2.0**-30}


def expect(path, byte, name, column, cell, value, absent=None):
    if absent is not None and math.isclose(value, absent):
        same = cell == ""
    else:
        same = cell == str(value) or cell != "" and not isinstance(value, str) and is_same(cell, value)
    if not same:
        sys.exit(f"logs: {path.name}: byte {byte}: {name} {column} = {cell!r}, expected {value}")
    return 1


def compare_msm(path, byte, rows, message):
    """One multiple signal message; returns the fields compared."""
    name, field = message.identity, lambda key: getattr(message, key, None)
    time = next((field(key) for key in EPOCHS if field(key) is not None), None)
    if time is None:
        time = field("DF416") << 27 | field("DF034")
    count = expect(path, byte, name, "epoch", rows[0]["epoch"], time)
    for key in ("DF002", "DF003", "DF393", "DF409", "DF411", "DF412", "DF417", "DF418"):
        count += expect(path, byte, name, key, rows[0][key], field(key))
    if len(rows) != max(message.NCell, 1):
        sys.exit(f"logs: {path.name}: byte {byte}: {name} has {len(rows)} rows, expected {message.NCell}")
    places = {field(f"PRN_{index:02d}"): index for index in range(1, message.NSat + 1)}
    for index in range(1, message.NCell + 1):
        row, prn = rows[index - 1], field(f"CELLPRN_{index:02d}")
        if row["sv"]:
            count += expect(path, byte, name, "sv", str(int(row["sv"][1:]) + NUMBERS.get(name[:3], 0)), int(prn))
        count += expect(path, byte, name, "signal", row["signal"], field(f"CELLSIG_{index:02d}"))
        for key, absent in SATELLITE.items():
            value = field(f"{key}_{places[prn]:02d}")
            if value is not None:
                count += expect(path, byte, name, key, row[key], value, absent)
        for key in ("ExtSatInfo", "DF419"):
            value = field(f"{key}_{places[prn]:02d}")
            if value is not None:
                count += expect(path, byte, name, key, row["extended"], value)
        for key, absent in SIGNAL.items():
            value = field(f"{key}_{index:02d}")
            if value is not None:
                count += expect(path, byte, name, key, row[key], value, absent)
    return count


def compare_rtcm(path, found):
    compared = 0
    for name, frames in found.items():
        if not name.isdigit():
            continue
        wanted = [message for _, message in RTCMReader(open(path, "rb")) if message and message.identity == name]
        if len(wanted) != len(frames):
            sys.exit(f"logs: {path.name}: {len(frames)} of {len(wanted)} {name}")
        for (byte, rows), message in zip(sorted(frames.items()), wanted):
            if hasattr(message, "NCell"):
                compared += compare_msm(path, byte, rows, message)
                continue
            values = {}
            for key, value in vars(message).items():
                base, _, index = key.partition("_")
                if isinstance(value, str) and index:
                    values[base] = values.get(base, "") + value
                elif base == "DF422":
                    values[base] = values.get(base, 0) << 1 | value
                elif base.startswith("DF") and base != "DF001":
                    values[key] = value
            for column, cell in rows[0].items():
                if column == "byte" or cell == "" and column not in values:
                    continue
                value = values.get(column)
                step = RTCM_DATA_FIELDS.get(column, (None, 0, 0))[2]
                if column in UNSCALED:
                    step = UNSCALED[column]
                    value *= step
                if 0 < step < 1e-4:
                    # Small numbers in steps, which are whole.
                    cell, value = str(float(cell) / step), value / step
                # The text that fits the number of its characters.
                compared += expect(path, byte, name, column, cell, value)
    return compared


def logs(kind, suffix):
    shipped = sorted((ROOT / "data/witness/logs").glob(f"*.{suffix}"))
    outside = pathlib.Path(os.environ.get("GNSS_TWIN_DATA", ROOT / "../shared/data")) / kind
    found = sorted(path for path in outside.glob("*") if path.suffix in (".log", ".bin", f".{suffix}"))
    if not found:
        print(f"logs: skipped: no logs in {outside}", file=sys.stderr)
    # Those that the repository ships are there, too.
    known = {path.read_bytes() for path in shipped}
    return shipped + [path for path in found if path.read_bytes() not in known]


def witness(work, kind, suffix, compare):
    total = 0
    for path in logs(kind, suffix):
        out = work / f"{path.stem}-{kind}-{path.suffix[1:]}"
        program("logs", path, "--out", out, "--quiet")
        total += compare(path, tables(out))
    if total == 0:
        sys.exit(f"logs: no field of {kind} compared")
    return total


def read_rinex(path):
    """Epochs of a RINEX 3 file of one GPS signal: time, then satellite to (code, carrier, lost lock, Doppler, C/N0)."""
    epochs, codes, head = [], {}, True
    for line in open(path):
        if head:
            if line[60:].startswith("SYS / # / OBS TYPES"):
                codes[line[0]] = line[7:58].split()
            head = "END OF HEADER" not in line
        elif line.startswith(">"):
            part = line[1:].split()
            second = float(part[5])
            at = datetime.datetime(*map(int, part[:5])) + datetime.timedelta(seconds=math.floor(second))
            epochs.append(((at - RINEX_START).total_seconds(), second % 1, {}))
        else:
            values = {}
            for index, code in enumerate(codes[line[0]]):
                text = line[3 + 16 * index:19 + 16 * index]
                if text[:14].strip():
                    values[code] = (float(text[:14]), text[14:15] == "1")
            epochs[-1][2][line[:3]] = values
    return epochs


def ubx_observations(epochs):
    """RXM-RAWX of epochs; C/N0 has a resolution of 1 dB there and the rest none that matters."""
    locked, before, frames = {}, {}, []
    for whole, fraction, values in epochs:
        at = whole + fraction
        fields = {"rcvTow": whole % 604800 + fraction, "week": int(whole // 604800), "leapS": 18, "numMeas": len(values)}
        for index, (sv, own) in enumerate(sorted(values.items()), 1):
            if own["L1C"][1] or sv not in before or at - before[sv] > 30:
                locked[sv] = at
            before[sv] = at
            each = {"prMes": own["C1C"][0], "cpMes": own["L1C"][0], "doMes": own["D1C"][0], "gnssId": 0, "svId": int(sv[1:]),
                    "sigId": 0, "freqId": 0, "locktime": min(64500, round(1000 * (at - locked[sv]))),
                    "cno": round(own["S1C"][0]), "prStd": 1, "cpStd": 1, "doStd": 1, "prValid": 1, "cpValid": 1, "halfCyc": 1}
            fields.update({f"{key}_{index:02d}": value for key, value in each.items()})
        frames.append(UBXMessage("RXM", "RXM-RAWX", GET, **fields).serialize())
    return frames


def geodetic(x, y, z):
    """Latitude and longitude in radians and height in metres of WGS 84 (iterated to a micrometre)."""
    a, e2 = 6378137.0, (2 - 1 / 298.257223563) / 298.257223563
    p = math.hypot(x, y)
    latitude = math.atan2(z, p * (1 - e2))
    for _ in range(10):
        n = a / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
        height = p / math.cos(latitude) - n
        latitude = math.atan2(z, p * (1 - e2 * n / (n + height)))
    return latitude, math.atan2(y, x), height


def ubx_positions(fixes, leap_s):
    """NAV-PVT of the rows of rx/fixes.csv."""
    frames = []
    for row in fixes:
        number = {key: float(value) for key, value in row.items() if value and key.endswith(("_m", "_mps", "_s"))}
        second, fraction = int(row["gps_s"]), number["gps_fraction_s"]
        # The nearest whole second, and the rest in nanoseconds, which may be negative.
        carry = round(fraction)
        date = RINEX_START + datetime.timedelta(seconds=second + carry - leap_s)
        latitude, longitude, height = geodetic(number["x_m"], number["y_m"], number["z_m"])
        velocity = [number[key] for key in ("vx_mps", "vy_mps", "vz_mps")]
        sin, cos, sinl, cosl = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
        axes = ((-sin * cosl, -sin * sinl, cos), (-sinl, cosl, 0), (-cos * cosl, -cos * sinl, -sin))
        north, east, down = (sum(a * v for a, v in zip(axis, velocity)) for axis in axes)
        sigma = math.hypot(number["sigma_east_m"], number["sigma_north_m"])
        fields = {"iTOW": round(1000 * (second % 604800 + fraction)), "year": date.year, "month": date.month,
                  "day": date.day, "hour": date.hour, "min": date.minute, "second": date.second, "validDate": 1,
                  "validTime": 1, "fullyResolved": 1, "nano": round(1e9 * (fraction - carry)), "fixType": 3,
                  "gnssFixOk": 1, "numSV": int(row["satellites"]), "lon": round(math.degrees(longitude), 7),
                  "lat": round(math.degrees(latitude), 7), "height": round(1000 * height), "velN": round(1000 * north),
                  "velE": round(1000 * east), "velD": round(1000 * down), "hAcc": round(1000 * sigma),
                  "vAcc": round(1000 * number["sigma_up_m"]), "sAcc": 100, "tAcc": 30}
        frames.append(UBXMessage("NAV", "NAV-PVT", GET, **fields).serialize())
        # The further digits, as the interface description has them: numbers of whole units and of hundredths or tenths.
        digits = [round(math.degrees(longitude) * 1e9), round(math.degrees(latitude) * 1e9), round(1e4 * height)]
        parts = [round(digits[0] / 100), round(digits[1] / 100), round(digits[2] / 10)]
        rest = [digits[0] - 100 * parts[0], digits[1] - 100 * parts[1], digits[2] - 10 * parts[2]]
        payload = struct.pack("<BHBIiiiibbbbII", 0, 0, 0, fields["iTOW"], *parts, parts[2], *rest, rest[2], 0, 0)
        frames.append(UBXMessage("NAV", "NAV-HPPOSLLH", GET, payload=payload).serialize())
    return frames


class Arcs:
    """Whole cycles that bring each arc's carrier near its code, and the time of its lock."""

    def __init__(self):
        self.of, self.before = {}, {}

    def carrier(self, sv, at, own):
        """Carrier near the code in cycles, and the seconds since the lock began."""
        cycles, lost = own["L1C"]
        if lost or at - self.before.get(sv, -1e9) > 30:
            self.of[sv] = round(cycles - own["C1C"][0] / WAVE_M), at
        self.before[sv] = at
        whole, since = self.of[sv]
        return cycles - whole, at - since


def rtcm_observations(epochs):
    """MSM7 of GPS L1 C/A (RTCM 10403.3, 3.5.16)."""
    arcs, frames = Arcs(), []
    for whole, fraction, values in epochs:
        numbers = sorted(int(sv[1:]) for sv in values)
        bits = [(1077, 12), (0, 12), (round(1000 * (whole % 604800 + fraction)), 30), (0, 19),
                (sum(1 << (64 - number) for number in numbers), 64), (1 << 30, 32), ((1 << len(numbers)) - 1, len(numbers))]
        rows = []
        for number in numbers:
            own = values[f"G{number:02d}"]
            milliseconds = own["C1C"][0] / LIGHT_MPS * 1e3
            rough = round(milliseconds * 1024)
            cycles, lock = arcs.carrier(number, whole + fraction, own)
            rate = -own["D1C"][0] * WAVE_M
            indicator = max(one for one in range(704) if lock_ms(one) <= round(1000 * lock))
            rows.append((rough >> 10, 0, rough & 1023, round(rate), round((milliseconds - rough / 1024) * 2**29),
                         round((cycles * WAVE_M / LIGHT_MPS * 1e3 - rough / 1024) * 2**31), indicator, 0,
                         round(16 * own["S1C"][0]), round((rate - round(rate)) * 1e4)))
        for field, width in enumerate((8, 4, 10, 14, 20, 24, 10, 1, 10, 15)):
            bits += [(row[field], width) for row in rows]
        text = "".join(format(value & ((1 << width) - 1), f"0{width}b") for value, width in bits)
        text += "0" * (-len(text) % 8)
        body = int(text, 2).to_bytes(len(text) // 8, "big")
        frame = b"\xd3" + struct.pack(">H", len(body)) + body
        frames.append(frame + crc24q(frame).to_bytes(3, "big"))
    return frames


def lock_ms(indicator):
    doublings = max((indicator >> 5) - 1, 0)
    return indicator - 32 * doublings << doublings


def crc24q(data):
    crc = 0
    for byte in data:
        crc ^= byte << 16
        for _ in range(8):
            crc = crc << 1 ^ (0x1864CFB if crc & 0x800000 else 0)
    return crc


def block(number, body):
    """Block of SBF."""
    body += bytes(-len(body) % 4)
    tail = struct.pack("<HH", number, 8 + len(body)) + body
    crc = 0
    for byte in tail:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return b"$@" + struct.pack("<H", crc) + tail


def sbf_observations(epochs):
    """MeasEpoch of GPS L1 C/A."""
    arcs, blocks = Arcs(), []
    for whole, fraction, values in epochs:
        body = struct.pack("<IHBBBBBB", round(1000 * (whole % 604800 + fraction)), int(whole // 604800), len(values), 20, 12, 0,
                           0, 0)
        for sv, own in sorted(values.items()):
            cycles, lock = arcs.carrier(sv, whole + fraction, own)
            millimetres = round(1000 * own["C1C"][0])
            offset = round(1000 * (cycles - 1e-3 * millimetres / WAVE_M))
            body += struct.pack("<BBBBIiHbBHBB", 1, 0, int(sv[1:]), millimetres >> 32, millimetres & 0xFFFFFFFF,
                                round(1e4 * own["D1C"][0]), offset & 0xFFFF, offset >> 16, round(4 * (own["S1C"][0] - 10)),
                                int(lock), 0, 0)
        blocks.append(block(4027, body))
    return blocks


def sbf_positions(fixes):
    """PVTCartesian of the rows of rx/fixes.csv: the clock's bias is what the whole millisecond leaves."""
    blocks = []
    for row in fixes:
        second, fraction = int(row["gps_s"]), float(row["gps_fraction_s"])
        tow_ms = round(1000 * (second % 604800 + fraction))
        bias_ms = tow_ms - 1000 * (second % 604800 + fraction)
        place = [float(row[key]) for key in ("x_m", "y_m", "z_m")]
        velocity = [float(row[key]) for key in ("vx_mps", "vy_mps", "vz_mps")]
        blocks.append(block(4006, struct.pack("<IHBB3df3ffdfBBBBHHIBBHHHHB", tow_ms, second // 604800, 1, 0, *place, -2e10,
                                              *velocity, -2e10, bias_ms, 0, 0, 0, int(row["satellites"]), 0, 0, 65535, 0, 0,
                                              0, 0, 0, 100, 150, 0)))
    return blocks


def compare_sbf(path, found):
    """Blocks that this script has written, by pysbf2: fields of PVTCartesian, and of MeasEpoch's first signals."""
    compared = 0
    parsed = [message for _, message in SBFReader(open(path, "rb"), quitonerror=2) if message]
    for name, identity in (("PVTCartesian", "PVTCartesian"), ("MeasEpoch", "MeasEpoch")):
        wanted = [message for message in parsed if message.identity.startswith(identity)]
        if len(wanted) != len(found[name]):
            sys.exit(f"logs: {path.name}: {len(found[name])} of {len(wanted)} {name}")
        for (byte, rows), message in zip(sorted(found[name].items()), wanted):
            if name == "PVTCartesian":
                for column, cell in rows[0].items():
                    value = getattr(message, column, None)
                    if isinstance(value, (int, float)):
                        compared += expect(path, byte, name, column, cell, value)
                continue
            for index, row in enumerate(rows, 1):
                field = lambda key: getattr(message, f"{key}_{index:02d}")
                range_m = field("CodeMSB") + field("CodeLSB")
                carrier = range_m / WAVE_M + field("CarrierMSB") + field("CarrierLSB")
                for column, value in (("PR", range_m), ("L", carrier), ("Doppler", field("Doppler")), ("SVID", field("SVID")),
                                      ("CN0", field("CN0") + 10), ("LockTime", field("LockTime"))):
                    compared += expect(path, byte, name, column, row[column], value)
    return compared


def verdict(directory):
    with open(directory / "foreign_verdict.csv", newline="") as file:
        return list(csv.DictReader(file))


def closed_loop(work):
    """Verdicts by RINEX and NMEA and by logs of the same observations and positions; returns rows and fields of SBF."""
    scene = ROOT / "scenarios/static.toml"
    program("run", scene, "--level", "correlations", "--out", work / "run", "--report", "none", "--quiet")
    rinex, nmea, truth = work / "run/rx/observations.rnx", work / "run/rx/fixes.nmea", work / "run/truth"
    with open(work / "run/rx/fixes.csv", newline="") as file:
        fixes = list(csv.DictReader(file))
    epochs = read_rinex(rinex)
    program("analyze", "--truth", truth, "--rinex-obs", rinex, "--nmea", nmea, "--out", work / "files", "--report", "none")
    rows = 0
    for form, frames, more, counted in [
            ("ubx", ubx_observations(epochs) + ubx_positions(fixes, 15), [], f"NAV-PVT {len(fixes)}, RXM-RAWX {len(epochs)}"),
            ("rtcm3", rtcm_observations(epochs), ["--nmea", nmea], f"1077 {len(epochs)}"),
            ("sbf", sbf_observations(epochs) + sbf_positions(fixes), [], f"MeasEpoch {len(epochs)}, PVTCartesian {len(fixes)}")]:
        log = work / f"closed.{form}"
        log.write_bytes(b"".join(frames))
        told = program("analyze", "--truth", truth, "--log", log, *more, "--out", work / form, "--report", "none")
        if counted not in told:
            sys.exit(f"logs: not all messages are counted, expected {counted}:\n{told}")
        rows += same_verdict(work / "files", work / form, form)
    program("logs", work / "closed.rtcm3", "--out", work / "closed-rtcm3", "--quiet")
    compare_rtcm(work / "closed.rtcm3", tables(work / "closed-rtcm3"))
    program("logs", work / "closed.sbf", "--out", work / "closed-sbf", "--quiet")
    return rows, compare_sbf(work / "closed.sbf", tables(work / "closed-sbf"))


def same_verdict(files, log, form):
    one, other = verdict(files), verdict(log)
    if [row["figure"] for row in one] != [row["figure"] for row in other]:
        sys.exit(f"logs: {form}: other rows: {set(row['figure'] for row in one) ^ set(row['figure'] for row in other)}")
    for row, again in zip(one, other):
        if row["status"] != again["status"]:
            sys.exit(f"logs: {row['figure']}: {row['status']} by RINEX and NMEA, {again['status']} by {form}")
    for group, figure, resolution in CLOSED:
        values = [json.loads((where / "foreign.json").read_text())[group][figure] for where in (files, log)]
        if abs(values[0] - values[1]) > resolution:
            sys.exit(f"logs: {group}.{figure}: {values[0]} by RINEX and NMEA, {values[1]} by {form}")
    return len(one)


def refusals(work):
    """Logs without anything to judge, and files that are none, are refused by name."""
    shipped = ROOT / "data/witness/logs"
    truth = work / "run/truth"
    for name, told in [("MON.ubx", "expected NAV-PVT for positions or RXM-RAWX for observations"),
                       ("RXMRAWX.ubx", "have no truth"), ("../e1_codes.csv", "no frame of UBX, RTCM 3 or SBF")]:
        words = program("analyze", "--truth", truth, "--log", shipped / name, "--out", work / "no", expect=65)
        if told not in words or name.rpartition("/")[2] not in words:
            sys.exit(f"logs: {name}: refused by {words!r}, expected {told!r}")


# Signals of four systems, for which RTKLIB has two carriers each, and the front ends that receive them: name, middle and rate.
# GPS has one: the level of correlations does not model L2C.
FOUR = (["GPS L1 C/A", "Galileo E1", "Galileo E5b", "GLONASS G1", "GLONASS G2", "BeiDou B1I", "BeiDou B2I"],
        [("l1", 1575.42e6, 4.2e6), ("b1", 1561.098e6, 4.2e6), ("g1", 1602e6, 9e6), ("b2", 1207.14e6, 21.3e6),
         ("g2", 1246e6, 7.2e6)])
DAY = "2020-11-29T12:50:13"
MS_M = LIGHT_MPS / 1e3
CARRIERS = {"G1": 1575.42e6, "G2": 1227.6e6, "E1": 1575.42e6, "E7": 1207.14e6, "C2": 1561.098e6, "C7": 1207.14e6}


def corr(work, name, start, duration_s, signals, front_ends):
    """A run by modelled correlations over Cartagena, without an ionosphere; returns its directory."""
    text = f'name = "{name}"\nstart = {start}\nduration_s = {duration_s}\nseed = 1\nsignals = {json.dumps(signals)}\n'
    text += ('[motion]\nkind = "static"\nlatitude_deg = 37.605\nlongitude_deg = -0.986\nheight_m = 60\n[satellites]\nmask_deg = 5\n'
             '[power]\nkind = "link_budget"\n[troposphere]\nmodel = "saastamoinen"\n[receiver_clock]\nbias_s = 1.3e-4\n'
             'drift_sps = 5e-8\n[noise]\n')
    text += "".join(f'[[front_end]]\nname = "{front_end}"\ncenter_hz = {centre}\nsample_rate_hz = {rate}\nformat = "ci8"\n'
                    for front_end, centre, rate in front_ends)
    (work / f"{name}.toml").write_text(text)
    program("run", work / f"{name}.toml", "--level", "correlations", "--out", work / name, "--report", "none", "--quiet")
    return work / name


def channel_hz(sv, band, channels):
    return CARRIERS.get(sv[0] + band) or (1602e6 + 562.5e3 * channels[sv] if band == "1" else 1246e6 + 437.5e3 * channels[sv])


def channels_of(path):
    found = {}
    for line in open(path):
        if line[60:].startswith("GLONASS SLOT / FRQ #"):
            words = line[4:60].split()
            found.update({slot: int(channel) for slot, channel in zip(words[::2], words[1::2])})
        if "END OF HEADER" in line:
            return found


def own_streams(work, runs):
    """What the program writes, by pyrtcm and the program's own reader; returns the fields compared."""
    compared, seen = 0, set()
    for run, messages, start in runs:
        log = work / f"{run.name}-{messages.split(',')[0]}.rtcm3"
        told = object_of("rtcm", run, "--out", log, "--messages", messages, "--station", 2003)
        found = work / log.stem
        counts = object_of("logs", log, "--out", found, "--near", start)
        own = {message["message"].split()[0]: message["count"] for message in counts["messages"]}
        other = collections.Counter(message.identity for _, message in RTCMReader(open(log, "rb")) if message)
        if not own == dict(other) == told["messages"] or counts["undated"] or counts["protocols"][0]["damaged"]:
            sys.exit(f"logs: {log.name}: {told['messages']} written, {own} read, {dict(other)} by pyrtcm, {counts['undated']} without a date")
        if any(message["read"] != message["count"] for message in counts["messages"]):
            sys.exit(f"logs: {log.name}: not all messages were read: {counts['messages']}")
        compared += compare_rtcm(log, tables(found))
        seen |= own.keys()
    wanted = {"1005", "1006", "1033", "1230", "1019", "1020", "1041", "1042", "1044", "1045", "1046", "1107"}
    wanted |= {f"1{system}{level}" for system in ("07", "08", "09", "11", "12", "13") for level in (4, 7)}
    if not wanted <= seen:
        sys.exit(f"logs: messages that no stream had: {sorted(wanted - seen)}")
    return compared


def rtklib_rinex(work, log):
    """Observations and ephemerides of a stream by RTKLIB's convbin: paths of both files."""
    paths = work / f"{log.stem}.obs", work / f"{log.stem}.nav"
    done = subprocess.run(["convbin", "-r", "rtcm3", "-v", "3.04", "-od", "-os", "-tr", "2020/11/29", "12:00:00", "-o", paths[0], "-n", paths[1], log],
                          capture_output=True, text=True)
    if done.returncode or not all(path.is_file() for path in paths):
        sys.exit(f"logs: convbin failed: {done.stderr}")
    return paths


def same_observations(own, other, channels, level):
    """Observations of two RINEX files to the resolution of MSM4 or MSM7; returns the number of values and the largest differences."""
    code_m, carrier_m, power = {4: (2**-24 * MS_M, 2**-29 * MS_M, 1), 7: (2**-29 * MS_M, 2**-31 * MS_M, 1 / 16)}[level]
    other = {round(1000 * (whole + fraction)): values for whole, fraction, values in other}
    compared, whole_cycles, worst = 0, {}, dict.fromkeys("CLDS", 0.0)
    for whole, fraction, values in own:
        label = round(1000 * (whole + fraction))
        # The receiver's label is given as a whole millisecond, and ranges with it.
        later_s = (label - 1000 * whole) / 1000 - fraction
        if label not in other or other[label].keys() != values.keys():
            sys.exit(f"logs: RTKLIB has other satellites at {label} ms: {sorted(other.get(label, {}))}, expected {sorted(values)}")
        for sv, row in values.items():
            for code, (value, lost) in row.items():
                hz = channel_hz(sv, code[1], channels)
                found = other[label][sv].get(code, (None, None))[0]
                if found is None and code[0] == "D" and level == 4:
                    continue
                if found is None:
                    sys.exit(f"logs: RTKLIB has no {code} of {sv} at {label} ms")
                difference = found - value
                # Both files print thousandths.
                if code[0] == "C":
                    difference -= LIGHT_MPS * later_s
                    bar = code_m / 2 + 1.1e-3
                elif code[0] == "L":
                    difference -= hz * later_s
                    if lost or (sv, code) not in whole_cycles:
                        whole_cycles[sv, code] = round(difference)
                    difference -= whole_cycles[sv, code]
                    bar = carrier_m / 2 / LIGHT_MPS * hz + 1.1e-3
                elif code[0] == "D":
                    # RTKLIB keeps Dopplers as numbers of 24 bits.
                    bar = 0.5e-4 / LIGHT_MPS * hz + 1.6e-3
                else:
                    # RTKLIB keeps quarters of 1 dB.
                    bar = power / 2 + 0.126
                if abs(difference) > bar:
                    sys.exit(f"logs: {code} of {sv} at {label} ms: {found} by RTKLIB, {value} of the receiver, bar {bar}")
                worst[code[0]] = max(worst[code[0]], abs(difference))
                compared += 1
    return compared, worst


def ephemerides(path):
    """Records of a RINEX 3 navigation file: (satellite, epoch) to the numbers of its lines."""
    found, head = {}, True
    for line in open(path):
        if head:
            head = "END OF HEADER" not in line
            continue
        numbers = [line[at:at + 19].strip().replace("D", "E") for at in range(4, 80, 19)]
        if line[0] != " ":
            key = line[:23]
            found.setdefault(key, []).append([])
            numbers = [line[at:at + 19].strip().replace("D", "E") for at in range(23, 80, 19)]
        found[key][-1].append([float(number) if number else 0.0 for number in numbers])
    return found


def same_ephemerides(own, other):
    """Elements of every ephemeris that the stream had; returns their number."""
    compared = 0
    for key, records in own.items():
        if key not in other:
            sys.exit(f"logs: RTKLIB has no ephemeris of {key}, but {sorted(other)}")
        vector = key[0] == "R"
        # Lines and columns that hold the orbit, the clock and delays: not times of sending and flags that RTCM does not have. RTKLIB
        # prints twelve digits from a tenth on, half a unit of which is 5e-12.
        cells = [(0, 0), (0, 1)] + [(line, column) for line in (1, 2, 3) for column in range(3)]
        if not vector:
            cells = [(0, column) for column in range(3)] + [(line, column) for line in (1, 2, 3, 4) for column in range(4)]
            cells += [(5, 0), (5, 2), (6, 1), (6, 2)]
        for record in records:
            off = [[cell for cell in cells if not math.isclose(record[cell[0]][cell[1]], found[cell[0]][cell[1]], rel_tol=6e-12, abs_tol=1e-20)]
                   for found in other[key]]
            if all(off):
                cell = off[0][0]
                sys.exit(f"logs: ephemeris of {key}: line {cell[0]}, number {cell[1]}: "
                         f"{other[key][0][cell[0]][cell[1]]} by RTKLIB, {record[cell[0]][cell[1]]} of the receiver")
            compared += len(cells)
    return compared


def rtklib(work, run):
    """Observations and ephemerides that RTKLIB reads of the streams; returns numbers of values and of elements."""
    own = run / "rx/observations.rnx"
    values = elements = 0
    for level in (7, 4):
        observations, navigation = rtklib_rinex(work, work / f"four-msm{level}.rtcm3")
        count, worst = same_observations(read_rinex(own), read_rinex(observations), channels_of(own), level)
        values += count
        print(f"logs: MSM{level} by RTKLIB: code {worst['C'] * 1e3:.2f} mm, carrier {worst['L']:.5f} cycles, Doppler {worst['D']:.4f} Hz, "
              f"C/N0 {worst['S']:.3f} dB off at most")
        elements += same_ephemerides(ephemerides(run / "rx/navigation.rnx"), ephemerides(navigation))
    return values, elements


def live(work, run):
    """The stream from the caster by RTKLIB's str2str and the program's client, and RTKLIB's position by it."""
    port = free_port()
    caster = subprocess.Popen([PROGRAM, "rtcm", run, "--caster", f"{port}/TWIN", "--user", "rover:secret", "--messages",
                               "msm7,1006,1033,1230,eph(5)", "--speed", "8", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    caster.stderr.readline()
    address = f"127.0.0.1:{port}/TWIN"
    refused = program("logs", f"ntrip://rover:wrong@{address}", expect=65)
    if "401" not in refused:
        sys.exit(f"logs: a wrong password is answered by {refused!r}")
    # The caster waits for its first client, so str2str gets all of it, and the other one what is sent after it has come.
    client = subprocess.Popen(["str2str", "-in", f"ntrip://rover:secret@{address}", "-out", f"file://{work}/live.rtcm3"],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(0.5)
    told = object_of("logs", f"ntrip://rover:secret@{address}")
    sent = json.loads(caster.communicate(timeout=60)[0])
    time.sleep(1.5)
    client.send_signal(signal.SIGINT)
    client.wait(timeout=20)
    log = work / "live.rtcm3"
    got = collections.Counter(message.identity for _, message in RTCMReader(open(log, "rb")) if message)
    read = {message["message"].split()[0]: message["count"] for message in told["messages"]}
    if dict(got) != sent["messages"]:
        sys.exit(f"logs: str2str got {dict(got)} of the caster's {sent['messages']}")
    if any(read.get(number, 0) < 0.7 * count - 10 for number, count in sent["messages"].items()) or told["protocols"][0]["damaged"] > 1:
        sys.exit(f"logs: the program's client got {told} of the caster's {sent['messages']}")
    if sent["clients"] != 2:
        sys.exit(f"logs: {sent['clients']} clients, expected 2")
    observations, navigation = rtklib_rinex(work, log)
    # The scene has no ionosphere, which RTKLIB would correct for by coefficients of its own.
    (work / "live.conf").write_text("pos1-posmode=single\npos1-ionoopt=off\npos1-tropopt=saas\npos1-navsys=45\nout-solformat=xyz\n")
    done = subprocess.run(["rnx2rtkp", "-k", work / "live.conf", "-o", work / "live.pos", observations, navigation], capture_output=True)
    rows = [line.split() for line in open(work / "live.pos") if not line.startswith("%")]
    with open(run / "truth/trajectory.csv", newline="") as file:
        truth = next(csv.DictReader(file))
    mean = [sum(float(row[2 + axis]) for row in rows) / len(rows) for axis in range(3)] if rows else [math.inf] * 3
    off = math.dist(mean, [float(truth[key]) for key in ("x_m", "y_m", "z_m")])
    if done.returncode or off > 3:
        sys.exit(f"logs: rnx2rtkp by the caster's stream: {len(rows)} positions, {off} m off")
    return sum(got.values()), len(rows), off


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        fields = [witness(work, "ubx", "ubx", compare_ubx), witness(work, "rtcm", "rtcm3", compare_rtcm)]
        rows, blocks = closed_loop(work)
        refusals(work)
        four = corr(work, "four", DAY, 50, *FOUR)
        fnav = corr(work, "fnav", DAY, 75, ["Galileo E5a"], [("e5a", 1176.45e6, 21e6)])
        runs = [(four, "msm7,1005,1033,1230,eph", DAY), (four, "msm4,1006,eph(5)", DAY), (fnav, "msm5,eph", DAY)]
        for scene in ("qzss", "navic", "sbas"):
            path = ROOT / f"scenarios/{scene}.toml"
            start = re.search(r"^start = (\S+)$", path.read_text(), re.M)[1]
            program("run", path, "--level", "correlations", "--out", work / scene, "--report", "none", "--quiet")
            runs += [(work / scene, "msm7,eph", start), (work / scene, "msm4,eph", start)]
        streams = own_streams(work, runs)
        values, elements = rtklib(work, four)
        messages, positions, off = live(work, four)
    print(f"logs: {fields[0]} fields of UBX equal pyubx2's, {fields[1]} of RTCM 3 pyrtcm's, {blocks} of SBF pysbf2's; "
          f"{rows} verdict rows by UBX, RTCM 3 and SBF as by RINEX and NMEA")
    print(f"logs: {streams} fields of own RTCM 3 equal pyrtcm's; {values} observations and {elements} elements by RTKLIB's convbin as in the "
          f"receiver's RINEX; {messages} messages of the caster by str2str, {positions} positions of rnx2rtkp, {off:.2f} m off")
