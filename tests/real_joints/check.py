#!/usr/bin/env python3
"""Runs `flexspline diagnose` on the real joints and compares with expected.json: check.py TOOL [--variants] [CASE...]

Prints a table. Exit code 1 where a name is false or the tool could not be run. --variants repeats each case with half and twice the
cut-off and without the mask. Measurements are in FLEXSPLINE_DATA, by default ../shared/data next to the project."""
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.dont_write_bytecode = True  # leaves nothing in the sources
sys.path.insert(0, str(HERE.parent / "support"))
import diagnose_runs

DATA = Path(os.environ.get("FLEXSPLINE_DATA", HERE.parents[1] / "../shared/data"))

EMPS_DATASET = """format = "flexspline-dataset/1"
[drive]
axis = "linear"
pitch_m = 0.0025
[columns.motor_torque_nm]
source = "motor_force_n"
unit = "N"
[columns.motor_position_rad]
source = "position_m"
unit = "m"
[[experiment]]
file = "{file}"
name = "{role}"
from_s = {begin}
to_s = {end}
role = "{role}"
"""
EMPS_MODEL = 'format = "flexspline-model/1"\nname = "emps"\n[drive]\naxis = "linear"\n' + "".join(
    f'[[effect]]\ntype = "{e}"\n' for e in ("inertia", "viscous_friction", "coulomb_friction", "torque_bias"))


def places(case, scratch):
    """Model, fit and hold-out of a case."""
    if case.startswith("emps"):
        file = "emps_test_pulses.csv" if case.endswith("pulses") else "emps_train.csv"
        for role, begin, end in (("fit", 0.0, 12.48), ("holdout", 12.48, 100.0)):
            folder = scratch / case / role
            folder.mkdir(parents=True)
            shutil.copy(DATA / "emps" / file, folder / file)
            (folder / "dataset.toml").write_text(EMPS_DATASET.format(file=file, begin=begin, end=end, role=role))
        (scratch / case / "base.toml").write_text(EMPS_MODEL)
        root = scratch / case
    else:
        root = DATA / ("tiago-arm" if case == "arm1" else "kinova-gen3") / case
    return root / "base.toml", root / "fit/dataset.toml", root / "holdout/dataset.toml"


def names_of(answer):
    return [effect + (f":{order:g}" if order is not None else "") for effect, order in diagnose_runs.named(answer)]


def same(name, wanted):
    return name == wanted or name.split(":")[0] == wanted


def false_names(names, verdict, expected):
    good = expected["named_any_of"] + expected["allowed"]

    def true(name):
        if any(same(name, g) for g in good):
            return True
        return any(same(name, second) and any(same(n, w) for n in names for w in others)
                   for second, others in expected.get("allowed_with", {}).items())

    if verdict == "confusable_effects":  # one of a group: true where the group holds a true one
        return [] if any(true(n) for n in names) else names
    return [n for n in names if not true(n)]


def wanted_cases(script, wanted):
    """The cases of expected.json with these names, or all. Ends the script where there are no measurements or no such case."""
    if not DATA.is_dir():
        print(f"{script}: no measurements in {DATA}; set FLEXSPLINE_DATA")
        sys.exit(77)  # skipped, for a test that says so
    cases = json.loads((HERE / "expected.json").read_text())["cases"]
    unknown = [w for w in wanted if w not in cases]
    if unknown:
        sys.exit(f"{script}: no case {', '.join(unknown)}; there are {', '.join(cases)}")
    return {case: expected for case, expected in cases.items() if not wanted or case in wanted}


def main():
    arguments = sys.argv[1:]
    with_variants = "--variants" in arguments
    arguments = [a for a in arguments if a != "--variants"]
    if not arguments:
        sys.exit(__doc__)
    tool, wanted = arguments[0], arguments[1:]
    cases = wanted_cases("check.py", wanted)
    failed = required = met = 0
    print("| case | verdict | named | expected | result | s |\n| --- | --- | --- | --- | --- | ---: |")
    with tempfile.TemporaryDirectory() as scratch:
        for case, expected in cases.items():
            place = places(case, Path(scratch))
            runs = [("", ())]
            for label, more in runs:
                started = time.monotonic()
                answer = diagnose_runs.diagnose(tool, *place, more)
                seconds = time.monotonic() - started
                if isinstance(answer, str):
                    failed += not label
                    print(f"| {case} {label} | refused | | | {answer.splitlines()[-1]} | {seconds:.1f} |")
                    continue
                if with_variants and not label:
                    runs += diagnose_runs.variants(tool, *place[:2], answer).items()
                names = names_of(answer)
                false = false_names(names, answer["verdict"], expected)
                hit = any(same(n, w) for n in names for w in expected["named_any_of"])
                failed += bool(false)
                if not label and expected["named_any_of"]:
                    required += 1
                    met += hit and not false
                result = "FALSE: " + ", ".join(false) if false else "right" if hit or not expected["named_any_of"] else "missed"
                print(f"| {case} {label} | {answer['verdict']} | {', '.join(names) or '-'} | "
                      f"{', '.join(expected['named_any_of']) or '-'} | {result} | {seconds:.1f} |", flush=True)
    print(f"\n{failed} answers with a false name or none at all; {met} of {required} that should be named are.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
