#!/usr/bin/env python3
"""Drives whose parameters are not those that the model states, in closed loop: hil.py TOOLS MINUTES FOLDER VERSION

Each drive is the demo's with every friction, inertia and stiffness off by up to 10, 30 or 50 %, moved by a scenario of the
tool's, once without compensation and once with the maker's values, which are wrong for it. Nothing of this may end in a
fault, make the loops hunt that did not before, or give a number that is none. Goes on where the last run of this version
stopped (FOLDER/hil.jsonl), and ends with a table. Exit code 1 where a drive went wrong."""
import collections
import json
import math
import random
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

SCENARIOS = ("slow-reversals", "sine", "trapezoid", "joint-trajectory", "constant-slow", "loaded-reversals", "pick-and-place")
SHARES = (0.1, 0.3, 0.5)
PARAMETERS = ("inertia", "coefficient", "torque", "stiffness", "linear", "cubic", "damping")

tools, minutes, folder, version = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
plant = (Path(__file__).resolve().parents[2] / "hil/plant/demo-drive.toml").read_text()
folder.mkdir(parents=True, exist_ok=True)
results_file = folder / "hil.jsonl"


def results_so_far():
    """By number of the drive; those of another version are put aside."""
    if not results_file.exists():
        return {}
    lines = results_file.read_text().splitlines()
    if not lines or json.loads(lines[0]) != {"version": version}:
        results_file.rename(str(results_file) + ".old")
        return {}
    known = {}
    for line in lines[1:]:
        try:
            one = json.loads(line)
        except json.JSONDecodeError:  # half written, by a run that was stopped
            continue
        known[one["drive"]] = one
    return known


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


def run(number):
    chance = random.Random(number)
    scenario, share = SCENARIOS[number % len(SCENARIOS)], SHARES[number // len(SCENARIOS) % len(SHARES)]
    drive, sheet = folder / "drive.toml", folder / "sheet"
    drive.write_text(other_drive(share, chance))
    subprocess.run([tools / "flexspline-hil", "data-sheet", "--scenario", scenario, "--out", sheet], check=True, capture_output=True)
    answer = subprocess.run(
        [tools / "flexspline", "hil", "--scenario", scenario, "--plant", drive, "--model", sheet / "known-model.toml",
         "--settings", sheet / "settings.toml", "--draws", "0", "--seed", str(number), "--json", folder / "answer.json"],
        capture_output=True, text=True)
    one = {"drive": number, "scenario": scenario, "share": share, "wrong": ""}
    if answer.returncode != 0:
        one["wrong"] = f"exit code {answer.returncode}: {answer.stderr.strip()[-300:]}"
        return one
    runs = json.loads((folder / "answer.json").read_text())["runs"]
    without, compensated = runs[0], runs[-1]
    one["ratio"] = compensated["ratio_to_none"]
    if len(runs) < 2 or not finite(runs) or one["ratio"] is None:
        one["wrong"] = "a number is missing or not finite"
    for r in runs:
        if r["ends_in_fault"]:
            one["wrong"] = f"ends in a fault with compensation {r['compensation']}: {r['fault']}"
    if compensated["limit_cycle"] and not without["limit_cycle"]:
        one["wrong"] = "the loops hunt with compensation and not without"
    return one


results = results_so_far()
if not results_file.exists():
    results_file.write_text(json.dumps({"version": version}) + "\n")
end = time.monotonic() + 60.0 * minutes
number = 0
while time.monotonic() < end:
    if number not in results:
        results[number] = run(number)
        with results_file.open("a") as out:
            print(json.dumps(results[number]), file=out)
        if results[number]["wrong"]:
            print(f"WRONG drive {number}, {results[number]['scenario']}: {results[number]['wrong']}", flush=True)
    number += 1

print(f"{len(results)} drives, version {version}: error with the maker's values over that without compensation\n")
print("| parameters off by up to | scenario | drives | median | worst | worse than none | went wrong |")
print("| ---: | --- | ---: | ---: | ---: | ---: | ---: |")
groups = collections.defaultdict(list)
for one in results.values():
    groups[one["share"], one["scenario"]].append(one)
for (share, scenario), ones in sorted(groups.items()):
    ratios = [one["ratio"] for one in ones if one.get("ratio") is not None]
    middle, worst = (f"{statistics.median(ratios):.3g}", f"{max(ratios):.3g}") if ratios else ("-", "-")
    print(f"| {100 * share:.0f} % | {scenario} | {len(ones)} | {middle} | {worst} | {sum(r > 1.0 for r in ratios)} | "
          f"{sum(bool(one['wrong']) for one in ones)} |")
sys.exit(any(one["wrong"] for one in results.values()))
