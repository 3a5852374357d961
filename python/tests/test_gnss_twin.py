"""The module as installed: scenes, samples, runs, the receiver, lock step, studies, errors and interrupts."""

import csv
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import gnss_twin
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]

KEYS = {
    "name": "short",
    "start": "2010-07-01T08:06:00",
    "duration_s": 0.2,
    "noise": {},
    "motion": {"kind": "static", "latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520},
}
TEXT = """
name = "short"
start = 2010-07-01T08:06:00
duration_s = 0.2
noise = {}
motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
"""


def scene(**keys):
    return gnss_twin.Scene.from_dict(KEYS | keys)


def rows(table):
    """Rows of a table: all columns have as many."""
    lengths = {len(column) for column in table.values()}
    assert len(lengths) == 1
    return lengths.pop()


def test_a_scene_is_the_same_from_text_file_and_dictionary(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(TEXT)
    scenes = [scene(), gnss_twin.Scene.from_toml(TEXT), gnss_twin.Scene.open(path), gnss_twin.Scene.open(str(path))]
    first, *others = [one.slice(0, 20_000) for one in scenes]
    for other in others:
        assert np.array_equal(first, other)
    assert np.any(first)
    assert not np.array_equal(first, scene(seed=8).slice(0, 20_000))
    assert [scenes[0].name, scenes[0].samples, scenes[0].signals] == ["short", 520_000, ["GPS L1 C/A"]]
    assert "GPS L1 C/A" in scenes[0].plan()


def test_values_of_numpy_and_times_are_values_of_keys():
    import datetime

    moved = dict(KEYS["motion"], height_m=np.float64(520.0), latitude_deg=np.array(48.1))
    start = datetime.datetime(2010, 7, 1, 8, 6)
    same = scene(start=start, motion=moved, seed=np.int64(1), satellites=None)
    assert np.array_equal(same.slice(0, 5000), scene(seed=1).slice(0, 5000))


@pytest.mark.parametrize("name", ["ci8", "cu8", "ci16_le", "cf32_le", "ri8", "ri16_le"])
def test_samples_have_the_type_of_their_format_and_are_bytes_of_the_program(name):
    key = {"sample_rate_hz": 4e6, "format": name} | ({"if_hz": 1e6} if name.startswith("r") else {})
    made = scene(duration_s=0.02, front_end=key)
    samples = made.slice()
    assert samples.nbytes == made.samples * made.metadata.sample_bytes
    assert samples.shape == ((made.samples, 2) if name in ("ci8", "cu8", "ci16_le") else (made.samples,))
    plain = gnss_twin.to_complex(samples)
    assert plain.dtype == np.complex64 and plain.shape == (made.samples,)
    # Noise of both components, or of the only one, is what there is: zero mean, the same power.
    power = [np.var(plain.real), np.var(plain.imag)]
    assert abs(np.mean(plain)) < 0.05 * np.sqrt(power[0])
    assert power[1] == 0 if name.startswith("r") else abs(power[0] / power[1] - 1) < 0.05


def test_slices_and_batches_are_the_whole():
    made = scene()
    whole = made.slice()
    assert np.array_equal(made.slice(123_457, 200_001), whole[123_457:200_001])
    assert made.slice(520_000).shape == (0, 2)
    generator = gnss_twin.Generator(made, batch_samples=77_777)
    batches = list(generator)
    assert [batch.first_sample for batch in batches] == [77_777 * k for k in range(7)]
    assert np.array_equal(np.concatenate([batch.samples for batch in batches]), whole)
    ticks = np.concatenate([batch.truth["trajectory"]["sample"] for batch in batches])
    assert list(ticks) == [0, 260_000]
    assert list(generator) == []
    with pytest.raises(IndexError, match="520000"):
        made.slice(0, 520_001)


def test_a_receiver_takes_arrays_cut_anywhere():
    made = scene()
    samples = made.slice()
    whole = gnss_twin.receive(samples, made)
    receiver = gnss_twin.Receiver(made.metadata)
    parts = [receiver.push(part) for part in np.array_split(samples, 5)]
    end = receiver.finish()
    for name, table in whole.tables.items():
        for column, values in table.items():
            joined = np.concatenate([part[name][column] for part in parts] + [end.tables[name][column]])
            assert np.array_equal(joined, values), (name, column)
    assert whole.summary == end.summary
    assert str(whole) == str(end)
    found = whole.tables["acquisition"]
    assert sum(found["acquired"]) == len(whole.summary["acquired"]) >= 6
    # The same as raw bytes, as a flat array, and from an array that does not lie in one piece.
    strided = np.repeat(samples, 2, axis=0)[::2]
    for same in (samples.tobytes(), memoryview(samples.tobytes()), samples.reshape(-1), strided):
        assert gnss_twin.receive(same, made.metadata).summary == whole.summary
    with pytest.raises(RuntimeError, match="over"):
        receiver.push(samples)


def test_arrays_of_another_type_or_shape_are_refused():
    receiver = gnss_twin.Receiver(gnss_twin.Metadata("ci8", 4e6))
    with pytest.raises(TypeError, match="float64: expected int8"):
        receiver.push(np.zeros(10))
    with pytest.raises(TypeError, match="int16: expected int8"):
        receiver.push(np.zeros((5, 2), np.int16))
    with pytest.raises(ValueError, match=r"\[2, 5\]: expected \(n,\) or \(n, 2\)"):
        receiver.push(np.zeros((2, 5), np.int8))
    with pytest.raises(IndexError, match="front_end = 1"):
        receiver.push(np.zeros(10, np.int8), front_end=1)


ARMS = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]
SENSORS = {"duration_s": 1.0, "attitude": {"kind": "fixed"}, "imu": {"rate_hz": 100, "grade": "low"}}
ARRAY = {
    "duration_s": 42.0,
    "attitude": {"kind": "fixed", "yaw_deg": 30},
    "array": {"element": [{"lever_arm_m": arm} for arm in ARMS]},
    "receiver": {"array": {"filter": "none", "attitude_ms": 1000, "lever_arms_m": ARMS}},
}


@pytest.mark.parametrize(
    ("keys", "tables"), [(SENSORS, {"truth/imu", "truth/body"}), (ARRAY, {"rx/attitude", "rx/elements"})]
)
def test_a_run_has_the_tables_of_the_files_that_it_writes(tmp_path, keys, tables):
    made = scene(**keys)
    run = gnss_twin.run(made, out=tmp_path / "run")
    plain = gnss_twin.run(made)
    assert plain.judgement is None
    for side, found in [("truth", run.truth), ("rx", run.receiver)]:
        files = list((tmp_path / "run" / side).glob("*.csv"))
        assert files
        tables -= {f"{side}/{file.stem}" for file in files}
        for file in files:
            with file.open() as text:
                header, *body = csv.reader(text)
            table = found[file.stem]
            # Files have lines of one front end each, the table those of all.
            assert [name for name in table if name != "front_end"] == header, file
            assert rows(table) == len(body), file
            for place, column in enumerate(header):
                written = [row[place] for row in body]
                if table[column].dtype.kind == "f":
                    assert np.array_equal(table[column], [float(x) if x else np.nan for x in written], equal_nan=True)
                elif table[column].dtype.kind == "b":
                    assert [str(x).lower() for x in table[column]] == written
                else:
                    assert [str(x) for x in table[column]] == written, (file, column)
    assert not tables
    for mine, other in [(run.truth, plain.truth), (run.receiver, plain.receiver)]:
        for name, table in mine.items():
            for column, values in table.items():
                assert np.array_equal(values, other[name][column], equal_nan=values.dtype.kind == "f")
    assert rows(run.receiver["tracking"]) > 100
    assert run.judgement == gnss_twin.judge(tmp_path / "run")
    assert run.judgement["satellites"]["acquired"] >= 6, run.judgement["satellites"]
    with pytest.raises(FileExistsError, match="run"):
        gnss_twin.run(made, out=tmp_path / "run")
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize("level", ["correlations", "observations"])
def test_a_run_without_samples_is_that_of_the_program(tmp_path, level):
    text = TEXT.replace("duration_s = 0.2", "duration_s = 8") + f'fidelity = {{ level = "{level}" }}\n'
    made = gnss_twin.Scene.from_toml(text)
    run = gnss_twin.run(made, out=tmp_path / "mine")
    assert str(run).startswith("8 s of ") and run.judgement["satellites"]["acquired"] >= 6
    (tmp_path / "scene.toml").write_text(text)
    program = Path(sys.executable).with_name("gnss-twin")
    arguments = [program, "run", tmp_path / "scene.toml", "--out", tmp_path / "its", "--report", "none"]
    subprocess.run(arguments, check=True, capture_output=True)
    for name in ["rx/observations.csv", "rx/fixes.csv", "truth/observations.csv"]:
        mine, its = [(tmp_path / side / name).read_bytes() for side in ("mine", "its")]
        assert mine == its and len(mine) > 50, name
    # There is nothing to slice, to iterate over or to step through.
    for wanted in [lambda: made.slice(0, 100), lambda: next(gnss_twin.Generator(made))]:
        with pytest.raises(gnss_twin.GenerateError, match=f'fidelity.level = "{level}": no samples exist'):
            wanted()
    with pytest.raises(gnss_twin.ScenarioError, match=r"has no model of \[\[interference\]\]"):
        gnss_twin.run(gnss_twin.Scene.from_toml(text + '[[interference]]\nkind = "cw"\njs_db = 3\n'))


def test_a_budget_chooses_the_level_of_a_run():
    loose, tight = [{"code_m": 1.0, "carrier_cycles": cycles} for cycles in (1e-3, 5e-5)]
    chosen = [str(gnss_twin.run(scene(fidelity={"budget": budget}))) for budget in (loose, tight)]
    assert chosen[0].startswith("0.2 s of ") and "samples" in chosen[1].splitlines()[0], chosen
    # The samples of the scene are there all the same.
    assert np.any(scene(fidelity={"budget": loose}).slice(0, 20_000))


def test_tables_are_what_pandas_and_polars_take():
    tables = gnss_twin.run(scene()).receiver
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(tables["acquisition"])
    assert frame[frame.acquired].sv.tolist() == list(tables["acquisition"]["sv"][tables["acquisition"]["acquired"]])
    polars = pytest.importorskip("polars")
    assert polars.DataFrame(tables["acquisition"]).height == 32


def test_settings_are_the_scene_s_or_given():
    own = scene(receiver={"acquisition": {"false_alarm_probability": 1e-3}})
    samples = own.slice()

    def threshold(of, settings=None):
        return gnss_twin.receive(samples, of, settings).tables["acquisition"]["threshold"][0]

    usual, chosen = threshold(own.metadata), threshold(own)
    assert chosen < usual
    assert threshold(own, {}) == usual
    assert threshold(scene(), "[acquisition]\nfalse_alarm_probability = 1e-3") == chosen


def test_errors_are_exceptions_with_the_library_s_words(tmp_path):
    with pytest.raises(gnss_twin.ScenarioError, match="unknown key 'noize': did you mean 'noise'"):
        scene(noize={})
    with pytest.raises(gnss_twin.ScenarioError, match=r"scenario:2:8: name = .*expected 1 to 64 letters"):
        gnss_twin.Scene.from_toml(TEXT.replace("short", "not a name"))
    with pytest.raises(gnss_twin.SettingsError, match="settings.*tracking.pll_bandwith_hz.*pll_bandwidth_hz"):
        gnss_twin.Receiver(scene(), {"tracking": {"pll_bandwith_hz": 10}})
    with pytest.raises(FileNotFoundError, match="nowhere.toml"):
        gnss_twin.Scene.open(tmp_path / "nowhere.toml")
    with pytest.raises(TypeError, match=r"motion.height_m is a object"):
        scene(motion=dict(KEYS["motion"], height_m=object()))
    with pytest.raises(TypeError, match="settings is a int"):
        gnss_twin.Receiver(scene(), 5)
    with pytest.raises(ValueError, match="unknown sample format 'ci12'"):
        gnss_twin.Metadata("ci12", 4e6)
    for kind in (gnss_twin.ScenarioError, gnss_twin.SettingsError, gnss_twin.StepError, gnss_twin.StudyError):
        assert issubclass(kind, gnss_twin.Error) and kind.__module__ == "gnss_twin"


def test_recordings_are_read_from_their_file(tmp_path):
    made = scene(duration_s=0.05)
    (tmp_path / "a.sigmf-meta").write_text(made.metadata.to_sigmf())
    made.slice().tofile(tmp_path / "a.sigmf-data")
    metadata, samples = gnss_twin.open_recording(tmp_path / "a.sigmf-meta")
    assert repr(metadata) == repr(made.metadata)
    assert np.array_equal(samples, made.slice())
    assert isinstance(samples, np.memmap)


PUSHED = dict(KEYS, duration_s=0.1, motion=dict(KEYS["motion"], kind="pushed"))


def climb():
    """A scene driven a metre a second upwards: the bytes of its steps, and where they end."""
    live = gnss_twin.Live(gnss_twin.Scene.from_dict(PUSHED))
    start = np.array(live.start_position_m)
    up = start / np.linalg.norm(start)
    samples, places = [], []
    while not live.is_done:
        t_s = live.next_s
        step = live.step(start + up * t_s, up)
        assert step.made_of in ("fresh", "snap") and step.gap_m < 0.2
        samples.append(step.samples)
        places.append(np.array(step.position_m) - start)
    outcome, truth = live.finish()
    with pytest.raises(RuntimeError, match="finished"):
        live.step()
    return np.concatenate(samples), np.array(places), outcome, truth, up


def test_lock_step_is_the_same_again():
    samples, places, outcome, truth, up = climb()
    again = climb()
    assert np.array_equal(samples, again[0]) and np.array_equal(places, again[1])
    assert len(samples) == 260_000 and str(outcome).startswith("100.0 ms received")
    assert np.all(np.diff(places @ up) > 0) and abs(places[-1] @ up - 0.1) < 0.02
    assert rows(truth["passes"]) >= 6


def test_steps_that_cannot_be_made_say_why():
    with pytest.raises(gnss_twin.StepError, match="kind = \"pushed\""):
        gnss_twin.Live(scene())
    live = gnss_twin.Live(gnss_twin.Scene.from_dict(PUSHED), receive=False)
    with pytest.raises(gnss_twin.StepError, match="expected 6e6 to 1e9 m"):
        live.step([1.0, 2.0, 3.0])
    with pytest.raises(TypeError, match="without position_m"):
        live.step(t_s=1.0)
    with pytest.raises(gnss_twin.StepError, match="no such source"):
        live.switch("jammer 1 on")
    assert live.switch("power G02 -10") == 0


STUDY = """
name = "jitter"
level = "correlator"
repetitions = 4
keep = ["phase_sigma_deg"]

[signal]
cn0_dbhz = 35

[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [5, 18]
"""


def test_a_study_is_two_tables(tmp_path):
    (tmp_path / "jitter.toml").write_text(STUDY)
    cells, cases = gnss_twin.study(tmp_path / "jitter.toml", out=tmp_path / "out")
    assert list(cells["receiver.tracking.pll_bandwidth_hz"]) == [5, 18]
    assert cells["phase_sigma_deg"][0] < cells["phase_sigma_deg"][1]
    assert rows(cases) == 8 and (tmp_path / "out" / "report.md").exists()
    with pytest.raises(gnss_twin.Error, match="repetitons"):
        (tmp_path / "typo.toml").write_text(STUDY.replace("repetitions", "repetitons"))
        gnss_twin.study(tmp_path / "typo.toml", out=tmp_path / "typo")


@pytest.mark.parametrize("level", ["balanced", "correlations"])
def test_an_interrupt_ends_a_long_call(level):
    made = scene(duration_s=10_000, fidelity={"level": level})
    # Shells start background jobs with this signal ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        gnss_twin.run(made)
    signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begun < 30


def test_other_threads_run_meanwhile():
    counted = [0]

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    made, done = scene(), threading.Event()
    counter = threading.Thread(target=count)
    counter.start()
    begun = time.monotonic()
    gnss_twin.run(made)
    took_s = time.monotonic() - begun
    done.set()
    counter.join()
    # With the lock held there would be none but those of the wait for each of the few calls of Python.
    assert counted[0] > 20 * took_s


def test_the_wheel_has_the_program(tmp_path):
    program = Path(sys.executable).with_name("gnss-twin")
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["gnss-twin", gnss_twin.__version__]
    (tmp_path / "short.toml").write_text(TEXT)
    out = tmp_path / "short.sigmf-data"
    subprocess.run([program, "generate", tmp_path / "short.toml", "--out", out], check=True, capture_output=True)
    assert out.read_bytes() == gnss_twin.Scene.from_toml(TEXT).slice().tobytes()
    assert subprocess.run([program, "run", tmp_path / "none.toml"], capture_output=True).returncode == 65
