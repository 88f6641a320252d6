#!/usr/bin/env python3
"""Which effects are in the logs of the real joints: analyse.py [CASE...] [--all] [--with TERMS]

Independent of the tool: least squares on filtered columns, each candidate cross-validated by blocks of the records, by record, and on the
hold-out, at several bandwidths, with and without the samples near reversals. Prints for each case the shares of the base model's
squared error that a candidate explains, in percent; `behind` is the share of what presliding leaves, `there` the coefficients that
the hold-out has by itself, +- the jackknife's standard deviation. --with puts terms into the base first: T torque scale, b viscous asymmetry. Needs numpy and scipy."""
import sys

import numpy as np

sys.dont_write_bytecode = True  # leaves nothing in the sources
from signals import cases

# Blocks are interleaved, so that the fit has seen the range that is predicted.
BLOCKS, FOLDS = 24, 4
PRESLIDING = (0.0003, 0.001, 0.002, 0.004, 0.008, 0.015, 0.03, 0.06)  # rad at the output
EMPS_PRESLIDING = (5e-6, 2e-5, 5e-5, 2e-4, 5e-4, 2e-3)                # m
EXPONENTS = (0.15, 0.25, 0.35, 0.5, 0.7)


class View:
    """A record's columns at one bandwidth."""

    def __init__(self, record, cutoff, delay=0.0):
        self.record, self.cutoff, self.delay = record, cutoff, delay
        wide = record.low_pass(record.position, 2.0 * cutoff)
        self.q = wide
        self.w = np.gradient(wide, record.step)
        self.a = np.gradient(self.w, record.step)
        self.s = np.tanh(self.w / (0.003 * np.percentile(np.abs(self.w), 95)))
        self.one = np.ones_like(self.w)
        self.load = None if record.torque is None else record.low_pass(record.torque, cutoff)
        effort = record.shifted(record.effort, delay)
        self.raw_target = effort - (0.0 if record.torque is None else record.torque)
        self.y = self.filtered(self.raw_target)
        self.effort = self.filtered(effort)
        self.effort_model = self.effort

    def filtered(self, column):
        return self.record.low_pass(column, self.cutoff)

    def presliding(self, length):
        """Dahl's state over the angle; rest before the record, so it begins at 0 where the record begins at rest."""
        step = np.diff(self.q, prepend=self.q[0])
        z = np.empty_like(step)
        value = 0.0 if abs(self.w[:20]).max() < 0.1 * np.abs(self.w).max() else np.sign(self.w[0])
        for k, d in enumerate(step):
            toward = 1.0 if d > 0 else -1.0
            value = toward - (toward - value) * np.exp(-abs(d) / length)
            z[k] = value
        return z

    def keep(self, masked):
        edge = max(2, int(0.5 / (self.cutoff * self.record.step)))
        good = np.ones(len(self.w), bool)
        good[:edge] = good[-edge:] = False
        # Standing still for longer than a tenth of a second: no law of the velocity says what friction is there.
        still = np.abs(self.w) < 0.01 * np.percentile(np.abs(self.w), 95)
        long = max(3, int(0.1 / self.record.step))
        rest = np.convolve(np.convolve(still, np.ones(long), "valid") > long - 0.5, np.ones(long), "full") > 0.5
        good &= ~rest
        if masked:
            slow = np.abs(self.w) < 0.05 * np.percentile(np.abs(self.w), 95)
            width = max(1, int(0.5 / (self.cutoff * self.record.step)))
            near = np.convolve(slow, np.ones(2 * width + 1), "same")[: len(slow)] > 0.5
            good &= ~near
        return good


def base_columns(view, names, direction):
    columns = {"a": [view.a], "w": [view.w], "s": [direction], "1": [view.one], "g": [np.cos(view.q), np.sin(view.q), view.one],
               "T": [view.load], "b": [np.abs(view.w)], "d": [np.gradient(view.effort_model, view.record.step)] if "d" in names else []}
    return [c for n in names for c in columns[n]]


