#!/usr/bin/env python3
"""Odd but well-formed measurements through every command that takes data: odd_data.py TOOLS SETS FOLDER [FIRST] [--all] [--NAME]... [--minutes=M]

Few samples, constant, quantised, saturated, one-directional, huge, tiny and equal columns, any of them present, the load free or
locked. Each command ends by itself with 0, 1 or 2 and, where it refuses, with a message: no signal, no std::bad_alloc, no
time-out. SETS sets, from number FIRST (0) on; each is the same whenever and wherever it is made. --all runs the commands too
that are marked as not ready, --NAME some by their name. With --minutes it ends after so long, and the next call goes on from
there until SETS are done. What fails is left in FOLDER with the line to run; exit code 1 then."""
import math
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

SECONDS, MEMORY = 60, 4 << 30
COLUMNS = ("current_a", "motor_torque_nm", "motor_position_rad", "motor_velocity_rad_s", "output_position_rad",
           "output_velocity_rad_s", "torque_nm", "temperature_c", "load_torque_nm", "velocity_command_rad_s",
           "position_command_rad", "current_command_a")
MODEL = """format = "flexspline-model/1"
[drive]
gear_ratio = 100
torque_constant_nm_a = 0.05
rated_current_a = 2
rated_velocity_rad_s = 200
rated_torque_nm = 40
[[effect]]
type = "inertia"
[effect.parameters]
inertia = { value = 1e-4 }
[[effect]]
type = "viscous_friction"
[effect.parameters]
coefficient = { value = 4e-4 }
[[effect]]
type = "coulomb_friction"
[effect.parameters]
torque = { value = 0.04 }
"""
# Command line and whether it runs in the tests.
COMMANDS = {
    "check": ("flexspline check {data}", True),
    "new": ("flexspline new --from {data} --out project --force", True),
    "measure": ("flexspline measure {data}", True),
    "derivatives": ("flexspline derivatives {data}", True),
    "simulate": ("flexspline simulate --model model.toml {data} --out simulated", True),
    "compare": ("flexspline compare --model model.toml {data}", True),
    "sensitivity": ("flexspline sensitivity --model model.toml {data}", True),
    "beside": ("flexspline compare --model model.toml {data} --baseline arx:2,2,1 --report page.html", True),
    "identify": ("flexspline identify {data} --model model.toml --out fitted.toml", True),
    "identify-base": ("flexspline identify {data} --model project/base-model.toml", True),
    "identify-kalman": ("flexspline identify {data} --model model.toml --derivatives kalman", True),
    "identify-iv": ("flexspline identify {data} --model model.toml --method iv", True),
    "identify-oe": ("flexspline identify {data} --model model.toml --method oe", True),
    "identify-profile": ("flexspline identify {data} --model model.toml --intervals profile", True),
    "identify-bootstrap": ("flexspline identify {data} --model model.toml --intervals bootstrap", True),
    "diagnose": ("flexspline diagnose --model model.toml {data}", True),
    "add": ("flexspline add stribeck_gaussian --model model.toml {data} --out added.toml", True),
    "add-table": ("flexspline add table_effect:velocity --model model.toml {data} --out table.toml", True),
    "remove": ("flexspline remove coulomb_friction --model model.toml {data} --out removed.toml", True),
    "sensitivity-refit": ("flexspline sensitivity --refit --model model.toml {data}", True),
    "plan": ("flexspline plan --model model.toml {data} --out plan.toml --motions 1 --run-s 2", True),
    "fleet": ("flexspline fleet run {folder} --model model.toml --out fleet.json --diagnose", True),
}


def signal(chance, count, sample_s, made):
    """One column of a kind that loggers and broken sensors make."""
    kind = chance.choice(("sine", "sine", "sine", "noise", "constant", "zero", "quantised", "saturated", "one_way", "triangle",
                          "steps", "spike", "same", "ramp"))
    scale = 10.0 ** chance.choice((0, 0, 0, 0, 1, -1, 3, -3, 6, -6, 12, -12, 150, -150, 300, -300))
    turns = chance.choice((0.2, 1.0, 3.0, 10.0)) * 2 * math.pi / max(count, 2)
    if kind == "same" and made:
        return list(chance.choice(made))
    values = []
    for k in range(count):
        x = math.sin(turns * k + 0.3)
        if kind == "noise":
            x = chance.gauss(0, 1)
        elif kind in ("constant", "same"):
            x = 1.7
        elif kind == "zero":
            x = 0.0
        elif kind == "quantised":
            x = round(3 * x) / 3
        elif kind == "saturated":
            x = max(-0.4, min(0.4, x))
        elif kind == "one_way":
            x = abs(x) + 0.01
        elif kind == "triangle":
            x = abs((turns * k / math.pi) % 2 - 1)
        elif kind == "steps":
            x = math.floor(k * 6 / max(count, 1)) - 2.5
        elif kind == "spike":
            x = 1e6 if k == count // 2 else x
        elif kind == "ramp":
            x = k * sample_s
        values.append(x * scale)
    return values


