"""Acquires satellites in a recording, and draws the spectrum of its samples.

python acquire_recording.py RECORDING.sigmf-meta; without one, half a second is generated.
"""

import sys

import gnss_twin
import numpy as np

SCENE = """
name = "recording"
start = 2010-07-01T08:06:00
duration_s = 0.5
noise = {}
motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
"""

if len(sys.argv) > 1:
    metadata, samples = gnss_twin.open_recording(sys.argv[1])
else:
    scene = gnss_twin.Scene.from_toml(SCENE)
    metadata, samples = scene.metadata, scene.slice()

# The first half second is enough for a search.
samples = samples[: int(0.5 * metadata.sample_rate_hz)]
found = gnss_twin.receive(samples, metadata).tables["acquisition"]
chosen = np.flatnonzero(found["acquired"])
for row in chosen[np.argsort(-found["cn0_dbhz"][chosen])]:
    print(f"{found['sv'][row]} {found['signal'][row]}: {found['cn0_dbhz'][row]:.1f} dB-Hz, "
          f"{found['doppler_hz'][row]:+.0f} Hz, {found['code_phase_chips'][row]:.1f} chips")
print(f"{len(chosen)} satellites of {len(np.unique(found['sv']))} searched")

# The spectrum by numpy: 32 bins of 256, in decibels over the weakest of them.
plain = gnss_twin.to_complex(samples[: len(samples) // 256 * 256]).reshape(-1, 256)
power = np.mean(np.abs(np.fft.fftshift(np.fft.fft(plain * np.hanning(256)), axes=1)) ** 2, axis=0)
coarse = 10 * np.log10(power.reshape(32, 8).mean(axis=1))
for bin_, level in enumerate(coarse - coarse.min()):
    offset_mhz = 1e-6 * metadata.sample_rate_hz * ((bin_ + 0.5) / 32 - 0.5)
    print(f"{offset_mhz:+6.2f} MHz {'#' * int(1 + 4 * level)}")