def candidates(views, names, gear=100.0):
    """Name: list of (what it replaces, function of view and direction to columns), one for each nonlinear parameter."""
    speed = np.percentile(np.abs(np.concatenate([v.w for v in views])), 95)
    emps = gear == 1.0
    out = {}
    out["power law for viscous"] = [(f"d={d}", "w", lambda v, s, d=d: [s * np.abs(v.w / speed) ** d]) for d in EXPONENTS] if "w" in names else []
    out["stribeck"] = [(f"vs={x * speed:.3g}", "", lambda v, s, x=x: [s * np.exp(-(v.w / (x * speed)) ** 2)]) for x in (0.04, 0.07, 0.12, 0.2, 0.25)]
    out["stribeck by direction"] = [(f"vs={x * speed:.3g}", "", lambda v, s, x=x: [np.maximum(s, 0) * np.exp(-(v.w / (x * speed)) ** 2),
                                    np.minimum(s, 0) * np.exp(-(v.w / (x * speed)) ** 2)]) for x in (0.04, 0.07, 0.12, 0.2, 0.25)]
    out["quadratic drag"] = [("", "", lambda v, s: [v.w * np.abs(v.w)])]
    out["viscous asymmetry"] = [("", "", lambda v, s: [np.abs(v.w)])]
    if "w" not in names:
        out["viscous"] = [("", "", lambda v, s: [v.w])]
    if "1" not in names and "g" not in names:
        out["constant"] = [("", "", lambda v, s: [v.one])]
    if views[0].load is not None:
        out["load friction"] = [("", "", lambda v, s: [s * np.abs(v.load)])]
        out["torque scale"] = [("", "", lambda v, s: [v.load])]
        out["torque scale and load friction"] = [("", "", lambda v, s: [v.load, s * np.abs(v.load)])]
        out["sensor of the torque late"] = [("", "", lambda v, s: [np.gradient(v.load, v.record.step)])]
    if "g" not in names:
        out["gravity"] = [("", "", lambda v, s: [np.cos(v.q), np.sin(v.q)])]
    else:
        out["second harmonic of the angle"] = [("", "", lambda v, s: [np.cos(2 * v.q), np.sin(2 * v.q)])]
    out["cubic effort"] = [("", "", lambda v, s: [v.modelled ** 3])]
    out["effort late or early"] = [("", "", lambda v, s: [np.gradient(v.modelled, v.record.step)])]
    out["creep from the start"] = [(f"{t} s", "", lambda v, s, t=t: [np.exp(-(v.record.time - v.record.time[0]) / t)]) for t in (0.3, 1.0, 3.0)]
    out["elastic load"] = [("", "", lambda v, s: [np.gradient(np.gradient(v.a, v.record.step), v.record.step)])]
    if emps:
        out["ripple of 2.5 mm"] = [("", "", lambda v, s: [np.cos(2 * np.pi * v.q / 0.0025), np.sin(2 * np.pi * v.q / 0.0025)])]
        out["position, cubic"] = [("", "", lambda v, s: [v.q, v.q**2, v.q**3])]
        out["friction over position"] = [("", "", lambda v, s: [s * v.q, s * v.q**2])]
    else:
        for k in (1, 2, 4):
            out[f"ripple {k}"] = [("", "", lambda v, s, k=k: [np.cos(k * gear * v.q), np.sin(k * gear * v.q)])]
    return out


def solve(x, y):
    scale = np.sqrt((x**2).mean(axis=0)) + 1e-300
    return np.linalg.lstsq(x / scale, y, rcond=1e-9)[0] / scale


