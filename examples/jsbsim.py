"""An aircraft of JSBSim flies to a target by the fixes of the twin's receiver.

    pip install jsbsim
    cargo build --release
    python examples/jsbsim.py [--program target/release/gnss-twin] [--seconds 90] [--target-km 3] [--jam-at S]

JSBSim's Cessna 172 is the vehicle. Its state goes to `gnss-twin live` as datagrams, 100 a second; the samples
that come back go to `gnss-twin receive`, whose fixes steer the heading. This program reads the samples, so it
sets the pace: a state a tick, no clock. Until the first fix the aircraft keeps its heading. At the end it prints
how near it came to the target, by the true motion.
"""

import argparse
import json
import math
import socket
import struct
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

# This file has the package's name.
sys.path = [place for place in sys.path if Path(place).resolve() != Path(__file__).resolve().parent]
import jsbsim  # noqa: E402

RATE_HZ = 2.6e6
TICK_S = 0.01
BYTES = int(2 * RATE_HZ * TICK_S)
START_DEG = (48.1, 11.6)
HEIGHT_M = 1000.0

SCENE = f"""\
name = "jsbsim"
start = 2010-07-01T08:06:00
duration_s = 3600
noise = {{}}

[motion]
kind = "pushed"
latitude_deg = {START_DEG[0]}
longitude_deg = {START_DEG[1]}
height_m = {HEIGHT_M}
hold_s = 1.0

[front_end]
sample_rate_hz = {RATE_HZ}
format = "ci8"

[[interference]]
kind = "noise"
js_db = 45
bandwidth_hz = 2e6
"""

SEMI_MAJOR_M, FLATTENING = 6378137.0, 1 / 298.257223563
SQUARED_ECCENTRICITY = FLATTENING * (2 - FLATTENING)


