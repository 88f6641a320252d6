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
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True  # leaves nothing in the sources
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import diagnose_runs
from resumable import results_so_far

OTHERS = ("nothing-hidden", "clean-free-load", "one-direction", "joint-side", "elastic-load", "few-records", "torque-sensor",
          "by-direction", "second-structure")
BIG = 0.2  # share of the error from which an effect has to be named
BIG_RISE = 1.2  # of the RMS error, noise of the effort included, that the largest effect makes
OUTCOMES = ("right", "partial", "quiet", "group", "FALSE", "refused")


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("tools", type=Path)
    p.add_argument("minutes", type=float)
    p.add_argument("folder", type=Path)
    p.add_argument("version")
    p.add_argument("--families", default="")
    p.add_argument("--first", type=int, default=60001)
    p.add_argument("--count", type=int, default=10**9)
    p.add_argument("--variants", action="store_true")
    p.add_argument("--tool", type=Path)
    p.add_argument("--twins", type=Path)
    p.add_argument("--show", action="store_true")
    return p.parse_args()


def diagnose(tool, case, more=(), fit="fit"):
    return diagnose_runs.diagnose(tool, case / "model.toml", case / fit / "dataset.toml", case / "holdout/dataset.toml", more)


def is_hidden(name, hidden):
    effect, order = name
    if effect not in hidden["accepted"]:
        return False
    return hidden["order"] is None or (order is not None and abs(order - hidden["order"]) < 0.02)


def true_name(name, truth):
    def same(also):
        # Orders are tried as whole numbers: the one next to a wave's is its name.
        return name[0] == also["effect"] and ("order" not in also or (name[1] is not None and abs(name[1] - also["order"]) <= 0.5))

    return any(is_hidden(name, h) for h in truth["hidden"]) or any(same(a) for a in truth["also_true"])


def outcome_of(answer, truth):
    names = diagnose_runs.named(answer)
    big = [h for h in truth["hidden"] if h["share"] >= BIG]
    true = [n for n in names if true_name(n, truth)]
    if answer["verdict"] == "confusable_effects":
        # Laws that cannot be distinguished from what is hidden are one answer.
        if any(all(is_hidden(n, h) for n in names) for h in big):
            return "right"
        return "group" if true else "FALSE"
    if len(true) < len(names):
        return "FALSE"
    if all(any(is_hidden(n, h) for n in names) for h in big):
        return "right"
    return "partial" if names else "quiet"


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
    one = {"seed": seed, "family": family, "seconds": round(time.monotonic() - started, 2),
           "hidden": [[h["effect"], h["order"], round(h["share"], 3)] for h in truth["hidden"]],
           "presliding": round(truth["presliding"]["share"], 3), "rms_rise": round(rms_rise(truth), 3), "second": truth["second_structure"] and truth["second_structure"]["kind"]}
    if isinstance(answer, str):
        one.update(outcome="refused", why=answer, named=[], verdict=None)
    else:
        one.update(outcome=outcome_of(answer, truth), named=diagnose_runs.named(answer), verdict=answer["verdict"])
        one["classes"] = sorted({class_of(n, truth) for n in diagnose_runs.named(answer)})
        one["false"] = [n for n in diagnose_runs.named(answer) if not true_name(n, truth)]
        if options.variants:
            one["variants"] = variants(options.tool, case, answer, truth)
    shutil.rmtree(case)
    return one


def beta_quantile(probability, a, b):
    """Of whole a and b: the incomplete beta function is a sum of binomial terms there; by bisection."""
    n = a + b - 1

    def below(x):
        return sum(math.exp(math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1) + k * math.log(x) + (n - k) * math.log1p(-x))
                   for k in range(a, n + 1))

    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) < probability else (low, middle)
    return 0.5 * (low + high)


def clopper_pearson(events, of, level=0.95):
    tail = 0.5 * (1.0 - level)
    return (beta_quantile(tail, events, of - events + 1) if events else 0.0,
            beta_quantile(1.0 - tail, events + 1, of - events) if events < of else 1.0)


def rows(title, groups):
    yield f"| {title} | twins | " + " | ".join(OUTCOMES) + " | false names, 95 % interval |\n" + "| --- |" + " ---: |" * (len(OUTCOMES) + 1) + " --- |"
    for name, ones in groups.items():
        count = collections.Counter(o["outcome"] for o in ones)
        answered = len(ones) - count["refused"]
        bounds = "[{:.1f}, {:.1f}] %".format(*(100.0 * b for b in clopper_pearson(count["FALSE"], answered))) if answered else "-"
        yield f"| {name} | {len(ones)} | " + " | ".join(str(count[o]) for o in OUTCOMES) + f" | {bounds} |"


def grouped(ones, key):
    groups = collections.defaultdict(list)
    for one in ones:
        for name in key(one):
            groups[name].append(one)
    return dict(sorted(groups.items()))


def hidden_names(one):
    return [f"`{e}`" + (f", {BIG:.0%} and more" if share >= BIG else ", less") for e, _, share in one["hidden"]] or ["nothing"]


def table(ones, version):
    big = [o for o in ones if any(share >= BIG for _, _, share in o["hidden"]) and o["outcome"] != "refused"]
    right = sum(o["outcome"] == "right" for o in big)
    over_noise = [o for o in big if o["rms_rise"] >= BIG_RISE]
    times = sorted(o["seconds"] for o in ones)
    parts = [f"# Robot-like twins, version {version}: {len(ones)}",
             f"Of {len(big)} with an effect that makes {BIG:.0%} of the error or more, {right} named right; of {len(over_noise)} that raise "
             f"the RMS error, noise included, by {BIG_RISE - 1:.0%} or more, {sum(o['outcome'] == 'right' for o in over_noise)}. "
             + (f"Time: median {times[len(times) // 2]:.1f} s, most {times[-1]:.1f} s." if times else ""),
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
    false = collections.Counter(n[0] for o in ones for n in o.get("false", []) if o["outcome"] == "FALSE")
    parts.append("False names: " + (", ".join(f"`{n}` {k}" for n, k in false.most_common()) or "none") + ".")
    refused = collections.Counter(o["why"].splitlines()[-1][:120] for o in ones if o["outcome"] == "refused")
    if refused:
        parts.append("Refused:\n\n" + "\n".join(f"- {k} times: {w}" for w, k in refused.most_common()))
    return "\n\n".join(parts) + "\n"


def main():
    options = arguments()
    options.tool = (options.tool or options.tools / "flexspline").resolve()
    options.twins = (options.twins or options.tools / "tests/flexspline_robot_twins").resolve()
    families = options.families.split(",") if options.families else [f for other in OTHERS for f in ("robot-like", other)]
    options.folder.mkdir(parents=True, exist_ok=True)
    file = options.folder / "robot-like.jsonl"
    results = results_so_far(file, options.version, lambda one: (one["seed"], one["family"]))
    if not file.exists():
        file.write_text(json.dumps({"version": options.version}) + "\n")
    end = time.monotonic() + 60.0 * options.minutes
    with tempfile.TemporaryDirectory() as scratch:
        for k in range(0 if options.show else options.count):
            if time.monotonic() > end:
                break
            seed, family = options.first + k, families[k % len(families)]
            if (seed, family) in results:
                continue
            try:
                one = run(options, seed, family, Path(scratch))
            except (OSError, subprocess.CalledProcessError) as error:
                sys.exit(f"robot_like: {error}")
            results[seed, family] = one
            with file.open("a") as out:
                print(json.dumps(one), file=out)
    print(table(list(results.values()), options.version))


if __name__ == "__main__":
    main()
