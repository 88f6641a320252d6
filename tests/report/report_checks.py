"""Parts of the page that report.py makes which no table of the report has: the common model on each run, derivatives compared, and
what `diagnose` names. Each takes the page, the tool, the data sets and a folder for answers; nothing here estimates anything."""
import json
import math
import random
import re
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SHOWN_METHODS = ("kalman-rts", "butterworth-zero-phase", "h2-bilinear", "h1-bilinear", "h2-matched", "bilinear", "backward")


def number(x):
    return "–" if x is None else f"{x:.3g}"


def answer_of(command, file):
    done = subprocess.run([str(c) for c in command] + ["--json", str(file)], capture_output=True, text=True)
    if done.returncode or not file.exists():
        return None, (done.stderr.strip().splitlines() or ["no answer"])[-1]
    return json.loads(file.read_text()), ""


def with_values(text, values):
    """A model's text with fixed values: {effect: {parameter: (value, unit)}}."""
    for effect, parameters in values.items():
        lines = "".join(f'{name} = {{ value = {value:g}, unit = "{unit}", fixed = true }}\n' for name, (value, unit) in parameters.items())
        text = re.sub(rf'type = "{effect}"\n(?!\[effect)', f'type = "{effect}"\n[effect.parameters]\n{lines}', text)
    return text


def errors_of(compared, signal):
    """Error over the signal's standard deviation, percent, by experiment."""
    return {e["name"]: 100.0 * s["nrmse"] for e in compared["experiments"] for s in e["signals"] if s["signal"] == signal and s["nrmse"] is not None}


def common_model(page, tool, data, out):
    """Section 5.3: one model, the averages of table 7, on every run of table 7, beside each run's own model."""
    # Averages of table 7; the load's values are the twin's (hil/rhs100).
    averages = {"inertia": {"inertia": (1.04e-4, "kg*m^2")},
                "viscous_friction": {"coefficient": (0.5 * (3.73e-4 + 3.52e-4), "N*m*s/rad")},
                "coulomb_friction": {"torque": (0.5 * (4.60e-2 + 4.43e-2), "N*m")},
                "viscous_asymmetry": {"coefficient": (0.5 * (3.73e-4 - 3.52e-4), "N*m*s/rad")},
                "coulomb_asymmetry": {"torque": (0.5 * (4.60e-2 - 4.43e-2), "N*m")},
                "output_inertia": {"inertia": (0.06, "kg*m^2")}, "output_viscous_friction": {"coefficient": (0.5, "N*m*s/rad")},
                "output_coulomb_friction": {"torque": (0.6, "N*m")}}
    base = data / "table-7/base-model.toml"
    model = out / "common-model.toml"
    model.write_text(with_values(base.read_text(), averages))
    common, problem = answer_of((tool, "compare", "--model", model, data / "table-7"), out / "common-model.json")
    page.add("## The common model of section 5.3", "")
    if common is None:
        page.add(problem, "")
        return
    own = {"motor_velocity": {}, "motor_balance": {}}
    for run in errors_of(common, "motor_velocity"):
        fitted = out / f"own-{run}.toml"
        found, _ = answer_of((tool, "identify", data / "table-7" / f"{run}.csv", "--model", base, "--out", fitted), out / f"own-{run}-identified.json")
        compared, _ = answer_of((tool, "compare", "--model", fitted, data / "table-7" / f"{run}.csv"), out / f"own-{run}.json") if found else (None, "")
        for signal in own:
            own[signal].update(errors_of(compared, signal) if compared else {})
    page.add("The report finds an \"accurate match\" of one model, the averages, on more than twenty experiments. The same averages on the 26 runs of",
             "table 7, whose rows differ by 16 to 24 %: error over the signal's standard deviation. Not circular: averages and rows are the report's.", "",
             "| signal | common model: median | largest | each run's own model: median | largest |", "| --- | ---: | ---: | ---: | ---: |")
    for signal, name in (("motor_velocity", "motor velocity, free run"), ("motor_balance", "motor torque")):
        ours = errors_of(common, signal)
        worst = max(ours, key=ours.get)
        mine = own[signal]
        page.add(f"| {name} | {statistics.median(ours.values()):.3g} % | {ours[worst]:.3g} % ({worst}) | "
                 + (f"{statistics.median(mine.values()):.2g} % | {max(mine.values()):.2g} % |" if mine else "– | – |"))
    page.add("", "So in figures 45 and 55 to 60 match runs whose values are near the averages. What is left is the spread of the rows, not a missing term.", "")


