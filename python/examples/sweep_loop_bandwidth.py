"""Sweeps the bandwidth of the carrier loop, once on modelled correlations and once on samples.

python sweep_loop_bandwidth.py [DIRECTORY]: where the study is kept, so that it goes on where it was.
"""

import sys
import tempfile
from pathlib import Path

import gnss_twin
import numpy as np

STUDY = """
name = "carrier_loop"
level = "correlator"
repetitions = 16
keep = ["phase_sigma_deg", "theory.phase_sigma_deg"]

[signal]
cn0_dbhz = 35

[[axis]]
key = "receiver.tracking.pll_bandwidth_hz"
values = [5, 10, 18]
"""

SCENE = {
    "name": "carrier_loop",
    "start": "2010-07-01T08:06:00",
    "duration_s": 3.0,
    "noise": {},
    "power": {"cn0_dbhz": 45},
    "motion": {"kind": "static", "latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520},
}

with tempfile.TemporaryDirectory() as scratch:
    directory = Path(sys.argv[1] if len(sys.argv) > 1 else scratch)
    directory.mkdir(exist_ok=True)
    study = directory / "carrier_loop.toml"
    study.write_text(STUDY)
    cells, cases = gnss_twin.study(study, out=directory / "results")

for bandwidth_hz, sigma_deg, theory_deg in zip(
    cells["receiver.tracking.pll_bandwidth_hz"], cells["phase_sigma_deg"], cells["theory.phase_sigma_deg"]
):
    print(f"modelled: {bandwidth_hz:4.0f} Hz: {sigma_deg:.2f} deg, theory {theory_deg:.2f} deg")

# The same loop on one array of samples, which is generated once.
scene = gnss_twin.Scene.from_dict(SCENE)
samples = scene.slice()
for bandwidth_hz in (5.0, 18.0):
    tables = gnss_twin.receive(samples, scene, {"tracking": {"pll_bandwidth_hz": bandwidth_hz}}).tables
    tracking = tables["tracking"]
    settled = tracking["sample"] > 1.5 * scene.metadata.sample_rate_hz
    scatter_deg = 360 * np.std(tracking["pll_discriminator_cycles"][settled])
    print(f"samples:  {bandwidth_hz:4.0f} Hz: discriminator scatters by {scatter_deg:.2f} deg, "
          f"{np.count_nonzero(settled)} updates of {len(np.unique(tracking['sv']))} satellites")
