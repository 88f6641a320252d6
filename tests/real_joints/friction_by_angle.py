#!/usr/bin/env python3
"""Friction over the motor's angle in the logs of the real joints: friction_by_angle.py [CASE...]

Independent of the tool, and written after it had named such friction on joint4. Least squares of inertia, friction, offset, the scale of
the effort and s(w) (a cos(k N q) + b sin(k N q)) together, at 20 Hz, for orders k from 0.2 to 6 per turn of the motor in steps of 0.05:
the order is not told to be a whole number. Prints the orders that take most off the squared error, on the fit and on the hold-out, with the
amplitude in N m at the joint. Needs numpy and scipy."""
import sys

import numpy as np

sys.dont_write_bytecode = True  # leaves nothing in the sources
from signals import cases

GEAR = 100.0
MOTION_HZ, EVERY, SHOWN = 20.0, 4, 6
ORDERS = np.arange(0.2, 6.001, 0.05)


def signals_of(record):
    """Angle, direction, columns of the base model and effort of the samples that move."""
    q = record.low_pass(record.position, MOTION_HZ)
    w = np.gradient(q, record.step)
    fast = np.percentile(abs(w), 95)
    sign = np.tanh(w / (0.003 * fast))
    effort = record.low_pass(record.effort, MOTION_HZ)
    torque = np.zeros_like(q) if record.torque is None else record.low_pass(record.torque, MOTION_HZ)
    columns = np.c_[np.gradient(w, record.step), w, sign, np.ones_like(w), effort]
    moves = abs(w) > 0.05 * fast
    return q[moves][::EVERY], sign[moves][::EVERY], columns[moves][::EVERY], (effort - torque)[moves][::EVERY]


def stacked(parts, order):
    """Columns and target of several records; without a wave where `order` is None."""
    def wave(q, sign):
        return np.c_[sign * np.cos(order * GEAR * q), sign * np.sin(order * GEAR * q)]
    columns = [c if order is None else np.c_[c, wave(q, s)] for q, s, c, _ in parts]
    return np.vstack(columns), np.concatenate([y for *_, y in parts])


def errors(fit, hold, order):
    """Mean squared errors on fit and hold-out, and the amplitude."""
    x, y = stacked(fit, order)
    coefficients = np.linalg.lstsq(x, y, rcond=None)[0]
    there, target = stacked(hold, order)
    return (np.mean((y - x @ coefficients) ** 2), np.mean((target - there @ coefficients) ** 2),
            0.0 if order is None else np.hypot(*coefficients[-2:]))


def main():
    for name, (fit, hold, *_) in cases().items():
        if name.startswith("emps") or fit[0].torque is None or (sys.argv[1:] and name not in sys.argv[1:]):
            continue
        fit, hold = [signals_of(r) for r in fit], [signals_of(r) for r in hold]
        alone = errors(fit, hold, None)
        found = [(order, *errors(fit, hold, order)) for order in ORDERS]
        found.sort(key=lambda f: f[1])
        print(f"{name}: " + "; ".join(
            f"order {order:.2f}: {100.0 * (1.0 - on_fit / alone[0]):.1f} % of the fit, {100.0 * (1.0 - on_hold / alone[1]):.1f} % of the "
            f"hold-out, {size:.2f} N m" for order, on_fit, on_hold, size in found[:SHOWN]))


if __name__ == "__main__":
    main()
