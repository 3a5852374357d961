"""The figures that this repository publishes: what each is, how it is made, and the rooms of code that it speaks of.

A figure is declared here and measured nowhere else; `reports/evidence.csv` has its value. Rooms are chosen as small as the figure
allows: whatever in them changes makes the figure stale.
"""

import re

import make
import witness
from figure import Figure


ALL_SAMPLES = ("src/fft", "src/gnss", "src/generator", "src/receiver")
# What a run of a scene is measured for: id, words, unit, path in `summary.json`.
OF_A_SCENE = [
    ("first_fix_s", "first fix after the first sample", "s", "position.first_fix_s"),
    ("fixes", "fixes", "", "position.fixes"),
    ("horizontal_p95_m", "horizontal error, 95 %", "m", "position.horizontal_p95_m"),
    ("vertical_p95_m", "vertical error, 95 %", "m", "position.vertical_p95_m"),
    ("velocity_p95_mps", "velocity error, 95 %", "m/s", "position.velocity_p95_mps"),
    ("east_m", "mean error east", "m", "position.bias_enu_m.0"),
    ("north_m", "mean error north", "m", "position.bias_enu_m.1"),
    ("up_m", "mean error up", "m", "position.bias_enu_m.2"),
    ("pseudorange_rms_m", "pseudorange error, rms", "m", "observables.pseudorange_rms_m"),
    ("carrier_rms_cycles", "carrier phase error, rms", "cycle", "observables.carrier_rms_cycles"),
    ("doppler_rms_hz", "Doppler error, rms", "Hz", "observables.doppler_rms_hz"),
    ("dll_sigma_chips", "code error in tracking, rms", "chip", "tracking.dll_sigma_chips"),
    ("pll_sigma_deg", "phase error in tracking, rms", "°", "tracking.pll_sigma_deg"),
    ("fll_sigma_hz", "frequency error in tracking, rms", "Hz", "tracking.fll_sigma_hz"),
    ("losses", "losses of lock", "", "tracking.losses_of_lock"),
    ("slips", "cycle slips", "", "tracking.cycle_slips"),
]
SCENES = {
    "static": "antenna at rest, 60 s",
    "moderate": "car ride, 90 s",
    "high_dynamics": "rocket above 20 g, 110 s",
    "noise_free": "antenna at rest without noise, 60 s",
    "galileo": "Galileo E1 alone",
    "two_systems": "GPS L1 C/A and Galileo E1",
    "dual_band": "Galileo E1 and E5a",
    "gps_bands": "GPS L1, L2C and L5",
    "beidou_bands": "BeiDou B1C and B2a",
    "galileo_e6": "Galileo E1 and E6",
}
BANDS = [
    ("ionosphere_p95_m", "ionospheric delay by two carriers, error, 95 %", "m", "ionosphere.error_p95_m"),
    ("ionosphere_mean_m", "true ionospheric delay, mean", "m", "ionosphere.true_mean_m"),
]


def accuracy():
    for scene, words in SCENES.items():
        file = f"scenarios/{scene}.toml"
        rows = OF_A_SCENE + (BANDS if scene in ("dual_band", "gps_bands", "beidou_bands", "galileo_e6") else [])
        for name, what, unit, path in rows:
            counted = unit == ""
            yield Figure(
                f"accuracy.{scene}.{name}", f"{what}: {words}", unit, make.Run(file, path),
                (*ALL_SAMPLES, "src/analysis/measure", file), "= 0" if name == "losses" else "",
                None if counted else 3 if name == "first_fix_s" else 2,
            )
    test = "tests/loops/bdgim.rs"
    yield Figure("accuracy.bdgim.without_m", "position from one carrier of BeiDou without BDGIM, off by more than", "m",
                 make.Asserted(test, r"without_m\.norm\(\) > ([\d.]+)"))
    yield Figure("accuracy.bdgim.with_m", "the same with BDGIM, off by less than", "m",
                 make.Asserted(test, r"with_m\.norm\(\) < ([\d.]+)"))


BENCH = "reports/performance.md"
GENERATOR = "cargo bench --bench generator -- --write"
RECEIVER = "cargo bench --bench receiver -- --write"
RATE = "G satellite·samples/s/core"


