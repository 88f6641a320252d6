#!/usr/bin/env python3
"""Waves over the motor's angle in the logs of the real joints: orders.py [CASE...]

Independent of the tool. Least squares of the friction, inertia and gravity of a record, then one sine and cosine of each order from 0.5 to
60 per turn of the motor, in steps of 0.02: the order is not told to be a whole number, so that a peak at a whole one, in the fit and in the
hold-out alike, is evidence that the wave goes with the motor. Prints the highest peaks: order, share of the squared error above 3 Hz in
percent, amplitude in N m at the joint. Needs numpy and scipy."""
import sys

import numpy as np
from scipy.signal import butter, sosfiltfilt

sys.dont_write_bytecode = True  # leaves nothing in the sources
from signals import cases

GEAR = 100.0
ORDERS = np.arange(0.5, 60.0, 0.02)
MOTION_HZ, LOWEST_HZ, HIGHEST_HZ = 40.0, 3.0, 180.0
LEAST_SHARE, PEAKS = 0.004, 9


def residual(record):
    """Angle, speed and error of the rigid model of one record, and which rows move."""
    q = record.low_pass(record.position, MOTION_HZ)
    w = np.gradient(q, record.step)
    sign = np.tanh(w / (0.003 * np.percentile(abs(w), 95)))
    columns = np.c_[np.gradient(w, record.step), w, sign, np.ones_like(w), np.sin(q), np.cos(q)]
    y = record.effort - (0.0 if record.torque is None else record.torque)
    error = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
    high_pass = butter(2, LOWEST_HZ * 2.0 * record.step, "high", output="sos")
    return q, w, sosfiltfilt(high_pass, error), abs(w) > 0.1 * np.percentile(abs(w), 95)


def spectrum(records):
    """Share of the squared error and amplitude by order; rows count whose wave lies below the highest frequency."""
    parts = [(min(HIGHEST_HZ, 0.36 / r.step), *residual(r)) for r in records]
    share, amplitude = np.zeros(len(ORDERS)), np.zeros(len(ORDERS))
    for k, order in enumerate(ORDERS):
        rows, errors = [], []
        for highest_hz, q, w, error, moves in parts:
            seen = moves & (order * GEAR * abs(w) / (2.0 * np.pi) < highest_hz)
            rows.append(np.c_[np.cos(order * GEAR * q), np.sin(order * GEAR * q)][seen])
            errors.append(error[seen])
        x, y = np.vstack(rows), np.concatenate(errors)
        if len(y) < 200:
            continue
        coefficients = np.linalg.lstsq(x, y, rcond=None)[0]
        share[k] = 1.0 - np.sum((y - x @ coefficients) ** 2) / np.sum(y**2)
        amplitude[k] = np.hypot(*coefficients)
    return share, amplitude


def main():
    wanted = sys.argv[1:]
    for name, (fit, hold, _, _) in cases().items():
        if name.startswith("emps") or (wanted and name not in wanted):
            continue
        turns = ", ".join(f"{np.ptp(r.position) * GEAR / (2.0 * np.pi):.0f}" for r in fit + hold)
        print(f"{name}: records of {turns} turns of the motor")
        for part, records in (("fit", fit), ("hold-out", hold)):
            share, amplitude = spectrum(records)
            peaks = [k for k in range(len(ORDERS)) if share[k] > LEAST_SHARE and share[k] == share[max(0, k - 10):k + 11].max()]
            peaks = sorted(peaks, key=lambda k: -share[k])[:PEAKS]
            text = ", ".join(f"{ORDERS[k]:.2f} {100.0 * share[k]:.1f} % {amplitude[k]:.2f}" for k in peaks)
            print(f"  {part:8} {text}; median of all orders {100.0 * np.median(share):.2f} %")


if __name__ == "__main__":
    main()
