#!/usr/bin/env python3
"""What `flexspline diagnose` names on the report's own tables: diagnose_cases.py TOOL CASES [--variants] [CASE...]

CASES is the folder that flexspline_report_cases wrote. Each table as a whole and each row alone; a name is true where the effect is in
the simulated drive and not in the base model, and for table 7 as a whole where it is sublinear friction, which its rows hold only
together. CASES may also have a folder whole-drive, of all tables together: there sublinear friction holds for the runs of table 7, and not
for the slower ones of table 8, so the answer should say that, and name nothing. Single rows of tables 4 and 6 lack nothing, so an unknown
structure there is unfounded. Prints a table; exit code 1 where a name is false, one is missing that should be there, or a structure is
unfounded."""
import re
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True  # leaves nothing in the sources
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import diagnose_runs

EXPECTED = {"table-7": ["power_law_friction"]}
EXPECTED_IN_RANGE = {"whole-drive": ["power_law_friction"]}
COMPLETE = ("table-4-rows", "table-6-rows")


def effects_not_in_base(case):
    drive = set(re.findall(r"^(\w+)\.\w+ = ", (case / "truth.toml").read_text(), re.M))
    return drive - set(re.findall(r'^type = "(\w+)"', (case / "base-model.toml").read_text(), re.M))


def main():
    arguments = [a for a in sys.argv[1:] if a != "--variants"]
    if len(arguments) < 2:
        sys.exit(__doc__)
    tool, root, wanted = arguments[0], Path(arguments[1]), arguments[2:]
    cases = sorted(root.glob("table-?")) + sorted(root.glob("whole-drive")) + sorted(root.glob("table-?-rows/*"))
    known = {str(c.relative_to(root)) for c in cases} | {c.relative_to(root).parts[0] for c in cases}
    unknown = [w for w in wanted if w not in known]
    if not cases or unknown:
        sys.exit(f"diagnose_cases.py: {root} has no case {', '.join(unknown) or 'at all'}; flexspline_report_cases {root} writes all")
    false_answers = answers = met = to_name = said = to_say = unfounded = 0
    print("| case | verdict | named | result | s |\n| --- | --- | --- | --- | ---: |")
    for case in cases:
        name = str(case.relative_to(root))
        if wanted and name not in wanted and name.split("/")[0] not in wanted:
            continue
        model, data = case / "base-model.toml", case / "dataset.toml"
        expected = EXPECTED.get(name, [])
        to_name += bool(expected)
        in_range = EXPECTED_IN_RANGE.get(name, [])
        to_say += bool(in_range)
        true = effects_not_in_base(case) | set(expected)
        runs = [("", ())]
        for label, more in runs:
            started = time.monotonic()
            answer = diagnose_runs.diagnose(tool, model, data, more=more)
            seconds = time.monotonic() - started
            if isinstance(answer, str):
                print(f"| {name} {label} | refused | | {answer.splitlines()[-1]} | {seconds:.1f} |", flush=True)
                continue
            if "--variants" in sys.argv and not label:
                runs += diagnose_runs.variants(tool, model, data, answer).items()
            names = [effect for effect, _ in diagnose_runs.named(answer)]
            false = [n for n in names if n not in true]
            if answer["verdict"] == "confusable_effects" and len(false) < len(names):
                false = []
            answers += 1
            false_answers += bool(false)
            law = answer["law_in_range"]
            said_here = law is not None and any(n in in_range for n in law["effects"])
            said += not label and said_here
            met += not label and bool(expected) and any(n in expected for n in names)
            missed = (expected and not any(n in expected for n in names)) or (in_range and not said_here)
            no_structure = name.startswith(COMPLETE) and answer["verdict"] == "unknown_structure"
            unfounded += no_structure
            result = "FALSE" if false else "unfounded" if no_structure else "missed" if missed else "right"
            text = ", ".join(names) or "-"
            if law is not None:
                text += (f"; {' or '.join(law['effects'])} for {law['records']} of {law['of_records']} runs, {law['lowest_speed']:.3g} to "
                         f"{law['highest_speed']:.3g} rad/s (p = {law['p_value']:.2g})")
            print(f"| {name} {label} | {answer['verdict']} | {text} | {result} | {seconds:.1f} |", flush=True)
    print(f"\n{false_answers} of {answers} answers with a false name; {met} of {to_name} that should be named are; "
          f"{said} of {to_say} laws of a range of speeds are stated; {unfounded} structures are unfounded.")
    return 1 if false_answers or met < to_name or said < to_say or unfounded else 0


if __name__ == "__main__":
    sys.exit(main())