def speed():
    for name, row, bar in [
        ("fast", "fast, noise-free, 2.6 Msps, ci8", "≥ 3"),
        ("balanced", "balanced, noise-free, 2.6 Msps, ci8", "≥ 2"),
        ("balanced_noise", "balanced, seeded noise, 2.6 Msps, ci8", "≥ 1.2"),
        ("fast_25msps", "fast, noise-free, 25 Msps, ci8", "≥ 4"),
        ("balanced_25msps", "balanced, noise-free, 25 Msps, ci8", "≥ 3"),
        ("reference", "reference, noise-free, 2.6 Msps, ci8", "≥ 0.1"),
    ]:
        yield Figure(f"speed.synthesis.{name}", f"synthesis: {row}", RATE,
                     make.Page(BENCH, GENERATOR, row=row, mark="generator", runs="15"),
                     ("src/generator/synth", "src/fft"), bar, 2)
    for name, row in [("gps_l1ca", "GPS L1 C/A"), ("gps_l5", "GPS L5"), ("galileo_e1", "Galileo E1"), ("galileo_e5", "Galileo E5")]:
        for level, column in [("fast", "`fast` (ns)"), ("balanced", "`balanced` (ns), edge"), ("reference", "`reference` (ns)")]:
            yield Figure(f"speed.signal.{name}.{level}_ns", f"synthesis of {row}, {level}: time of one core for a sample of a satellite",
                         "ns", make.Page("reports/trade.md", "cargo bench --bench trade", row=row, column=column, runs="15"),
                         ("src/generator/synth", "src/fft"), "", 2)
    for name, row, unit, bar in [
        ("tracking_2_6msps", "tracking in i16, area edges, 3 taps, ci8, 2.6 Msps", "G channel·samples/s/core", "≥ 1.6"),
        ("tracking_10msps", "tracking in i16, area edges, 3 taps, ci8, 10 Msps", "G channel·samples/s/core", "≥ 1.6"),
        ("search", "search, 32 PRNs, ±5 kHz, 10 × 2 ms, 2.6 Msps, two cores", "s", "≤ 0.15"),
    ]:
        rooms = ("src/receiver/acquire", "src/fft") if name == "search" else ("src/receiver/correlate",)
        yield Figure(f"speed.receiver.{name}", row, unit,
                     make.Page(BENCH, RECEIVER, row=row, mark="receiver", runs="15"), rooms, bar, 2)


    where = "Only what the scene requires, noise-free unless named"
    for name, what, row, less, per in [
        ("satellite_ns", "each satellite more", "8 of the satellites, bare", "1 of the satellites, bare", 7),
        ("tone_ns", "a tone more", "bare + a tone", "bare", 1),
        ("chirp_ns", "a chirp more", "bare + a chirp", "bare", 1),
        ("band_noise_ns", "noise of 1 MHz more", "bare + noise of 1 MHz", "bare", 1),
    ]:
        yield Figure(f"speed.{name}", f"generator, time of a sample: {what} ({where})", "ns",
                     make.Page(BENCH, GENERATOR, row=row, less=less, per=per, mark="generator"),
                     ("src/generator/synth", "src/generator/stage", "src/fft"), "", 2)
    for name, part, words in [
        ("generate_satellites", "generate, satellites", "over satellites"),
        ("generate_rate", "generate, rate", "over the rate in Msps"),
        ("generate_rays", "generate, rays", "over rays of a satellite"),
        ("receive_satellites", "receive, satellites", "over satellites from four on"),
        ("receive_rate", "receive, rate", "over the rate in Msps"),
    ]:
        rooms = ("src/generator", "src/fft") if part.startswith("generate") else ("src/receiver", "src/fft")
        pattern = rf"\*\*{part}\*\*.*?\nLine[^:]*: ([\d.]+) \+ ([\d.]+) x"
        yield Figure(f"speed.{name}", f"processor time of {part.split(',')[0]}, line {words}: seconds a second of signal", "",
                     make.Page(BENCH, "cargo bench --bench growth -- --write", pattern=f"(?s){pattern}", text=r"\1 + \2", mark="growth"), rooms)


    growth = {"column": "s a second of signal", "mark": "growth"}
    for name, row, less, what in [("search_l1c_s", "4", "3", "GPS L1C"), ("search_b1c_s", "5", "4", "BeiDou B1C")]:
        yield Figure(f"speed.{name}", f"first search for all satellites of {what}, processor time", "s",
                     make.Page(BENCH, "cargo bench --bench growth -- --write", row=row, less=less, per=0.5, after="**receive, signals**", **growth),
                     ("src/receiver/acquire", "src/fft"), "", 2)
    for row in ("1", "1000"):
        yield Figure(f"speed.motion_{row}", f"generator, motion by rows, {row} a second: seconds a second of signal", "s",
                     make.Page(BENCH, "cargo bench --bench growth -- --write", row=row, after="**generate, motion**", **growth),
                     ("src/generator/vehicle", "src/generator/synth"), "", 2)


