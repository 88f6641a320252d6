#!/usr/bin/env python3
"""What is named on machines of eight kinds, or on drives of eight others: machines.py TOOLS MINUTES FOLDER VERSION [options]

Writes machines with flexspline_machines (tests/worlds/machines), or drives with flexspline_drives (tests/worlds/drives), runs
`flexspline diagnose` on each with its held-out records and compares what is named with the truth. Continues where the last run of
this version stopped (FOLDER/machines.jsonl, machines-stress.jsonl or drives.jsonl) and prints a Markdown table by kind and by hidden
effect. Options:

  --drives            drives instead of machines
  --kinds A,B         which kinds, in turn (default: all)
  --stress            of machines: with imperfections that no effect of the catalogue is 2 to 6 times as large
  --first N           first seed (default 80001, of drives 2001, for figures; calibrate on lower ones)
  --count N           stop after so many seeds even if there is time
  --tool FILE         another program than TOOLS/flexspline
  --machines FILE     another program than TOOLS/tests/flexspline_machines or flexspline_drives
  --show              only print the table of the present results
Exit code 1 if a program could not be run; false names are in the table."""
import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True  # leaves nothing in the sources
import naming
from naming import grouped, rows

KINDS = ("cobot-with-torque-sensors", "cobot-without-output-encoder", "exoskeleton", "telescope", "scara", "rotary-table", "satellite", "bench")
DRIVES = ("antenna", "rotary-table", "wheel-hub", "cable-instrument", "gimbal", "ball-screw", "dynamometer", "leg")
BIG = 0.2  # rise of the RMS error from which an effect has to be named


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    naming.add_options(p, first=None)
    p.add_argument("--drives", action="store_true")
    p.add_argument("--kinds")
    p.add_argument("--stress", action="store_true")
    p.add_argument("--machines", type=Path)
    options = p.parse_args()
    if options.drives and options.stress:
        p.error("--stress is of machines alone")
    options.kinds = options.kinds.split(",") if options.kinds else DRIVES if options.drives else KINDS
    options.first = options.first or (2001 if options.drives else 80001)
    options.machines = (options.machines or options.tools / "tests" / ("flexspline_drives" if options.drives else "flexspline_machines")).resolve()
    return options


def is_big(hidden):
    return hidden["excess"] >= BIG


def run(options, seed, kind, scratch):
    case = scratch / f"{kind}-{seed}"
    stress = ["--stress"] if options.stress else []
    subprocess.run([options.machines, "1", str(seed), scratch, "--kind", kind, *stress], check=True, capture_output=True)
    truth = json.loads((case / "truth.json").read_text())
    started = time.monotonic()
    answer = naming.diagnose(options.tool, case)
    one = {"seconds": round(time.monotonic() - started, 2),
           "hidden": [[h["effect"], h["order"], round(h["excess"], 3)] for h in truth["hidden"]],
           **naming.compared(answer, truth, is_big)}
    one["hit"] = any(naming.is_hidden(n, h) for n in one["named"] for h in truth["hidden"])
    one["weak"] = [n for n in one["named"] if naming.true_name(n, {"hidden": [], "also_true": truth["also_true"]})]
    shutil.rmtree(case)
    return one


def hidden_names(one):
    return [f"`{e}`" + (f", {BIG:.0%} and more" if excess >= BIG else ", less") for e, _, excess in one["hidden"]] or ["nothing"]


def of_all(count, ones):
    return f"{count} of {len(ones)}" + (f" ({count / len(ones):.0%})" if ones else "")


def table(ones, version, what):
    answered = [o for o in ones if o["outcome"] != "refused"]
    nothing = [o for o in answered if not o["hidden"]]
    hidden = [o for o in answered if o["hidden"]]
    big = [o for o in hidden if any(excess >= BIG for _, _, excess in o["hidden"])]
    false = [o for o in nothing if o["outcome"] == "FALSE"]
    weak = [o for o in nothing if o["weak"] and o["outcome"] != "FALSE"]
    parts = [f"# {what.capitalize()} of eight kinds, version {version}: {len(ones)}",
             f"Nothing hidden: false names in {of_all(len(false), nothing)}, exact 95 % interval {naming.interval(len(false), len(nothing))}; "
             f"only names of weak effects that the machine has in {len(weak)}.",
             f"Of those hidden that raise the RMS error by {BIG:.0%} or more, {of_all(sum(o['outcome'] == 'right' for o in big), big)} named right; "
             f"named among others or not, of all hidden, {of_all(sum(o['hit'] for o in hidden), hidden)}; "
             f"false names with something hidden in {of_all(sum(o['outcome'] == 'FALSE' for o in hidden), hidden)}. {naming.times(ones)}",
             "\n".join(rows("kind", {**grouped(ones, lambda o: [o["kind"]]), "all": ones}, what)),
             "\n".join(rows("hidden", grouped(ones, hidden_names), what)),
             *naming.false_and_refused(ones)]
    return "\n\n".join(parts) + "\n"


def main():
    options = arguments()
    what = "drives" if options.drives else "machines"
    naming.campaign(options, "machines-stress" if options.stress else what, "kind", lambda seed, k: options.kinds[k % len(options.kinds)],
                    lambda seed, kind, scratch: run(options, seed, kind, scratch), lambda ones, version: table(ones, version, what))


if __name__ == "__main__":
    main()
