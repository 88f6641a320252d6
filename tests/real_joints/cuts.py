#!/usr/bin/env python3
"""Runs `flexspline diagnose` on parts of the logs of real joints: cuts.py TOOL [--without-holdout] [--show-all] [CASE...]

Each record to fit on is cut into halves and thirds and thinned to every second sample; of several records one is left out; records to
fit on and held-out ones change places. A part has the physics of its joint, so a name must be one that expected.json defends for the
whole log. --without-holdout gives the tool the records to fit on alone. Prints tables by log and by kind of cut with exact
(Clopper-Pearson) bounds, and lists each false name. Exit code 1 where a name is false. Measurements are in FLEXSPLINE_DATA, by default ../shared/data next to the project."""
import collections
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.dont_write_bytecode = True  # leaves nothing in the sources
sys.path.insert(0, str(HERE.parent / "soak"))
import check
import diagnose_runs
from naming import interval

# The share of each record that is kept, from and to; every so many samples, beginning with which.
PARTS = {"half": [(0.0, 0.5), (0.5, 1.0)], "third": [(0.0, 1 / 3), (1 / 3, 2 / 3), (2 / 3, 1.0)]}
ORDINALS = ("first", "second", "third")
OUTCOMES = ("right", "defended", "group", "contradicts", "FALSE", "not named", "refused")


def experiments(dataset):
    """The text of a dataset before its experiments, and that of each experiment."""
    head, *each = re.split(r"^(?=\[\[experiment\]\])", dataset.read_text(), flags=re.MULTILINE)
    return head, each


def number(experiment, key, default):
    found = re.search(rf"^{key} *= *(\S+)", experiment, flags=re.MULTILINE)
    return float(found[1]) if found else default


def write_part(dataset, folder, share=(0.0, 1.0), every=1, offset=0, without=None):
    """The records of a dataset with that share of their samples, in a folder of their own."""
    head, each = experiments(dataset)
    folder.mkdir(parents=True)
    kept = []
    for k, experiment in enumerate(each):
        if k == without:
            continue
        file = re.search(r'^file *= *"(.*)"', experiment, flags=re.MULTILINE)[1]
        names, *lines = (dataset.parent / file).read_text().splitlines(keepends=True)
        time_column = names.strip().split(",").index("time_s")
        begin, end = number(experiment, "from_s", float("-inf")), number(experiment, "to_s", float("inf"))
        lines = [line for line in lines if begin <= float(line.split(",")[time_column]) <= end]
        first, last = (round(s * len(lines)) for s in share)
        (folder / f"{k}.csv").write_text(names + "".join(lines[first:last][offset::every]))
        experiment = re.sub(r"^(from_s|to_s) *=.*\n", "", experiment, flags=re.MULTILINE)
        kept.append(experiment.replace(f'"{file}"', f'"{k}.csv"', 1))
    (folder / "dataset.toml").write_text(head + "".join(kept))
    return folder / "dataset.toml"


def with_role(dataset, folder, role):
    """A copy of a dataset whose records have that role."""
    shutil.copytree(dataset.parent, folder)
    copy = folder / "dataset.toml"
    copy.write_text(re.sub(r'^role *=.*', f'role = "{role}"', copy.read_text(), flags=re.MULTILINE))
    return copy


def cuts(place, folder):
    """Kind, label, and places of each cut: model, records to fit on, held-out records."""
    model, fit, holdout = place
    for kind, shares in PARTS.items():
        for k, share in enumerate(shares):
            yield kind, f"{ORDINALS[k]} {kind}", (model, write_part(fit, folder / f"{kind}{k}", share), holdout)
    for offset in (0, 1):
        part = write_part(fit, folder / f"every-second{offset}", every=2, offset=offset)
        yield "every second sample", f"every second sample, from {ORDINALS[offset]}", (model, part, holdout)
    records = len(experiments(fit)[1])
    for k in range(records if records > 1 else 0):
        yield "a record left out", f"record {k + 1} left out", (model, write_part(fit, folder / f"without{k}", without=k), holdout)
    swapped = with_role(holdout, folder / "swapped-fit", "fit"), with_role(fit, folder / "swapped-holdout", "holdout")
    yield "held-out records fitted on", "held-out records fitted on", (model, *swapped)