TRADE = "cargo bench --bench trade"


def trade():
    number = r"(\S+) \([^)]*\)(?: \w+)? \| (\S+)"
    for name, row, rate in [("l1ca", "GPS L1 C/A", "2.6"), ("e1", "Galileo E1", "4.1"), ("l5", "GPS L5", "25")]:
        for place, level in enumerate(("fast", "balanced", "reference")):
            pattern = rf"^\| {row} \| {rate} \| " + r"[^|]*\|[^|]*\| " * place + number
            yield Figure(f"trade.{name}.{level}", f"{row} at {rate} Msps, {level}: time of a sample of a satellite, error of its code", "",
                         make.Page("reports/trade.md", TRADE, pattern=pattern, text=r"\1 ns, \2 m", runs="15"),
                         ("src/generator/synth", "src/fft"))
    yield Figure("trade.static.one_bit.loss", "scene static, 50 s, adc.bits = 1: loss of C/N0", "dB",
                 make.Page("reports/trade.md", TRADE, pattern=r"(?s)^### `static`.*?^\| `adc\.bits = 1` \|(?: \S+ \|){4} [^|]*\| \S+ \| (\S+) \|", runs="3"),
                 ("src/generator", "src/receiver", "src/fft"))
    for name, row in [("one_bit", "ci8, adc 1 bit"), ("two_bits", "ci8, adc 2 bits")]:
        yield Figure(f"trade.widths.{name}.loss", f"one satellite in noise at 2.6 Msps, {row}: loss of C/N0", "dB",
                     make.Page("reports/widths.md", f"{TRADE} -- --widths", row=row, column="C/N0 loss (dB)"),
                     ("src/generator", "src/fft"), "", 3)
    for level in ("fast", "balanced", "reference"):
        pattern = rf"(?s)^### `static`.*?^\| `{level}` \| (\S+) \| \S+ \| \S+ \| \d+ \| [^/|]* / (\S+) \| (\S+) \| (\S+) \|"
        for group, name, unit, what in [(1, "generator", "", "generator, seconds a second of signal"), (2, "position", "m", "position error, 95 %"),
                                        (3, "code", "m", "pseudorange error, rms"), (4, "loss", "dB", "loss of C/N0")]:
            yield Figure(f"trade.static.{level}.{name}", f"scene static, 50 s, {level}: {what}", unit,
                         make.Page("reports/trade.md", TRADE, pattern=pattern, text=rf"\{group}", runs="3"),
                         ("src/generator", "src/receiver", "src/fft"))


def validation():
    both = ("src/gnss", "src/generator", "scenarios/static.toml")
    script = "bash tests/interop.sh \"$GNSS_TWIN\""
    for name, what, pattern, rooms in [
        ("gnss_sdr_m", "mean position of GNSS-SDR by our samples, 3-D error, static scene",
         r"GNSS-SDR, static, .* 3-D ([\d.]+) m \(limit ([\d.]+) m\)", both),
        ("rtklib_receiver_m", "mean position of RTKLIB by our receiver's observations, 3-D error, static scene",
         r"RTKLIB, receiver: .* 3-D ([\d.]+) m \(limit ([\d.]+) m\)", (*both, "src/receiver")),
        ("rtklib_truth_m", "mean position of RTKLIB by our true observations, 3-D error, static scene",
         r"RTKLIB, truth: .* 3-D ([\d.]+) m \(limit ([\d.]+) m\)", both),
        ("rtklib_bare_m", "the same without a troposphere", r"RTKLIB, bare: .* 3-D ([\d.]+) m \(limit ([\d.]+) m\)", both),
    ]:
        yield Figure(f"validation.interop.{name}", what, "m", make.Script(script, pattern), rooms)


