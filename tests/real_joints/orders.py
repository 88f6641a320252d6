#!/usr/bin/env python3
"""Waves over the motor's angle in the logs of the real joints: orders.py [--whole] [CASE...]

Independent of the tool. Least squares of the friction, inertia and gravity of a record, then one sine and cosine of each order from 0.5 to
60 per turn of the motor, in steps of 0.02: the order is not told to be a whole number, so that a peak at a whole one, in the fit and in the
hold-out alike, is evidence that the wave goes with the motor. Prints the highest peaks: order, share of the squared error above 3 Hz in
percent, amplitude in N m at the joint. --whole: of each whole order its share over the largest of the orders that are 0.2 to 0.8 away
from it, in the fit and in the hold-out, and its amplitude and phase in each record by itself. A wave of the motor keeps its phase, as
the position is absolute. Needs numpy and scipy."""
import sys

import numpy as np
from scipy.signal import butter, sosfiltfilt

sys.dont_write_bytecode = True  # leaves nothing in the sources
from signals import cases

GEAR = 100.0
ORDERS = np.arange(0.5, 60.0, 0.02)
MOTION_HZ, LOWEST_HZ, HIGHEST_HZ = 40.0, 3.0, 180.0
LEAST_SHARE, PEAKS, HIGHEST_WHOLE = 0.004, 9, 28


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


def parts_of(records):
    """Of each record the highest frequency that it shows, and its residual()."""
    return [(min(HIGHEST_HZ, 0.36 / r.step), *residual(r)) for r in records]


def wave(parts, order):
    """Share of the squared error, and amplitude and phase as a complex number; rows count whose wave lies below the highest frequency."""
    rows, errors = [], []
    for highest_hz, q, w, error, moves in parts:
        seen = moves & (order * GEAR * abs(w) / (2.0 * np.pi) < highest_hz)
        rows.append(np.c_[np.cos(order * GEAR * q), np.sin(order * GEAR * q)][seen])
        errors.append(error[seen])
    x, y = np.vstack(rows), np.concatenate(errors)
    if len(y) < 200:
        return 0.0, 0j
    coefficients = np.linalg.lstsq(x, y, rcond=None)[0]
    return 1.0 - np.sum((y - x @ coefficients) ** 2) / np.sum(y**2), complex(*coefficients)


def spectrum(records):
    """Share of the squared error and amplitude by order."""
    parts = parts_of(records)
    waves = [wave(parts, order) for order in ORDERS]
    return np.array([share for share, _ in waves]), np.array([abs(amplitude) for _, amplitude in waves])


def print_whole_orders(fit, hold):
    shares = [spectrum(records)[0] for records in (fit, hold)]
    for order in range(1, HIGHEST_WHOLE + 1):
        away = abs(ORDERS - order)
        over = [share[away < 0.05].max() / max(share[(away > 0.2) & (away < 0.8)].max(), 1e-9) for share in shares]
        alone = [wave(parts_of([r]), order)[1] for r in fit + hold]
        records = ", ".join(f"{abs(a):.3f} N m at {np.degrees(np.angle(a)):4.0f} deg" for a in alone)
        print(f"  {order:2}: {over[0]:.2f} and {over[1]:.2f} of its largest neighbour; {records}")


def main():
    wanted = [a for a in sys.argv[1:] if a != "--whole"]
    for name, (fit, hold, _, _) in cases().items():
        if name.startswith("emps") or (wanted and name not in wanted):
            continue
        turns = ", ".join(f"{np.ptp(r.position) * GEAR / (2.0 * np.pi):.0f}" for r in fit + hold)
        print(f"{name}: records of {turns} turns of the motor")
        if "--whole" in sys.argv:
            print_whole_orders(fit, hold)
            continue
        for part, records in (("fit", fit), ("hold-out", hold)):
            share, amplitude = spectrum(records)
            peaks = [k for k in range(len(ORDERS)) if share[k] > LEAST_SHARE and share[k] == share[max(0, k - 10):k + 11].max()]
            peaks = sorted(peaks, key=lambda k: -share[k])[:PEAKS]
            text = ", ".join(f"{ORDERS[k]:.2f} {100.0 * share[k]:.1f} % {amplitude[k]:.2f}" for k in peaks)
            print(f"  {part:8} {text}; median of all orders {100.0 * np.median(share):.2f} %")


if __name__ == "__main__":
    main()