def outcome_of(answer, whole_names, expected):
    """What a part names: a right effect of the whole log; others that its analysis defends, some of which the tool names on the whole
    log or none, which contradicts that; a group of which some are defended; or a false one."""
    if isinstance(answer, str):
        return "refused", [], []
    names = check.names_of(answer)
    false = check.false_names(names, answer["verdict"], expected)
    if not names:
        return "not named", names, false
    if false:
        return "FALSE", names, false
    if check.false_names(names, "", expected):  # of a group that these data cannot distinguish, some are defended
        return "group", names, false
    if any(check.same(n, w) for n in names for w in expected["named_any_of"]):
        return "right", names, false
    contradicts = whole_names and not set(names) & set(whole_names)
    return "contradicts" if contradicts else "defended", names, false


def table(title, groups):
    yield f"| {title} | runs | " + " | ".join(OUTCOMES) + " | false, 95 % interval |\n" + "| --- |" + " ---: |" * (len(OUTCOMES) + 1) + " --- |"
    for name, outcomes in groups.items():
        count = collections.Counter(outcomes)
        bounds = interval(count["FALSE"], len(outcomes) - count["refused"])
        yield f"| {name} | {len(outcomes)} | " + " | ".join(str(count[o]) for o in OUTCOMES) + f" | {bounds} |"


def run_case(tool, case, expected, scratch, show_all, with_holdout):
    """Kind and outcome of each cut of a log, and a line for each false one."""
    place = check.places(case, scratch / "whole")

    def diagnose(model, fit, holdout):
        return diagnose_runs.diagnose(tool, model, fit, holdout if with_holdout else None)

    whole = diagnose(*place)
    whole_names = [] if isinstance(whole, str) else check.names_of(whole)
    results, lines = [], []
    for kind, label, cut in cuts(place, scratch / case):
        answer = diagnose(*cut)
        outcome, names, false = outcome_of(answer, whole_names, expected)
        results.append((kind, outcome))
        if show_all:
            print(f"  {case}, {label}: {outcome}: {', '.join(names) or (answer if isinstance(answer, str) else answer['verdict'])}", flush=True)
        if outcome == "FALSE":
            lines.append(f"- {case}, {label}: {', '.join(false)} ({answer['verdict']})")
        elif outcome == "refused":
            lines.append(f"- {case}, {label}: refused: {answer.splitlines()[-1]}")
    return results, lines


def main():
    options = {"--show-all", "--without-holdout"} & set(sys.argv[1:])
    arguments = [a for a in sys.argv[1:] if a not in options]
    if not arguments or arguments[0].startswith("-"):
        sys.exit(__doc__)
    tool, wanted = arguments[0], arguments[1:]
    cases = check.wanted_cases("cuts.py", wanted)
    started = time.monotonic()
    by_log, by_kind, listed = collections.defaultdict(list), collections.defaultdict(list), []
    with tempfile.TemporaryDirectory() as scratch:
        for case, expected in cases.items():
            results, lines = run_case(tool, case, expected, Path(scratch), "--show-all" in options, "--without-holdout" not in options)
            listed += lines
            for kind, outcome in results:
                by_log[case].append(outcome)
                by_kind[kind].append(outcome)
    everything = [o for outcomes in by_log.values() for o in outcomes]
    print("\n".join([*table("log", {**by_log, "all": everything}), "", *table("kind of cut", by_kind), "",
                     *(listed or ["No name is false."]), "", f"{time.monotonic() - started:.0f} s."]))
    return 1 if "FALSE" in everything else 0


if __name__ == "__main__":
    sys.exit(main())