def counts():
    rows = [
        ("signals", "signals built in", r"pub static SIGNALS: \[&Signal; (\d+)\]", "src/gnss/signal/*.rs"),
        ("messages", "navigation messages built in, each signal's own variant counted", r"^pub static \w+: Message = ", "src/gnss/**/*.rs"),
        ("scenes", "scenes that come with the program", None, "scenarios/**/*.toml"),
        ("studies", "studies that come with the program", None, "studies/*.toml"),
        ("planted_faults", "planted faults listed", r"^    fault\(", "tests/planted/*.rs"),
        ("witness_tests", "tests that hold the program against sources from outside", r"#\[test\]", "tests/witness/*.rs"),
    ]
    for name, what, pattern, files in rows:
        yield Figure(f"counts.{name}", what, "", make.Count(pattern, files))
    for page in ("README.md", *(f"book/src/{name}.md" for name in ("first_run", "concepts", "cookbook", "signals"))):
        name = page.rpartition("/")[2].removesuffix(".md").lower()
        source = make.Text("python3 tests/readability.py", rf"readability of {re.escape(page)}: ([\d.]+)", text_of=page)
        yield Figure(f"readability.{name}", f"Flesch's reading ease of {page}", "", source, (), "≥ 45")
    rows = [
        ("planted", "planted faults that a test catches", r"^(\d+ of \d+) faults are caught", "reports/planted.md",
         "planted", ("tests/planted",)),
        ("sabotage", "kinds of damaged results that the judge catches", r"Caught: (\d+ of \d+)\.", "reports/sabotage.md",
         "sabotage", ("tests/sabotage", "src/analysis/judge", "src/analysis/measure", "src/analysis/expect")),
    ]
    for name, what, pattern, page, test, rooms in rows:
        command = f"GNSS_TWIN_LONG=1 GNSS_TWIN_WRITE_{test.upper()}=$PWD/{page} cargo test --test {test}"
        yield Figure(f"validation.{name}", what, "", make.Page(page, command, pattern=pattern), rooms, "all")
        if name == "sabotage":
            for part, words, group in [("kinds", "kinds of damage", 2), ("tolerable", "of them with a size that is tolerable", 1)]:
                source = make.Page(page, command, pattern=r"(\d+) of (\d+) kinds have a tolerable", text=rf"\{group}")
                yield Figure(f"sabotage.{part}", words, "", source, rooms)
    extremes = "GNSS_TWIN_LONG=1 GNSS_TWIN_WRITE_STABILITY=$PWD/reports/stability.md cargo test --test extremes"
    rooms = ("tests/extremes", "src/gnss", "src/generator", "src/receiver")
    yield Figure("validation.extremes", "extreme cases with measured figures", "",
                 make.Page("reports/stability.md", extremes, counted=r"^\| \d+ \|"), rooms)
    yield Figure("validation.extreme_figures", "figures of extreme cases, each beside its bar", "",
                 make.Page("reports/stability.md", extremes, counted=r"^\| *\d* *\|"), rooms)
    yield Figure("validation.engines", "disturbed runs of a study on Slurm and GNU parallel that end complete", "",
                 make.Page("reports/engines.md", "GNSS_TWIN_WRITE_ENGINES=$PWD/reports/engines.md bash tests/engines.sh \"$GNSS_TWIN\" 3",
                           pattern=r"^Complete: (\d+ of \d+) runs"), ("tests/engines.sh", "src/study", "src/cli/study"), "all")
    yield Figure("validation.levels.differences", "figures of the verdict that differ between samples and correlations, all scenes", "",
                 make.Page("reports/levels.md", "cargo bench --bench levels", pattern=r"^\*\*\d+ scenes.*: (\d+) differences"),
                 (*ALL_SAMPLES, "src/twin", "src/analysis/measure", "benches/levels"), "= 0")
    page, command = "reports/baselines.md", 'python3 tests/baselines.py "$GNSS_TWIN" --page reports/baselines.md'
    rooms = ("src/gnss", "src/generator", "src/receiver", "src/twin", "src/rtk", "tests/baselines.py")
    for name, way in [("two_bands", "two bands"), ("one_band", "one band")]:
        row = rf"^\| {way} \|"
        yield Figure(f"baselines.{name}.right", f"baselines of 0.6 km that are fixed rightly and in time, {way}", "",
                     make.Page(page, command, pattern=rf"{row} (\d+ of \d+) \|"), rooms)
        skipped = r"(?:[^|]*\|){6} "
        yield Figure(f"baselines.{name}.horizontal_mm", f"horizontal error of their fixed epochs, rms, {way}", "mm",
                     make.Page(page, command, pattern=rf"{row}{skipped}([\d.]+) \|"), rooms, "≤ 3")
        yield Figure(f"baselines.{name}.up_mm", f"vertical error of their fixed epochs, rms, {way}", "mm",
                     make.Page(page, command, pattern=rf"{row}{skipped}[\d.]+ \| ([\d.]+) \|"), rooms, "≤ 6")
    page, command = "reports/protection.md", "cargo bench --bench protection"
    rooms = ("src/gnss", "src/generator", "src/receiver", "src/twin", "src/analysis/measure", "benches/protection")
    yield Figure("integrity.fixes", "fixes of a case without a fault, RAIM", "",
                 make.Page(page, command, pattern=r"^\| RAIM, no fault \| (\d+) \|", runs="100"), rooms, "≥ 100000")
    share = r"\d+: (\S+) \((\S+) to (\S+)\)"
    for name, case in [("raim", "RAIM"), ("araim", "ARAIM")]:
        for faults, words in [("sound", "no fault"), ("faulty", "one fault")]:
            for axis, skipped in [("horizontal", ""), ("vertical", r"[^|]*\| ")]:
                pattern = rf"^\| {case}, {words} \| \d+ \| {skipped}{share}"
                yield Figure(f"integrity.{name}.{faults}.{axis}", f"{case}, {words}: share of {axis} errors beyond their level, with its interval",
                             "of 1", make.Page(page, command, pattern=pattern, text=r"\1 (\2 to \3)", runs="100"), rooms)
        yield Figure(f"integrity.{name}.alarms", f"{case}, no fault: share of fixes with a false alarm, with its interval", "of 1",
                     make.Page(page, command, pattern=rf"^\| {case}, no fault \| {share} \| \d+: ", text=r"\1 (\2 to \3)", runs="100"), rooms)
        yield Figure(f"integrity.{name}.alarms_apart", f"{case}, no fault: the same where no two codes disturb each other", "of 1",
                     make.Page(page, command, pattern=rf"^\| {case}, no fault \| [^|]*\| {share} of \d+ \|", text=r"\1 (\2 to \3)", runs="100"), rooms)
    yield from detection()
    faults = "GNSS_TWIN_LONG=1 GNSS_TWIN_WRITE_ROBUSTNESS=$PWD/reports/robustness.md cargo test --test faults -- --test-threads 1"
    rooms = ("tests/faults", "src/cli", "src/receiver/source")
    for name, what, column in [("cases", "cases of damaged input and of a failing machine", 1), ("failures", "of them failed", 5)]:
        yield Figure(f"validation.robustness_{name}", what, "",
                     make.Page("reports/robustness.md", faults, summed=column), rooms, "= 0" if name == "failures" else "")