def derivatives(page, tool, data, out, figures):
    """Section 1.3.4 and 4.3: ways to a derivative, on the output's encoder, which has no tachometer."""
    run = "50-1-06"
    page.add("## Derivatives", "", f"`flexspline derivatives` on run {run} of table 7. `kalman-rts`: smoother of Rauch, Tung and Striebel, covariances by maximum",
             "likelihood. Noise: what the position's noise causes. Reference: the measured velocity; the output has none, there the smoother.", "")
    found, problem = answer_of((tool, "derivatives", data / "table-7" / f"{run}.csv", "--picture", figures / "derivatives.svg"), out / "derivatives.json")
    if found is None:
        page.add(problem, "")
        return
    for c in found["comparisons"]:
        page.add(f"`{c['column']}`: filters of {c['cutoff_hz']:.3g} Hz, smoother's corner {c['smoother_corner_hz']:.3g} Hz; reference {c['reference']}, "
                 f"{c['velocity_rms']:.3g} rad/s and {c['acceleration_rms']:.3g} rad/s² rms", "",
                 "| method | noise, rad/s | rad/s² | lag, ms | differs, rad/s | rad/s² |", "| --- | ---: | ---: | ---: | ---: | ---: |")
        for name in SHOWN_METHODS:
            m = next(m for m in c["methods"] if m["method"] == name)
            lag = None if m["lag_s"] is None else 1e3 * m["lag_s"]
            page.add(f"| {name} | {number(m['velocity_noise'])} | {number(m['acceleration_noise'])} | {number(lag)} | "
                     f"{number(m['velocity_difference'])} | {number(m['acceleration_difference'])} |")
        page.add("")
    page.add("![Velocity and acceleration by four methods](figures/derivatives.svg)", "")
    largest = {}
    for table in ("table-7", "table-8"):
        folder = data / table
        both = [answer_of((tool, "identify", folder, "--model", folder / "base-model.toml", *more), out / f"{table}-{name}.json")[0]
                for name, more in (("butterworth", ()), ("kalman", ("--derivatives", "kalman")))]
        if None not in both:
            changes = [abs(k["value"] / b["value"] - 1.0) for b, k in zip(*[x["parameters"] for x in both]) if b["value"] and not b.get("fixed")]
            largest[table] = 100.0 * max(changes)
    page.add("`identify --derivatives kalman` in place of the default changes no parameter of " +
             " and ".join(f"{t.replace('-', ' ')} by more than {v:.2g} %" for t, v in largest.items()) + " (all runs together).", "")


def both_ways(signal, corner_hz, sample_s):
    """Two first-order low-passes, each forward and backward."""
    keep = math.exp(-2.0 * math.pi * corner_hz * sample_s)
    for _ in range(2):
        for step in (1, -1):
            state, out = signal[::step][0], []
            for x in signal[::step]:
                state = keep * state + (1.0 - keep) * x
                out.append(state)
            signal = out[::step]
    return signal


