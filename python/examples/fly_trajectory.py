"""Flies a helix in lock step with a simulation of one's own, and compares what the receiver measures with it.

python fly_trajectory.py [SECONDS]; the first fix comes after some 36 s, a shorter flight has none.
"""

import sys

import gnss_twin
import numpy as np

duration_s = float(sys.argv[1]) if len(sys.argv) > 1 else 45.0
scene = gnss_twin.Scene.from_dict({
    "name": "helix",
    "start": "2010-07-01T08:05:58",
    "duration_s": duration_s,
    "noise": {},
    "motion": {"kind": "pushed", "latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 1000, "join_s": 0.01},
})
# The scene has no atmosphere: the receiver is to correct for none.
live = gnss_twin.Live(scene, {"position": {"ionosphere": "none", "troposphere": "none"}})

start = np.array(live.start_position_m)
up = start / np.linalg.norm(start)
east = np.cross([0, 0, 1], up)
east /= np.linalg.norm(east)
north = np.cross(up, east)

RADIUS_M, RATE_RADPS, CLIMB_MPS = 200.0, 0.1, 5.0


def motion(t_s):
    """Position, velocity and acceleration: round a circle that climbs, beginning at the start."""
    c, s = np.cos(RATE_RADPS * t_s), np.sin(RATE_RADPS * t_s)
    place = RADIUS_M * (s * east + (1 - c) * north) + CLIMB_MPS * t_s * up
    velocity = RADIUS_M * RATE_RADPS * (c * east + s * north) + CLIMB_MPS * up
    return start + place, velocity, RADIUS_M * RATE_RADPS**2 * (c * north - s * east)


fixes, gaps, observed = [], [], 0
while not live.is_done:
    step = live.step(*motion(live.next_s))
    gaps.append(step.gap_m)
    observed += len(step.receiver["observations"]["sample"])
    found = step.receiver["fixes"]
    for row in range(len(found["sample"])):
        t_s = found["sample"][row] / scene.metadata.sample_rate_hz
        place = np.array([found[axis][row] for axis in ("x_m", "y_m", "z_m")])
        fixes.append(np.linalg.norm(place - motion(t_s)[0]))
outcome, truth = live.finish()
print(outcome)
print(f"{len(gaps)} steps, largest gap {max(gaps):.3f} m, {observed} observations")
if fixes:
    print(f"{len(fixes)} fixes, mean error {np.mean(fixes):.2f} m, worst {max(fixes):.2f} m")