# Detectors of jamming and spoofing in the order of the page's columns.
DETECTORS = ["level", "cn0_fall", "correlation_ratio", "correlation_phase", "correlation_delta", "code_carrier", "raim", "position_jump", "clock_jump"]


def detection():
    page, command = "reports/detection.md", "cargo bench --bench detection"
    rooms = (*ALL_SAMPLES, "src/twin", "src/analysis/measure", "benches/detection")
    yield Figure("detection.kept", "pairs of a detector and a clean scene in which the stated probability of a false alarm is not refuted", "",
                 make.Page(page, command, pattern=r"^In (\d+) of (\d+) pairs", text=r"\1 of \2", runs="24"), rooms)
    scenes = [("static", "at rest"), ("two_systems", "GPS and Galileo"), ("multipath", "urban multipath"), ("scintillation", "scintillation"),
              ("dynamics", "high dynamics"), ("oscillator", "a cheap oscillator"), ("samples", "at rest by samples")]
    for column, (scene, words) in enumerate(scenes):
        for name in DETECTORS:
            if name == "level" and scene != "samples":
                continue
            pattern = rf"^\| `{name}` \| (?:[^|]*\| ){{{column}}}(?:\*\*)?\d+ of \d+: (\S+) \((\S+) to ([^)]+)\)"
            yield Figure(f"detection.alarms.{scene}.{name}", f"{name}, {words}: share of tests with a false alarm, with its interval", "of 1",
                         make.Page(page, command, pattern=pattern, text=r"\1 (\2 to \3)", runs="24"), rooms)
    attacks = [("ds2", "like ds2"), ("ds3", "like ds3"), ("ds4", "like ds4"), ("ds7", "like ds7"), ("meaconing", "meaconing")]
    attacks += [(f"{name}_{js}", f"{words}, J/S {js} dB") for name, words in
                [("cw", "CW"), ("chirp", "chirp"), ("noise", "band noise"), ("pulses", "pulses")] for js in (0, 10, 20)]
    for attack, words in attacks:
        for column, name in enumerate(DETECTORS[:5]):
            row = rf"^\| {words}[^|]*\| (?:[^|]*\| ){{{column}}}"
            yield Figure(f"detection.share.{attack}.{name}", f"{name}, {words}: share of attacked tests with an alarm", "of 1",
                         make.Page(page, command, pattern=row + r"(\d\.\d+) \(", runs="10"), rooms)
            if attack in ("ds2", "ds3", "ds4", "ds7", "meaconing"):
                yield Figure(f"detection.delay.{attack}.{name}", f"{name}, {words}: median time to the first alarm", "s",
                             make.Page(page, command, pattern=row + r"([\d.]+|none), [^;|]*;", runs="10"), rooms)


