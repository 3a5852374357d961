"""Draws the first fix of a run as an animation: sky, C/N0 and position error over the run's time.

python animate_run.py RUN OUT.gif: RUN is a directory that `gnss-twin run` wrote. Needs matplotlib and pandas.
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

matplotlib.use("agg")
import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation, PillowWriter

FRAMES, FRAMES_PER_S = 60, 6
COLOURS = {"G": "#0072b2", "E": "#d55e00", "R": "#cc3311", "C": "#009e73", "J": "#cc79a7", "I": "#997700", "S": "#666666"}


def enu_m(fixes, truth):
    """Errors of fixes east, north and up at the true positions of the same samples."""
    axes = ["x_m", "y_m", "z_m"]
    true = np.stack([np.interp(fixes["sample"], truth["sample"], truth[axis]) for axis in axes], axis=1)
    latitude, longitude = np.radians(truth[["latitude_deg", "longitude_deg"]].iloc[0])
    east = np.array([-np.sin(longitude), np.cos(longitude), 0])
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    return (fixes[axes].to_numpy() - true) @ np.stack([east, np.cross(up, east), up], axis=1)


def main(run, out):
    sky, truth = pd.read_csv(run / "truth/sky.csv"), pd.read_csv(run / "truth/trajectory.csv")
    fixes, tracking = pd.read_csv(run / "rx/fixes.csv"), pd.read_csv(run / "rx/tracking.csv", usecols=[0, 1, 2, 8])
    # Samples a second, from the receiver's first fixes.
    step = np.median(np.diff(fixes["sample"])) / np.median(np.diff(fixes["gps_s"] + fixes["gps_fraction_s"]))
    end_s = sky["sample"].max() / step
    errors = enu_m(fixes, truth)
    names = sorted(sky["sv"].unique())
    fig, (dome, bars, scatter) = plt.subplots(1, 3, figsize=(9, 3.2), dpi=90, width_ratios=[1, 1.3, 1])
    dome.remove()
    dome = fig.add_subplot(1, 3, 1, projection="polar", theta_offset=np.pi / 2, theta_direction=-1)

    def draw(frame):
        now_s = end_s * (frame + 1) / FRAMES
        for ax in (dome, bars, scatter):
            ax.clear()
        latest = tracking[(tracking["sample"] <= now_s * step) & (tracking["sample"] > (now_s - 1.0) * step)]
        found = latest.groupby("sv")["cn0_dbhz"].last()
        seen = sky[sky["sample"] <= now_s * step].groupby("sv").last()
        colours = [COLOURS.get(sv[0], "k") if sv in found else "0.8" for sv in seen.index]
        dome.set(rlim=(0, 90), rticks=[30, 60, 90], yticklabels=[], theta_offset=np.pi / 2, theta_direction=-1)
        dome.set_xticks(np.radians([0, 90, 180, 270]), ["N", "E", "S", "W"])
        dome.scatter(np.radians(seen["azimuth_deg"]), 90 - seen["elevation_deg"], c=colours, s=40)
        dome.set_title("sky: satellites tracked", fontsize=9)
        bars.bar(names, [found.get(sv, 0) for sv in names], color=[COLOURS.get(sv[0], "k") for sv in names])
        bars.set(ylim=(20, 55), title=f"C/N0 (dB-Hz), {now_s:4.1f} s")
        bars.tick_params(axis="x", rotation=90, labelsize=7)
        bars.title.set_fontsize(9)
        past = fixes["sample"] <= now_s * step
        reach = 1.2 * np.abs(errors[:, :2]).max()
        scatter.plot(*errors[past][:, :2].T, ".", color="#0072b2", markersize=3)
        scatter.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="east (m)", ylabel="north (m)")
        title = f"{past.sum()} fixes" if past.any() else "no fix yet"
        scatter.set_title(f"position error: {title}", fontsize=9)
        scatter.grid(color="0.9")

    fig.tight_layout()
    FuncAnimation(fig, draw, frames=FRAMES).save(out, writer=PillowWriter(fps=FRAMES_PER_S))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
