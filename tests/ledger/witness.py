"""Bounds that tests assert where they hold the program against sources from outside.

The bound is read from the test's source: it holds as long as the test passes, and `.ci/run` runs it.
"""

import make
from figure import Figure

ORBIT, EFFECT = "tests/witness/orbit.rs", "tests/effects/satellite.rs"
BOUND = r"([\d.]+(?:e-?\d+)?)"
# Id, words, unit, file of the test, what stands about the bound.
ROWS = [
    ("gps.orbit.2010", "GPS broadcast orbits against IGS final ones, 2010-07-01, 3-D rms, below", "m", ORBIT,
     rf"1\.8 to 1\.9 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.orbit_rms_m"),
    ("gps.clock.2010", "GPS broadcast clocks against IGS final ones, 2010-07-01, rms, below", "m", ORBIT,
     rf"1\.8 to 1\.9 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.clock_rms_m"),
    ("gps.orbit.2020", "GPS broadcast orbits against CODE's, 2020-11-29, 3-D rms, below", "m", ORBIT,
     rf"1\.39 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.orbit_rms_m"),
    ("gps.clock.2020", "GPS broadcast clocks against CODE's, 2020-11-29, rms, below", "m", ORBIT,
     rf"1\.39 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.clock_rms_m"),
    ("galileo.orbit.2020_11", "Galileo broadcast orbits against CODE's, 2020-11-29, 3-D rms, below", "m", ORBIT,
     rf"1\.17 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.orbit_rms_m"),
    ("galileo.clock.2020_11", "Galileo broadcast clocks against CODE's, 2020-11-29, rms, below", "m", ORBIT,
     rf"1\.17 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.clock_rms_m"),
    ("galileo.orbit.2020_06", "Galileo broadcast orbits against CODE's, 2020-06-25, 3-D rms, below", "m", ORBIT,
     rf"1\.04 m[\s\S]*?\.\.{BOUND}\)\.contains\(&found\.orbit_rms_m"),
    ("beidou.orbit", "BeiDou broadcast orbits against CODE's, 3-D rms, below", "m", "tests/witness/beidou.rs", rf"points > 500 && rms_m < {BOUND},"),
    ("glonass.orbit.first", "GLONASS broadcast orbits against CODE's, 2020-11-29, 3-D rms, below", "m", "tests/witness/glonass.rs",
     rf"points >= 60 && \([\d.]+\.\.{BOUND}\)"),
    ("glonass.orbit.second", "GLONASS broadcast orbits against CODE's, 2020-06-25, 3-D rms, below", "m", "tests/witness/glonass.rs",
     rf"points > 2500 && \([\d.]+\.\.{BOUND}\)"),
    ("glonass.clock.first", "GLONASS broadcast clocks against CODE's, 2020-11-29, rms, below", "m", "tests/witness/glonass.rs",
     rf"points >= 60 [^\n]*\n[^\n]*clock_rms_m < {BOUND},"),
    ("glonass.clock.second", "GLONASS broadcast clocks against CODE's, 2020-06-25, rms, below", "m", "tests/witness/glonass.rs",
     rf"points > 2500 [^\n]*\n[^\n]*clock_rms_m < {BOUND},"),
    ("qzss.neighbours", "neighbouring ephemerides of QZSS half way between, rms, below", "m", "tests/witness/qzss.rs", rf"pairs > 50 && rms_m < {BOUND},"),
    ("sbas.neighbours", "neighbouring records of WAAS half way between, rms, below", "m", "tests/witness/sbas.rs", rf"pairs > 900 && rms_m < {BOUND},"),
    ("sbas.longitude", "longitudes of SBAS satellites against those that operators state, below", "°", "tests/witness/sbas.rs",
     rf"apart_deg\.abs\(\) < {BOUND},"),
    ("navic.neighbours", "neighbouring records of NavIC half way between, median, below", "m", "tests/witness/navic.rs", rf"of\(0\.5\) < {BOUND} "),
    ("pseudorange", "residuals of real observations with our model, rms, below", "m", "tests/witness/pseudorange.rs", rf"residual_rms_m < {BOUND},"),
    ("klobuchar", "Klobuchar's delay against published values", "m", "tests/witness/atmosphere.rs", rf"6\.735_905_320_994_38\)\.abs\(\) < {BOUND},"),
    ("troposphere", "Saastamoinen's delay against published values", "m", "tests/witness/atmosphere.rs", rf"2\.447_998_701_440_88\)\.abs\(\) < {BOUND},"),
    ("nequick", "NeQuick-G against its document's test cases", "TECU", "src/gnss/nequick/tests.rs", rf"\(got - expected\)\.abs\(\) < {BOUND},"),
    ("bdgim", "BDGIM against its authors' program", "TECU", "tests/witness/bdgim.rs", rf"5\.818_458_961\)\.abs\(\) < {BOUND},"),
    ("ionex", "values of an IONEX map against the file", "TECU", "src/gnss/ionex/tests.rs", rf"\(found - printed\)\.abs\(\) < {BOUND},"),
    ("knife_edge", "loss over a knife edge against its asymptote", "dB", "src/generator/effect/obstruction.rs", rf"asymptote\)\.abs\(\) < {BOUND}\)"),
    ("sp3.withheld_orbit", "orbits withheld from the interpolation of SP3 files, rms, below", "m", EFFECT, rf"rms\(&misses\) < {BOUND}"),
    ("sp3.withheld_clock", "clocks withheld from the interpolation of SP3 files, rms, below", "m", EFFECT, rf"rms\(&late\) < {BOUND}"),
    ("e5.code_apart", "codes of E5a and E5b in a recording, apart by less than", "chip", "tests/witness/recording_e5.rs", rf"apart\.abs\(\) < {BOUND} &&"),
    ("e5.pilot_phase", "phase between the pilots of E5a and E5b in a recording, off by less than", "cycle", "tests/witness/recording_e5.rs",
     rf"cycles\.abs\(\) < {BOUND},"),
    ("interference_cn0", "power of interference behind the correlator against theory, below", "dB", "tests/effects/separation.rs",
     rf"power / expected\)\)\.abs\(\) < {BOUND},"),
    ("interop.time_tag", "time tags of GNSS-SDR, bias below", "s", "tests/interop.sh", r"within time_tag_offset_s 0 (\S+)"),
    ("interop.doppler_scale", "Dopplers of GNSS-SDR, scale off by less than", "", "tests/interop.sh", r"within scale 1 (\S+)"),
    ("interop.position", "positions of GNSS-SDR, horizontal rms, below", "m", "tests/interop.sh", r"within horizontal_rms_m 0 (\S+)"),
    ("interop.code", "pseudoranges of GNSS-SDR, scatter below", "m", "tests/interop.sh", r"within sigma_m 0 (\S+)"),
    ("interop.carrier", "carriers of GNSS-SDR, rms below", "cycle", "tests/interop.sh", r"within rms_cycles 0 (\S+)"),
    ("interop_l2c.limit", "position of GNSS-SDR by L2C with a group delay of 0, 3-D error, below", "m", "tests/interop_l2c.sh", r"^limit_m=(\S+)"),
]


def figures():
    for name, what, unit, test, pattern in ROWS:
        yield Figure(f"witness.{name}", what, unit, make.Asserted(test, pattern))
