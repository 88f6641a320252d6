#!/usr/bin/env python3
"""Drives whose parameters differ from those that the model states, in closed loop: hil.py TOOLS MINUTES FOLDER VERSION

Each drive is the demo's with every friction, inertia and stiffness off: the first 500 by up to 30 %, the next in turn by up to
10, 30 and 50 %. It runs one scenario of the tool, once without compensation and once with the maker's values, which are wrong
for it. No run may end in a fault, have a limit cycle that is absent without compensation, or give a number that is not finite.
Uses all cores, continues where the last run of this version stopped (FOLDER/hil.jsonl), and writes hil.md next to this script.
Exit code 1 if a drive went wrong."""
import json
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.dont_write_bytecode = True  # leaves nothing in the sources
from resumable import results_so_far

SCENARIOS = ("slow-reversals", "sine", "trapezoid", "joint-trajectory", "constant-slow", "loaded-reversals", "pick-and-place")
FIRST = 500  # drives, all off by up to FIRST_SHARE
FIRST_SHARE = 0.3
SHARES = (0.1, 0.3, 0.5)  # of those after them
PARAMETERS = ("inertia", "coefficient", "torque", "stiffness", "linear", "cubic", "damping")

tools, minutes, folder, version = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
plant = (Path(__file__).resolve().parents[2] / "hil/plant/demo-drive.toml").read_text()
folder.mkdir(parents=True, exist_ok=True)
results_file = folder / "hil.jsonl"


def other_drive(share, chance):
    """The demo's drive with parameters that are off."""
    lines = []
    for line in plant.splitlines():
        found = re.match(r"(\w+) = \{ value = ([-+.\deE]+),(.*)", line)
        if found and found[1] in PARAMETERS:
            value = float(found[2]) * chance.uniform(1.0 - share, 1.0 + share)
            line = f"{found[1]} = {{ value = {value:.6g},{found[3]}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def finite(x):
    if isinstance(x, dict):
        return all(finite(y) for y in x.values())
    if isinstance(x, list):
        return all(finite(y) for y in x)
    return not isinstance(x, float) or math.isfinite(x)


def share_of(number):
    return FIRST_SHARE if number < FIRST else SHARES[number // len(SCENARIOS) % len(SHARES)]


def run(number, scratch):
    chance = random.Random(number)
    scenario, share = SCENARIOS[number % len(SCENARIOS)], share_of(number)
    drive, sheet, answer_file = scratch / "drive.toml", scratch / "sheet", scratch / "answer.json"
    drive.write_text(other_drive(share, chance))
    subprocess.run([tools / "flexspline-hil", "data-sheet", "--scenario", scenario, "--out", sheet], check=True, capture_output=True)
    answer = subprocess.run(
        [tools / "flexspline", "hil", "--scenario", scenario, "--plant", drive, "--model", sheet / "known-model.toml",
         "--settings", sheet / "settings.toml", "--draws", "0", "--seed", str(number), "--json", answer_file],
        capture_output=True, text=True)
    one = {"drive": number, "scenario": scenario, "share": share, "wrong": ""}
    if answer.returncode != 0:
        one["wrong"] = f"exit code {answer.returncode}: {answer.stderr.strip()[-300:]}"
        return one
    runs = json.loads(answer_file.read_text())["runs"]
    without, compensated = runs[0], runs[-1]
    one["ratio"] = compensated["ratio_to_none"]
    if len(runs) < 2 or not finite(runs) or one["ratio"] is None:
        one["wrong"] = "a number is missing or not finite"
    for r in runs:
        if r["ends_in_fault"]:
            one["wrong"] = f"ends in a fault with compensation {r['compensation']}: {r['fault']}"
    if compensated["limit_cycle"] and not without["limit_cycle"]:
        one["wrong"] = "a limit cycle with compensation and not without"
    return one


def work(scratch):
    while time.monotonic() < end:
        with guard:
            number = next(n for n in range(len(taken) + 1) if n not in taken)
            taken.add(number)
        one = run(number, Path(scratch))
        with guard:
            results[number] = one
            with results_file.open("a") as out:
                print(json.dumps(one), file=out)
            if one["wrong"]:
                print(f"WRONG drive {number}, {one['scenario']}: {one['wrong']}", flush=True)


def percentile(sorted_values, share):
    return sorted_values[min(len(sorted_values) - 1, int(share * len(sorted_values)))]


def row(name, ones):
    ratios = sorted(one["ratio"] for one in ones if one.get("ratio") is not None)
    figures = [f"{x:.3g}" for x in (ratios[0], *(percentile(ratios, q) for q in (0.05, 0.5, 0.95)), ratios[-1])] if ratios else ["-"] * 5
    return f"| {name} | {len(ones)} | {' | '.join(figures)} | {sum(r > 1.0 for r in ratios)} |"


def page():
    ones = list(results.values())
    first = [one for one in ones if one["share"] == FIRST_SHARE]
    faults = [one for one in ones if one["wrong"]]
    head = "| | drives | least | 5 % | median | 95 % | worst | worse than none |\n| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    parts = [
        "# Campaign: drives that are not what their model says",
        f"Made by `./dev soak MINUTES hil` of version {version}: {len(ones)} simulated drives, each the demo's with every friction, inertia and stiffness off "
        "by a random share (uniform, up to the one stated), along one of seven scenarios. RMS error of the output with the "
        "maker's values as compensation, over that without. *Went wrong*: a fault, a limit cycle that is absent without compensation, or no number.",
        f"## Parameters wrong by up to {100 * FIRST_SHARE:.0f} %: {len(first)} drives, {sum(bool(one['wrong']) for one in first)} went wrong",
        head + "\n" + "\n".join(row(f"`{s}`", [one for one in first if one["scenario"] == s]) for s in SCENARIOS) + "\n" + row("all", first),
    ]
    others = sorted({one["share"] for one in ones} - {FIRST_SHARE})
    if others:
        wrong = sum(bool(one["wrong"]) for one in ones if one["share"] != FIRST_SHARE)
        parts += [f"## By other shares: {wrong} went wrong", head + "\n" + "\n".join(row(f"up to {100 * s:.0f} %", [o for o in ones if o["share"] == s]) for s in others)]
    if faults:
        parts += ["## What went wrong", "\n".join(f"- drive {one['drive']}, `{one['scenario']}`, up to {100 * one['share']:.0f} %: {one['wrong']}"
                                                 for one in sorted(faults, key=lambda o: o["drive"]))]
    return "\n\n".join(parts) + "\n"


results = results_so_far(results_file, version, lambda one: one["drive"])
if not results_file.exists():
    results_file.write_text(json.dumps({"version": version}) + "\n")
end = time.monotonic() + 60.0 * minutes
guard = threading.Lock()
taken = set(results)
workers = []
# The two runs of a comparison are a process each, so half as many workers as cores keep them busy.
with tempfile.TemporaryDirectory() as scratch:
    for i in range(max(1, (os.cpu_count() or 1) // 2)):
        folder_of = Path(scratch) / str(i)
        folder_of.mkdir()
        workers.append(threading.Thread(target=work, args=(folder_of,)))
        workers[-1].start()
    for worker in workers:
        worker.join()

text = page()
(Path(__file__).resolve().parent / "hil.md").write_text(text)
print(text)
sys.exit(any(one["wrong"] for one in results.values()))