def standstill_amplitude(frequency_hz, seconds=10.0):
    """The amplitude of a term of 0.1 rad/s, all else known, that a regression finds in a motor with viscous and Coulomb friction alone
    (averages of table 7) under a saw-tooth current of 20 % of 7 A, if it keeps the samples at standstill. Noise as in hil/rhs100."""
    noise, sample_s, steps = random.Random(7001), 1e-3, 4
    inertia, viscous, coulomb, torque_constant = 1.04e-4, 3.6e-4, 4.43e-2, 0.04275
    v, velocity, torque = 0.0, [], []
    for k in range(int(seconds / sample_s)):
        turn = (k * sample_s * frequency_hz) % 1.0
        tau = torque_constant * 1.4 * (4.0 * turn if turn < 0.25 else 2.0 - 4.0 * turn if turn < 0.75 else 4.0 * turn - 4.0)
        velocity.append(v + 0.02 * noise.gauss(0.0, 1.0))
        torque.append(tau + torque_constant * 0.014 * noise.gauss(0.0, 1.0))
        for _ in range(steps):  # implicit in the friction: it stops where it cannot go on
            free = v + sample_s / steps * tau / inertia
            v = math.copysign(max(abs(free) - sample_s / steps * coulomb / inertia, 0.0), free) / (1.0 + sample_s / steps * viscous / inertia)
    velocity, torque = both_ways(velocity, 20.0, sample_s), both_ways(torque, 20.0, sample_s)
    along = squares = 0.0
    for k in range(1, len(velocity) - 1):
        sign = 1.0 if velocity[k] > 0.0 else -1.0
        column = math.exp(-(velocity[k] / 0.1) ** 2) * sign
        slope = 0.5 * (velocity[k + 1] - velocity[k - 1]) / sample_s
        along += column * (torque[k] - inertia * slope - viscous * velocity[k] - coulomb * sign)
        squares += column * column
    return along / squares


def whole_drive(cases, data):
    """Tables 4, 7 and 8 together, as a case of diagnose_cases.py."""
    folder = cases / "whole-drive"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name in ("table-4", "table-7", "table-8"):
        shutil.copytree(data / name, folder / name)
    for name in ("dataset.toml", "base-model.toml"):
        shutil.copy(data / name, folder / name)
    (folder / "truth.toml").write_text("".join((cases / name / "truth.toml").read_text() for name in ("table-4", "table-7", "table-8")))


def diagnosed(page, tool, cases_tool, data, out):
    """What `diagnose` names on the report's own tables, whole and row by row."""
    cases = out.parent / "cases"
    shutil.rmtree(cases, ignore_errors=True)
    cases.mkdir(parents=True)
    subprocess.run([str(cases_tool), str(cases)], check=True, capture_output=True)
    whole_drive(cases, data)
    done = subprocess.run([sys.executable, str(HERE / "diagnose_cases.py"), str(tool), str(cases)], capture_output=True, text=True)
    (out / "diagnose.txt").write_text(done.stdout + done.stderr)
    page.add("## What `diagnose` names", "",
             "Whole drive: tables 4, 7 and 8 together. In a single row nothing is missing: a name is false.",
             "In table 7 as a whole the viscosity falls with the amplitude (power -0.65): sublinear friction is right. In the whole drive the slower runs of table 8",
             "contradict that law (average viscosity, 3.6e-4 N m s/rad; the law has more): right is the law for a range of speeds, without a name.", "",
             "| records | verdict | named | result | s |", "| --- | --- | --- | --- | ---: |")
    rows = [line for line in done.stdout.splitlines() if line.startswith("| ")]
    if not rows:
        page.add(done.stderr.strip()[-300:], "")
        return
    cells = [[c.strip() for c in row.strip("|").split("|")] for row in rows[2:]]
    for number_of_table in (4, 6, 7, 8):
        of = [c for c in cells if c[0].startswith(f"table-{number_of_table}-rows")]
        verdicts = ", ".join(f"{v} {sum(c[1] == v for c in of)}" for v in sorted({c[1] for c in of}))
        named = ", ".join(f"{c[0].split('/')[1]}: {c[2]}" for c in of if c[2] not in ("-", "")) or "-"
        seconds = sorted(float(c[4]) for c in of)
        page.add(f"| {len(of)} rows of table {number_of_table} | {verdicts} | {named} | {sum(c[3] == 'FALSE' for c in of)} false | {seconds[0]:g} to {seconds[-1]:g} |")
    for c in cells:
        if "/" not in c[0]:
            page.add(f"| {c[0].replace('-', ' ')} | {' | '.join(c[1:])} |")
    page.add("", done.stdout.strip().splitlines()[-1], "")