def ecef_m(latitude_deg, longitude_deg, height_m):
    """WGS 84 place to ECEF."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    normal_m = SEMI_MAJOR_M / math.sqrt(1 - SQUARED_ECCENTRICITY * math.sin(latitude) ** 2)
    across_m = (normal_m + height_m) * math.cos(latitude)
    up_m = (normal_m * (1 - SQUARED_ECCENTRICITY) + height_m) * math.sin(latitude)
    return across_m * math.cos(longitude), across_m * math.sin(longitude), up_m


def from_north_east_down(vector, latitude_deg, longitude_deg):
    """A vector in the local axes, in ECEF axes."""
    north, east, down = vector
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    inward = -north * math.sin(latitude) - down * math.cos(latitude)
    return (
        inward * math.cos(longitude) - east * math.sin(longitude),
        inward * math.sin(longitude) + east * math.cos(longitude),
        north * math.cos(latitude) - down * math.sin(latitude),
    )


def to_target(latitude_deg, longitude_deg, target_deg):
    """Metres north and east from a place to the target, on a plane: good to a metre over some kilometres."""
    radius_m = SEMI_MAJOR_M + HEIGHT_M
    north_m = math.radians(target_deg[0] - latitude_deg) * radius_m
    east_m = math.radians(target_deg[1] - longitude_deg) * radius_m * math.cos(math.radians(target_deg[0]))
    return north_m, east_m


class Aircraft:
    """A trimmed Cessna 172 that holds height and heading."""

    FOOT_M = 0.3048

    def __init__(self):
        self.fdm = jsbsim.FGFDMExec(None)
        self.fdm.set_debug_level(0)
        self.fdm.load_model("c172x")
        self.fdm.set_dt(TICK_S)
        for key, value in {
            "ic/lat-geod-deg": START_DEG[0],
            "ic/long-gc-deg": START_DEG[1],
            "ic/h-sl-ft": HEIGHT_M / self.FOOT_M,
            "ic/psi-true-deg": 0.0,
            "ic/u-fps": 55.0 / self.FOOT_M,
        }.items():
            self.fdm[key] = value
        self.fdm.run_ic()
        self.fdm["propulsion/set-running"] = -1
        self.fdm["fcs/throttle-cmd-norm"] = 0.8
        self.fdm["fcs/mixture-cmd-norm"] = 0.9
        self.fdm["ap/altitude_setpoint"] = HEIGHT_M / self.FOOT_M
        self.fdm["ap/altitude_hold"] = 1
        self.fdm["ap/heading_setpoint"] = 0.0
        self.fdm["ap/heading_hold"] = 1

    def steer(self, heading_deg):
        self.fdm["ap/heading_setpoint"] = heading_deg % 360.0

    def step(self):
        """One tick on: latitude, longitude, height, and velocity in ECEF."""
        self.fdm.run()
        place = (
            self.fdm["position/lat-geod-deg"],
            self.fdm["position/long-gc-deg"],
            self.fdm["position/geod-alt-ft"] * self.FOOT_M,
        )
        axes = ("north", "east", "down")
        velocity = [self.fdm[f"velocities/v-{axis}-fps"] * self.FOOT_M for axis in axes]
        return place, from_north_east_down(velocity, *place[:2])


def datagram(t_s, place_m, velocity_mps):
    """A state with velocity in Skydel's layout: kind 7, derivatives 0, milliseconds, place, velocity, name."""
    return struct.pack("<BBd3d3dI", 7, 0, 1e3 * t_s, *place_m, *velocity_mps, 0)


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="target/release/gnss-twin")
    parser.add_argument("--seconds", type=float, default=90.0)
    parser.add_argument("--target-km", type=float, default=3.0, help="north-east of the start")
    parser.add_argument("--jam-at", type=float, help="second at which a jammer is switched on")
    arguments = parser.parse_args()

    kilometre_deg = math.degrees(1000.0 / SEMI_MAJOR_M)
    aside = arguments.target_km / math.sqrt(2) * kilometre_deg
    target_deg = (START_DEG[0] + aside, START_DEG[1] + aside / math.cos(math.radians(START_DEG[0])))

    with tempfile.TemporaryDirectory() as directory:
        scene = Path(directory, "scene.toml")
        scene.write_text(SCENE)
        accounts = Path(directory, "live.txt")
        port = free_port(socket.SOCK_DGRAM)
        live = subprocess.Popen(
            [arguments.program, "live", scene, "--to", "-", "--motion", f"udp:{port}"],
            stdout=subprocess.PIPE,
            stderr=accounts.open("wb"),
        )
        receive = subprocess.Popen(
            [arguments.program, "receive", "-", "--format", "ci8", "--rate-hz", str(RATE_HZ)]
            + ["--start", "2010-07-01T08:06:00", "--live", "--json", "-", "--out", Path(directory, "rx")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        latest = {}

        def listen():
            for line in receive.stdout:
                record = json.loads(line)
                if record["record"] == "fix":
                    latest["fix"] = record

        threading.Thread(target=listen, daemon=True).start()
        rig = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        send = lambda message: rig.sendto(message, ("127.0.0.1", port))

        aircraft, nearest_m, first_fix_s = Aircraft(), math.inf, None
        for tick in range(int(arguments.seconds / TICK_S)):
            samples = live.stdout.read(BYTES)
            if len(samples) < BYTES:
                raise SystemExit(f"the generator ended:\n{accounts.read_text()}")
            receive.stdin.write(samples)
            if tick == 0:
                # The program has begun, and listens.
                send(b"jammer 1 off")
            t_s = (tick + 1) * TICK_S
            place, velocity_mps = aircraft.step()
            send(datagram(t_s, ecef_m(*place), velocity_mps))
            if arguments.jam_at is not None and abs(t_s - arguments.jam_at) < TICK_S / 2:
                send(b"jammer 1 on")
            if "fix" in latest:
                fix = latest["fix"]
                first_fix_s = first_fix_s or t_s
                north_m, east_m = to_target(fix["latitude_deg"], fix["longitude_deg"], target_deg)
                aircraft.steer(math.degrees(math.atan2(east_m, north_m)))
            nearest_m = min(nearest_m, math.hypot(*to_target(*place[:2], target_deg)))
        receive.stdin.close()
        receive.wait()
        live.terminate()
        live.wait()
    found = "no fix" if first_fix_s is None else f"first fix after {first_fix_s:.1f} s"
    print(f"{found}; nearest to the target: {nearest_m:.1f} m")


if __name__ == "__main__":
    main()