class Design:
    def __init__(self, views, base, masked, replaced="", more=None, length=None):
        self.x, self.y, self.block, self.record, self.own = [], [], [], [], 0
        for r, v in enumerate(views):
            direction = v.s if length is None else v.presliding(length)
            columns = base_columns(v, [n for n in base if n != replaced], direction)
            self.own = len(columns)
            columns = columns + (more(v, direction) if more else [])
            keep = v.keep(masked)
            self.x.append(v.filtered(np.column_stack(columns))[keep])
            self.y.append(v.y[keep])
            n = len(v.y)
            self.block.append((np.arange(n) * BLOCKS // n)[keep])
            self.record.append(np.full(keep.sum(), r))
        self.x, self.y = np.concatenate(self.x), np.concatenate(self.y)
        self.block, self.record = np.concatenate(self.block), np.concatenate(self.record)

    def error(self):
        return float(np.sum((self.y - self.x @ solve(self.x, self.y)) ** 2))

    def by(self, groups):
        total = 0.0
        for g in np.unique(groups):
            test = groups == g
            total += np.sum((self.y[test] - self.x[test] @ solve(self.x[~test], self.y[~test])) ** 2)
        return float(total)

    def by_blocks(self):
        return self.by(self.block % FOLDS)

    def jackknife(self, pieces=12):
        """Standard deviations of what is added to the base, leaving out one contiguous piece after the other."""
        piece = np.arange(len(self.y)) * pieces // len(self.y)
        left_out = np.array([solve(self.x[piece != k], self.y[piece != k])[self.own:] for k in range(pieces)])
        return np.sqrt((pieces - 1) * left_out.var(axis=0))

    def on(self, other):
        """Error on other records: as fitted, and with the base's own parameters refitted there."""
        theta = solve(self.x, self.y)
        plain = float(np.sum((other.y - other.x @ theta) ** 2))
        rest = other.y - other.x[:, self.own:] @ theta[self.own:]
        own = other.x[:, : self.own]
        return plain, float(np.sum((rest - own @ solve(own, rest)) ** 2))


def share(before, after):
    return 100.0 * (1.0 - after / before)


def best(fit, base, masked, variants, length=None):
    """The variant with the least error by blocks: (error by blocks, parameter, replaced, columns)."""
    found = [(Design(fit, base, masked, replaced, more, length).by_blocks(), p, replaced, more) for p, replaced, more in variants]
    return min(found, key=lambda f: f[0])


def model_effort(views, base):
    """What the base model says of the effort, so that no candidate is made of the target's own noise."""
    for v in views:
        x = v.filtered(np.column_stack(base_columns(v, base, v.s)))
        v.effort_model = v.modelled = x @ solve(x, v.y) + (v.load if v.load is not None else 0.0)


def report(name, fit_records, hold_records, base, cutoffs, everything):
    gear = 1.0 if name.startswith("emps") else 100.0
    lengths = EMPS_PRESLIDING if gear == 1.0 else PRESLIDING
    moving = name.startswith("sweep")
    print(f"\n== {name}")
    for cutoff in cutoffs:
        for masked in ((False,) if moving else (False, True)):
            fit, hold = [View(r, cutoff) for r in fit_records], [View(r, cutoff) for r in hold_records]
            model_effort(fit, base)
            model_effort(hold, base)
            plain, plain_hold = Design(fit, base, masked), Design(hold, base, masked)
            reference = plain.by_blocks(), plain.on(plain_hold)
            rms = np.sqrt(plain.error() / len(plain.y))
            delays = np.arange(-0.01, 0.0101, 0.001) if fit[0].record.step < 0.005 else np.arange(-0.05, 0.0501, 0.01)
            by_delay = [Design([View(r, cutoff, d) for r in fit_records], base, masked).error() for d in delays]
            late = int(np.argmin(by_delay))
            print(f"-- {cutoff} Hz, reversals {'masked' if masked else 'kept'}: base RMS {rms:.3g}, by blocks {np.sqrt(reference[0] / len(plain.y)):.3g}, "
                  f"hold-out {np.sqrt(reference[1][0] / len(plain_hold.y)):.3g}, refitted {np.sqrt(reference[1][1] / len(plain_hold.y)):.3g}; samples "
                  f"{len(plain.y)} of {sum(len(v.y) for v in fit)}; effort {1e3 * delays[late]:+.0f} ms: {share(plain.error(), by_delay[late]):.0f} %; "
                  f"theta {np.array2string(solve(plain.x, plain.y), precision=3)}")
            # Presliding first: the others stand alone and behind it.
            length = None
            if not moving:
                errors = [Design(fit, base, masked, length=x).by_blocks() for x in lengths]
                length = lengths[int(np.argmin(errors))]
                d = Design(fit, base, masked, length=length)
                d_hold = d.on(Design(hold, base, masked, length=length))
                print(f"   {'presliding':32} {share(reference[0], min(errors)):6.1f} hold-out {share(reference[1][0], d_hold[0]):6.1f} refitted "
                      f"{share(reference[1][1], d_hold[1]):6.1f}   length {length}, theta {np.array2string(solve(d.x, d.y), precision=3)}")
                behind = min(errors), d_hold
            for candidate, variants in candidates(fit, base, gear).items():
                if not variants:
                    continue
                error, p, replaced, more = best(fit, base, masked, variants)
                d = Design(fit, base, masked, replaced, more)
                there = Design(hold, base, masked, replaced, more)
                on = d.on(there)
                theta, theta_there = solve(d.x, d.y)[d.own:], solve(there.x, there.y)[d.own:]
                text = f"   {candidate:32} {share(reference[0], error):6.1f} hold-out {share(reference[1][0], on[0]):6.1f} refitted {share(reference[1][1], on[1]):6.1f}"
                if len(fit) > 1:
                    text += f" by record {share(plain.by(plain.record), d.by(d.record)):6.1f}"
                interesting = share(reference[0], error) > 3
                if length is not None:
                    error2, p2, replaced, more = best(fit, base, masked, variants, length)
                    d2 = Design(fit, base, masked, replaced, more, length)
                    on2 = d2.on(Design(hold, base, masked, replaced, more, length))
                    text += f" | behind {share(behind[0], error2):6.1f} hold-out {share(behind[1][0], on2[0]):6.1f} refitted {share(behind[1][1], on2[1]):6.1f} {p2}"
                    text += f" {np.array2string(solve(d2.x, d2.y)[d2.own:], precision=3)}"
                    interesting |= share(behind[0], error2) > 3
                if interesting or everything:
                    print(f"{text}   {p} {np.array2string(theta, precision=3)} +- {np.array2string(d.jackknife(), precision=3)} there "
                          f"{np.array2string(theta_there, precision=3)} +- {np.array2string(there.jackknife(), precision=3)}")
            if gear > 1.0:
                random = np.random.default_rng(1)
                orders = random.uniform(0.6, 5.0, 12)
                shares = [share(reference[0], Design(fit, base, masked, "", lambda v, s, k=k: [np.cos(k * gear * v.q), np.sin(k * gear * v.q)]).by_blocks())
                          for k in orders]
                print(f"   {'ripple, 12 placebo orders':32} {max(shares):6.1f} at most, at {orders[int(np.argmax(shares))]:.2f}; median {np.median(shares):.1f}")


def main():
    words = sys.argv[1:]
    more = words[words.index("--with") + 1] if "--with" in words else ""
    wanted = [a for a in words if not a.startswith("-") and a != more]
    for name, (fit, hold, base, cutoffs) in cases().items():
        if not wanted or name in wanted:
            report(name, fit, hold, base + tuple(more), cutoffs, "--all" in words)


if __name__ == "__main__":
    main()
