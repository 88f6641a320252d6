"""Logs of real joints as signals on an even time grid, straight from the CSV files. Nothing of the tool is used here.

Everything is at the output in N m (EMPS: N) and rad (m): `effort` is motor current times torque constant times gear ratio."""
import os
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

DATA = Path(os.environ.get("FLEXSPLINE_DATA", Path(__file__).resolve().parents[2] / "../shared/data"))

LARGE, SMALL = 9.13, 5.852  # N m/A at the joint, the source's own factors


class Record:
    def __init__(self, name, time, position, effort, torque=None):
        self.name = name
        self.step = float(np.median(np.diff(time)))
        if np.ptp(np.diff(time)) > 1e-6:  # uneven: to an even grid
            even = np.arange(time[0], time[-1], self.step)
            position, effort = np.interp(even, time, position), np.interp(even, time, effort)
            time = even
        self.time, self.position, self.effort, self.torque = time, position, effort, torque

    def low_pass(self, values, cutoff):
        """Zero phase, fourth order each way."""
        if cutoff is None or cutoff >= 0.45 / self.step:
            return values
        sos = butter(4, cutoff * 2.0 * self.step, output="sos")
        return sosfiltfilt(sos, values, axis=0, padlen=min(len(values) - 1, int(2.0 / (cutoff * self.step))))

    def shifted(self, values, delay):
        """What the column says `delay` later."""
        return np.interp(self.time + delay, self.time, values)


def read(file):
    with open(file) as lines:
        names = lines.readline().strip().split(",")
    return dict(zip(names, np.genfromtxt(file, delimiter=",", skip_header=1, unpack=True)))


def kinova(folder, constant, parts):
    """`parts`: (file, from_s, to_s)."""
    records = []
    for file, begin, end in parts:
        c = read(DATA / "kinova-gen3" / folder / file)
        keep = (c["time_s"] >= begin) & (c["time_s"] <= end)
        torque = c["torque_nm"][keep] if "torque_nm" in c else None
        records.append(Record(Path(file).stem, c["time_s"][keep], c["joint_position_rad"][keep], constant * c["current_a"][keep], torque))
    return records


def cases():
    """Name: (fit records, hold-out records, columns of the base model, bandwidths in Hz)."""
    out = {}
    for joint, constant in (("joint1", LARGE), ("joint3", LARGE), ("joint4", LARGE), ("joint6", SMALL)):
        fit = [("fit/excitation-1.csv", 0, 99)] + ([] if joint == "joint1" else [("fit/run-1.csv", 0, 99)])
        out[joint] = (kinova(joint, constant, fit), kinova(joint, constant, [("holdout/excitation-2.csv", 0, 99)]),
                      ("a", "w", "s", "1"), (5, 10, 20, 40))
    for joint, constant, begin, middle, end in (("sweep1", LARGE, 0.36, 3.88, 6.23), ("sweep3", LARGE, 0.36, 3.88, 6.23),
                                                ("sweep4", LARGE, 0.36, 3.63, 5.82), ("sweep6", SMALL, 0.22, 3.49, 5.67)):
        file = f"sweep-{joint[-1]}.csv"
        gravity = ("g",) if joint in ("sweep4", "sweep6") else ()
        out[joint] = (kinova(joint, constant, [(f"fit/{file}", begin, middle)]), kinova(joint, constant, [(f"holdout/{file}", middle, end)]),
                      ("a", "s") + gravity, (5, 10, 20, 40))
    tiago = [[Record("excitation", c["time_s"], c["joint_position_rad"], 0.136 * 100 * c["current_a"])]
             for c in (read(DATA / "tiago-arm/arm1" / part / "excitation.csv") for part in ("fit", "holdout"))]
    out["arm1"] = (*tiago, ("a", "w", "s", "1"), (2, 5, 10, 20))
    c = read(DATA / "emps/emps_train.csv")
    half = c["time_s"] < 12.48
    out["emps"] = ([Record("first-half", c["time_s"][half], c["position_m"][half], c["motor_force_n"][half])],
                   [Record("second-half", c["time_s"][~half], c["position_m"][~half], c["motor_force_n"][~half])],
                   ("a", "w", "s", "1"), (20, 50, 100))
    c = read(DATA / "emps/emps_test_pulses.csv")
    half = c["time_s"] < 12.48
    out["emps-pulses"] = ([Record("first-half", c["time_s"][half], c["position_m"][half], c["motor_force_n"][half])],
                          [Record("second-half", c["time_s"][~half], c["position_m"][~half], c["motor_force_n"][~half])],
                          ("a", "w", "s", "1"), (20, 50, 100))
    return out
