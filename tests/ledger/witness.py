"""Figures of tests that hold the program against sources from outside: what they measure, and the bounds that they assert."""

import make
from figure import Figure

TESTS = "cargo test --locked --test planted witness:: -- --nocapture --test-threads 1"
ORBITS = ("src/gnss/broadcast", "src/gnss/orbit.rs", "src/gnss/time")


def measured():
    """What tests print: id, words, unit, the test and what follows its name, rooms."""
    rows = [
        ("gps.orbit.2010", "GPS broadcast orbits against IGS final ones, 2010-07-01, 3-D rms", "m",
         r"broadcast_orbits_of_2010_\w+ \.\.\.[^\n]*?\n?[^\n]*?points: orbit ([\d.]+) m", "gps"),
        ("gps.clock.2010", "GPS broadcast clocks against IGS final ones, 2010-07-01, rms", "m",
         r"broadcast_orbits_of_2010_\w+ \.\.\.[^\n]*?\n?[^\n]*?points: orbit .*?clock ([\d.]+) m", "gps"),
        ("beidou.orbit", "BeiDou broadcast orbits against CODE's, 3-D rms", "m", r"satellites, \d+ points: ([\d.]+) m rms", "beidou"),
        ("qzss.neighbours", "neighbouring ephemerides of QZSS half way between, rms", "m",
         r"qzss::(?:(?!\ntest ).)*?\d+ pairs: ([\d.]+) m rms", "qzss"),
        ("sbas.neighbours", "neighbouring ephemerides of WAAS half way between, rms", "m",
         r"sbas::(?:(?!\ntest ).)*?\d+ pairs: ([\d.]+) m rms", "sbas"),
    ]
    for name, what, unit, pattern, folder in rows:
        yield Figure(f"witness.{name}", what, unit, make.Script(TESTS, f"(?s){pattern}"), (f"src/gnss/{folder}", *ORBITS))


def asserted():
    """Bounds: id, words, unit, file of the test, what the bound stands behind."""
    rows = [
        ("klobuchar", "Klobuchar's delay against published values", "m", "tests/witness/atmosphere.rs", r"6\.735_905_320_994_38\)\.abs\(\) < (\S+),"),
        ("nequick", "NeQuick-G against its document's test cases", "TECU", "src/gnss/nequick/tests.rs", r"\(got - expected\)\.abs\(\) < (\S+),"),
        ("bdgim", "BDGIM against its authors' program", "TECU", "tests/witness/bdgim.rs", r"5\.818_458_961\)\.abs\(\) < (\S+),"),
        ("ionex", "values of an IONEX map against the file", "TECU", "src/gnss/ionex/tests.rs", r"\(found - printed\)\.abs\(\) < (\S+),"),
        ("glonass.orbit.first", "GLONASS broadcast orbits against CODE's, 2020-11-29, 3-D rms, at most", "m", "tests/witness/glonass.rs",
         r"points >= 60 && \([\d.]+\.\.([\d.]+)\)"),
        ("glonass.orbit.second", "GLONASS broadcast orbits against CODE's, 2020-06-25, 3-D rms, at most", "m", "tests/witness/glonass.rs",
         r"points > 2500 && \([\d.]+\.\.([\d.]+)\)"),
        ("glonass.clock.first", "GLONASS broadcast clocks against CODE's, 2020-11-29, rms, at most", "m", "tests/witness/glonass.rs",
         r"clock_rms_m < (0\.2),"),
        ("glonass.clock.second", "GLONASS broadcast clocks against CODE's, 2020-06-25, rms, at most", "m", "tests/witness/glonass.rs",
         r"clock_rms_m < (0\.8),"),
        ("e5.code_apart", "codes of E5a and E5b in a recording, apart at most", "chip", "tests/witness/recording_e5.rs", r"apart\.abs\(\) < ([\d.]+) &&"),
        ("e5.pilot_phase", "phase between the pilots of E5a and E5b in a recording, off at most", "cycle", "tests/witness/recording_e5.rs",
         r"cycles\.abs\(\) < ([\d.]+),"),
    ]
    for name, what, unit, test, pattern in rows:
        yield Figure(f"witness.{name}", what, unit, make.Asserted(test, pattern))


def figures():
    yield from measured()
    yield from asserted()