def motion(chance, count, sample_s):
    """A drive that moves as drives do, with a little noise, so that fits have something to fit."""
    rate = chance.choice((2.0, 6.0, 20.0))
    columns = {name: [] for name in COLUMNS[:7]}
    for k in range(count):
        t = k * sample_s
        speed, angle = 60 * math.cos(rate * t), 60 * math.sin(rate * t) / rate
        effort = 1e-4 * -60 * rate * math.sin(rate * t) + 4e-4 * speed + 0.04 * math.tanh(speed)
        row = (effort / 0.05, effort, angle, speed, angle / 100, speed / 100, 30 * effort)
        for name, value in zip(columns, row):
            columns[name].append(value + chance.gauss(0, 1e-4))
    digits = chance.choice((2, 3, 6, 9))
    return {name: [round(v, digits) for v in values] for name, values in columns.items()}


def make_set(number, folder):
    chance = random.Random(number)
    count = chance.choice((1, 2, 5, 20, 32, 33, 40, 64, 100, 200, 300, 500, 1000, 2000))
    sample_s = chance.choice((1e-3, 1e-3, 1e-3, 4e-3, 1e-4, 0.02, 0.1, 1.0, 1e-6))
    columns = {"time_s": [k * sample_s for k in range(count)]}
    if chance.random() < 0.5:
        moving = motion(chance, count, sample_s)
        columns.update({name: moving[name] for name in chance.sample(sorted(moving), chance.randint(1, len(moving)))})
    for name in chance.sample(COLUMNS, chance.randint(0 if len(columns) > 1 else 1, 5)):
        columns[name] = signal(chance, count, sample_s, list(columns.values())[1:])
    text = "".join(f"# {key}: {value}\n" for key, value in (
        ("load", chance.choice(("free", "free", "locked"))), ("gear_ratio", chance.choice((1, 100, 1e9))),
        ("current_hold", chance.choice(("zoh", "none"))), ("encoder_counts", 4096)) if chance.random() < 0.6)
    text += ",".join(columns) + "\n"
    text += "".join(",".join(repr(float(v)) for v in row) + "\n" for row in zip(*columns.values()))
    (folder / "data").mkdir(parents=True)
    (folder / "data" / "run.csv").write_text(text)
    (folder / "model.toml").write_text(MODEL)


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def problem_of(line, folder, tools):
    """What is wrong with how a command ended; empty where nothing is."""
    environment = dict(os.environ, PATH=f"{tools}:{os.environ['PATH']}", XDG_STATE_HOME=str(folder / "state"))
    try:
        ended = subprocess.run(line.split(), cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS,
                               preexec_fn=limits, stdin=subprocess.DEVNULL, errors="replace", check=False)
    except subprocess.TimeoutExpired:
        return f"did not end in {SECONDS} s"
    if ended.returncode < 0:
        return f"ended by signal {-ended.returncode}"
    if ended.returncode not in (0, 1, 2):
        return f"exit code {ended.returncode}"
    if "bad_alloc" in ended.stderr or "terminate called" in ended.stderr:
        return f"out of memory: {ended.stderr[-200:]}"
    if ended.returncode == 2 and "flexspline" not in ended.stderr:
        return "refused without a message"
    return ""


def main():
    tools, sets, folder = Path(sys.argv[1]).absolute(), int(sys.argv[2]), Path(sys.argv[3]).absolute()
    rest = sys.argv[4:]
    first = next((int(word) for word in rest if word.isdigit()), 0)
    only = [word[2:] for word in rest if word[2:] in COMMANDS]
    minutes = next((float(word[10:]) for word in rest if word.startswith("--minutes=")), 0.0)
    reached = folder / "reached"
    if minutes and reached.exists() and int(reached.read_text()) < first + sets:
        first, sets = int(reached.read_text()), first + sets - int(reached.read_text())
    begin, done = time.monotonic(), 0
    chosen = {name: line for name, (line, ready) in COMMANDS.items() if (name in only if only else ready or "--all" in rest)}
    folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    counts = dict.fromkeys(chosen, 0)
    for number in range(first, first + sets):
        if minutes and time.monotonic() - begin > 60 * minutes:
            break
        place = folder / f"set-{number}"
        shutil.rmtree(place, ignore_errors=True)
        make_set(number, place)
        keep = False
        for name, line in chosen.items():
            if "project/" in line and not (place / "project" / "base-model.toml").exists():
                continue
            counts[name] += 1
            line = line.format(data="data/run.csv", folder="data")
            problem = problem_of(line, place, tools)
            if problem:
                failed += 1
                keep = True
                print(f"set {number}, {name}: {problem}\n  cd {place} && {line}", flush=True)
        if not keep:
            shutil.rmtree(place)
        done += 1
        if minutes:
            reached.write_text(str(number + 1))
    print(f"{done} sets from number {first} on, {sum(counts.values())} commands, {failed} of them failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