# Figures of loops as the pages of studies name them.
JITTER = {
    "phase_sigma_deg": "phase jitter, 1 σ (degrees)",
    "code_sigma_m": "code jitter, 1 σ (m)",
    "code_sigma_chips": "code jitter, 1 σ (chips)",
    "tracking.pll_sigma_deg": "tracking PLL jitter, 1 σ (degrees)",
    "tracking.dll_sigma_chips": "tracking DLL jitter, 1 σ (chips)",
}


def studies():
    page = "reports/studies/starts/report.md"
    command = ".ci/reports starts"
    for name, row, unit, what in [
        ("first_fix_s", "time to first fix", "s", "first fix"),
        ("first_horizontal_m", "first horizontal", "m", "horizontal error of the first fix"),
        ("first_vertical_m", "first vertical", "m", "vertical error of the first fix"),
        ("nominal_horizontal_m", "nominal horizontal error, 95 %", "m", "horizontal 95 % of a run before the ionosphere's page"),
        ("horizontal_m", "broadcast horizontal error, 95 %", "m", "horizontal 95 % of a run after the ionosphere's page"),
        ("vertical_m", "broadcast vertical error, 95 %", "m", "vertical 95 % of a run after the ionosphere's page"),
        ("velocity_mps", "broadcast velocity error, 95 %", "m/s", "velocity 95 % of a run after the ionosphere's page"),
    ]:
        for column, words in [("median", "median"), ("95 %", "95 %"), ("largest", "largest")]:
            short = {"median": "median", "95 %": "p95", "largest": "largest"}[column]
            yield Figure(f"studies.starts.{name}.{short}", f"{what}, {words} of 200 starts", unit,
                         make.Page(page, command, row=row, column=column, runs="200"),
                         (*ALL_SAMPLES, "studies/starts.toml"), "", 3 if unit == "s" else 2)
    yield Figure("studies.starts.velocity_all_mps.largest", "velocity 95 % of a run, also before the ionosphere's page, largest of 200 starts",
                 "m/s", make.Page(page, command, row="position velocity error, 95 %", column="largest", runs="200"),
                 (*ALL_SAMPLES, "studies/starts.toml"), "", 2)
    for scene in ("static", "moderate", "high_dynamics"):
        for name, what, unit, column in [
            ("horizontal_p95_m", "horizontal error, 95 %", "m", "position horizontal error, 95 % (m)"),
            ("vertical_p95_m", "vertical error, 95 %", "m", "position vertical error, 95 % (m)"),
            ("velocity_p95_mps", "velocity error, 95 %", "m/s", "position velocity error, 95 % (m/s)"),
            ("pseudorange_rms_m", "pseudorange error, rms", "m", "observables pseudorange error, rms (m)"),
        ]:
            yield Figure(f"studies.motions.{scene}.{name}", f"{what}, mean of five noises: {SCENES[scene]}", unit,
                         make.Page("reports/studies/motions/report.md", ".ci/reports motions", row=scene,
                                   column=column, runs="5"), (*ALL_SAMPLES, "studies/motions.toml", f"scenarios/{scene}.toml"), "", 2)
    yield Figure("studies.starts.slips_per_hour.mean", "cycle slips an hour, mean of 200 starts", "",
                 make.Page(page, command, row="tracking slips", column="mean", runs="200"), (*ALL_SAMPLES, "studies/starts.toml"), "", 2)
    for column in ("mean", "low", "high"):
        words = {"mean": "mean of 40 starts", "low": "lower end of its 95 % interval", "high": "upper end of its 95 % interval"}[column]
        yield Figure(f"studies.starts_thermal.nees.{column}", f"normalised error squared of a run's last fix, {words}", "",
                     make.Page("reports/studies/starts_thermal/report.md", ".ci/reports starts_thermal",
                               row="NEES of the last fix with broadcast ionosphere", column=column, runs="40"), (*ALL_SAMPLES, "studies/starts_thermal.toml"), "", 3)
    for study, figure, name in [
        ("pll_jitter", "phase_sigma_deg", ""), ("dll_jitter", "code_sigma_m", ""), ("pll_jitter_e1", "phase_sigma_deg", ""),
        ("dll_jitter_e1", "code_sigma_m", ""), ("jitter_maps", "phase_sigma_deg", "phase_"), ("jitter_maps", "code_sigma_m", "code_"),
        ("jitter_data", "phase_sigma_deg", "phase_"), ("jitter_data", "code_sigma_chips", "code_"),
        ("jitter_pilots", "phase_sigma_deg", "phase_"), ("jitter_pilots", "code_sigma_chips", "code_"),
        ("loss_of_lock", "phase_sigma_deg", ""), ("pilot_against_data", "phase_sigma_deg", ""), ("pll_samples", "tracking.pll_sigma_deg", "phase_"),
        ("pll_samples", "tracking.dll_sigma_chips", "code_"),
    ]:
        sampled = study == "pll_samples"
        rooms = (*(ALL_SAMPLES if sampled else ("src/receiver/track", "src/study")), f"studies/{study}.toml")
        pattern = rf"^{re.escape(JITTER[figure])}: (\d+ of \d+) cells.*?\(ratios ([\d.]+ to [\d.]+)"
        report, command = f"reports/studies/{study}/report.md", f".ci/reports {study}"
        for part, group, words in [("cells", 1, "cells within 5 % of theory"), ("ratio", 2, "measured to theory, least to most")]:
            yield Figure(f"study.{study}.{name}{part}", f"study {study}, {figure}, T·C/N0 ≥ 10: {words}", "",
                         make.Page(report, command, pattern=pattern, text=rf"\{group}"), rooms)
    for study in ("boc_side_peaks", "stress_jerk", "stress_acceleration", "tracking_maps", "boost_samples"):
        rooms = ALL_SAMPLES if study == "boost_samples" else ("src/receiver/track", "src/study")
        yield Figure(f"study.{study}.cases", f"study {study}: cases measured", "",
                     make.Page(f"reports/studies/{study}/report.md", f".ci/reports {study}",
                               pattern=r" (\d+) cases: \d+ cells"), (*rooms, f"studies/{study}.toml"))
    for component in ("data", "pilot"):
        yield Figure(f"study.pilot_against_data.{component}_dbhz", f"C/N0 at which half of the runs hold a minute of Galileo E1 without a slip, {component}, 18 Hz",
                     "dB-Hz", make.Page("reports/studies/pilot_against_data/report.md", ".ci/reports pilot_against_data",
                                        pattern=rf"^\| {component} \| 18 \| ([\d.]+) \|"), ("src/receiver/track", "src/study", "studies/pilot_against_data.toml"))
    yield Figure("studies.loops.cells", "cells with T·C/N0 ≥ 10 and B·T ≤ 0.36 whose jitter is within 5 % of theory", "",
                 make.Page("reports/loops.md", "cargo bench --bench loops", pattern=r"(\d+ of \d+) cells are within 5 %"),
                 ("src/receiver/track", "src/study"))
    yield Figure("studies.acquisition.counts", "counts of detections and false alarms within the 95 % of their binomial law", "",
                 make.Page("reports/acquisition.md", "cargo bench --bench acquisition", pattern=r"(\d+ of \d+) counts are within"),
                 ("src/receiver/acquire", "src/fft"))


FIGURES = {figure.id: figure for part in (accuracy, speed, trade, validation, counts, studies, witness.figures) for figure in part()}
