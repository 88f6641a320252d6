#!/usr/bin/env python3
"""What is named on robot-like twins: robot_like.py TOOLS MINUTES FOLDER VERSION [options]

Writes twins with flexspline_robot_twins (tests/worlds), runs `flexspline diagnose` on each with its hold-out and compares what is
named with the truth. Continues where the last run of this version stopped (FOLDER/robot-like.jsonl) and prints a Markdown table by
family and by hidden effect. Options:

  --families A,B      which families, in turn (default: robot-like in alternation with all others)
  --first N           first seed (default 60001, for figures; calibrate on lower ones)
  --count N           stop after so many seeds even if there is time
  --variants          also with half and twice the cut-off, without the mask and with a tenth of the data left out
  --tool FILE         another program than TOOLS/flexspline
  --twins FILE        another program than TOOLS/tests/flexspline_robot_twins
  --show              only print the table of the present results
Exit code 1 if a program could not be run; false names are in the table."""
import argparse
import collections
import json
import math
import shutil
import subprocess
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True  # leaves nothing in the sources
import naming
from naming import diagnose, grouped, is_hidden, rows
import diagnose_runs

OTHERS = ("nothing-hidden", "clean-free-load", "one-direction", "joint-side", "elastic-load", "few-records", "torque-sensor",
          "by-direction", "second-structure")
BIG = 0.2  # share of the error from which an effect has to be named
BIG_RISE = 1.2  # of the RMS error, noise of the effort included, that the largest effect makes


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    naming.add_options(p, first=60001)
    p.add_argument("--families", default="")
    p.add_argument("--variants", action="store_true")
    p.add_argument("--twins", type=Path)
    return p.parse_args()


def is_big(hidden):
    return hidden["share"] >= BIG


def class_of(name, truth):
    """Names that cannot be distinguished are one answer."""
    for k, h in enumerate(truth["hidden"]):
        if is_hidden(name, h):
            return f"hidden {k}"
    if name[0] in ("dahl_friction", "lugre_friction"):
        return "presliding"
    return f"{name[0]}:{name[1]}" if name[1] is not None else name[0]


def rms_rise(truth):
    """RMS error of the base model over that without the largest hidden effect, with the noise of the effort in both."""
    squared, noise = truth["base_error_rms_nm"] ** 2, truth["effort_noise_rms_nm"] ** 2
    share = max((h["share"] for h in truth["hidden"]), default=0.0)
    return math.sqrt((squared + noise) / (squared * max(0.0, 1.0 - share) + noise))


def without_a_tenth(case):
    """Leaves out the last tenth of each record."""
    shutil.copytree(case / "fit", case / "shorter")
    for file in (case / "shorter").glob("*.csv"):
        lines = file.read_text().splitlines(keepends=True)
        file.write_text("".join(lines[: 1 + int(0.9 * (len(lines) - 1))]))
    return "shorter"


def variants(tool, case, answer, truth):
    """The classes named under each variant; None where it was refused."""
    runs = {name: (more, "fit") for name, more in
            diagnose_runs.variants(tool, case / "model.toml", case / "fit/dataset.toml", answer).items()}
    runs["a tenth left out"] = ((), without_a_tenth(case))
    out = {}
    for name, (more, fit) in runs.items():
        other = diagnose(tool, case, more, fit)
        out[name] = None if isinstance(other, str) else sorted({class_of(n, truth) for n in diagnose_runs.named(other)})
    return out


def run(options, seed, family, scratch):
    case = scratch / f"{family}-{seed}"
    subprocess.run([options.twins, "1", str(seed), scratch, "--family", family], check=True, capture_output=True)
    truth = json.loads((case / "truth.json").read_text())
    started = time.monotonic()
    answer = diagnose(options.tool, case)
    one = {"seconds": round(time.monotonic() - started, 2),
           "hidden": [[h["effect"], h["order"], round(h["share"], 3)] for h in truth["hidden"]],
           "presliding": round(truth["presliding"]["share"], 3), "rms_rise": round(rms_rise(truth), 3), "second": truth["second_structure"] and truth["second_structure"]["kind"],
           **naming.compared(answer, truth, is_big)}
    if one["outcome"] != "refused":
        one["classes"] = sorted({class_of(n, truth) for n in one["named"]})
        if options.variants:
            one["variants"] = variants(options.tool, case, answer, truth)
    shutil.rmtree(case)
    return one


def hidden_names(one):
    return [f"`{e}`" + (f", {BIG:.0%} and more" if share >= BIG else ", less") for e, _, share in one["hidden"]] or ["nothing"]


def table(ones, version):
    big = [o for o in ones if any(share >= BIG for _, _, share in o["hidden"]) and o["outcome"] != "refused"]
    right = sum(o["outcome"] == "right" for o in big)
    over_noise = [o for o in big if o["rms_rise"] >= BIG_RISE]
    parts = [f"# Robot-like twins, version {version}: {len(ones)}",
             f"Of {len(big)} with an effect that makes {BIG:.0%} of the error or more, {right} named right; of {len(over_noise)} that raise "
             f"the RMS error, noise included, by {BIG_RISE - 1:.0%} or more, {sum(o['outcome'] == 'right' for o in over_noise)}. "
             + naming.times(ones),
             "\n".join(rows("family", {**grouped(ones, lambda o: [o["family"]]), "all": ones})),
             "\n".join(rows("hidden", grouped(ones, hidden_names)))]
    varied = [o for o in ones if o.get("variants")]
    if varied:
        lines = ["| variant | twins | another name | a name lost or gained |", "| --- | ---: | ---: | ---: |"]
        for name in sorted({v for o in varied for v in o["variants"]}):
            pairs = [(set(o["classes"]), set(o["variants"][name])) for o in varied if o["variants"].get(name) is not None]
            other = sum(bool(a) and bool(b) and not (a <= b or b <= a) for a, b in pairs)
            lines.append(f"| {name} | {len(pairs)} | {other} | {sum(a != b for a, b in pairs) - other} |")
        flipped = sum(any(v is not None and v != o["classes"] for v in o["variants"].values()) for o in varied)
        parts += ["\n".join(lines), f"{flipped} of {len(varied)} twins answer differently under a variant."]
    parts += naming.false_and_refused(ones)
    return "\n\n".join(parts) + "\n"


def main():
    options = arguments()
    options.twins = (options.twins or options.tools / "tests/flexspline_robot_twins").resolve()
    families = options.families.split(",") if options.families else [f for other in OTHERS for f in ("robot-like", other)]
    naming.campaign(options, "robot-like", "family", lambda seed, k: families[k % len(families)],
                    lambda seed, family, scratch: run(options, seed, family, scratch), table)


if __name__ == "__main__":
    main()
