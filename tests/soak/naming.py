"""What the campaigns share that compare the names that `flexspline diagnose` gives with a truth.json: outcomes, tables, the loop."""
import collections
import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import diagnose_runs
from resumable import results_so_far

OUTCOMES = ("right", "partial", "quiet", "group", "FALSE", "refused")


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


def outcome_of(answer, truth, is_big):
    """Of the names; `is_big` says which hidden effects have to be named."""
    names = diagnose_runs.named(answer)
    big = [h for h in truth["hidden"] if is_big(h)]
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


def compared(answer, truth, is_big):
    """What a result holds of an answer, or of the reason why there is none."""
    if isinstance(answer, str):
        return {"outcome": "refused", "why": answer, "named": [], "verdict": None}
    names = diagnose_runs.named(answer)
    return {"outcome": outcome_of(answer, truth, is_big), "named": names, "verdict": answer["verdict"],
            "false": [n for n in names if not true_name(n, truth)]}


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


def interval(events, of):
    return "[{:.1f}, {:.1f}] %".format(*(100.0 * b for b in clopper_pearson(events, of))) if of else "-"


def rows(title, groups, what="twins"):
    yield f"| {title} | {what} | " + " | ".join(OUTCOMES) + " | false names, 95 % interval |\n" + "| --- |" + " ---: |" * (len(OUTCOMES) + 1) + " --- |"
    for name, ones in groups.items():
        count = collections.Counter(o["outcome"] for o in ones)
        bounds = interval(count["FALSE"], len(ones) - count["refused"])
        yield f"| {name} | {len(ones)} | " + " | ".join(str(count[o]) for o in OUTCOMES) + f" | {bounds} |"


def grouped(ones, key):
    groups = collections.defaultdict(list)
    for one in ones:
        for name in key(one):
            groups[name].append(one)
    return dict(sorted(groups.items()))


def times(ones):
    seconds = sorted(o["seconds"] for o in ones)
    return f"Time: median {seconds[len(seconds) // 2]:.1f} s, most {seconds[-1]:.1f} s." if seconds else ""


def false_and_refused(ones):
    false = collections.Counter(n[0] for o in ones for n in o.get("false", []) if o["outcome"] == "FALSE")
    yield "False names: " + (", ".join(f"`{n}` {k}" for n, k in false.most_common()) or "none") + "."
    refused = collections.Counter(o["why"].splitlines()[-1][:120] for o in ones if o["outcome"] == "refused")
    if refused:
        yield "Refused:\n\n" + "\n".join(f"- {k} times: {w}" for w, k in refused.most_common())


def add_options(parser, first):
    """Those that every campaign has."""
    parser.add_argument("tools", type=Path)
    parser.add_argument("minutes", type=float)
    parser.add_argument("folder", type=Path)
    parser.add_argument("version")
    parser.add_argument("--first", type=int, default=first)
    parser.add_argument("--count", type=int, default=10**9)
    parser.add_argument("--tool", type=Path)
    parser.add_argument("--show", action="store_true")


def campaign(options, name, key, case_of, run, table):
    """Runs the cases that have no result yet until the time is over, and prints the table of all.

    A case is its seed and case_of(seed, k) for the k-th, which results hold as `key`; run(seed, case, scratch) is its result."""
    options.tool = (options.tool or options.tools / "flexspline").resolve()
    options.folder.mkdir(parents=True, exist_ok=True)
    file = options.folder / f"{name}.jsonl"
    results = results_so_far(file, options.version, lambda one: (one["seed"], one[key]))
    if not file.exists():
        file.write_text(json.dumps({"version": options.version}) + "\n")
    end = time.monotonic() + 60.0 * options.minutes
    with tempfile.TemporaryDirectory() as scratch:
        for k in range(0 if options.show else options.count):
            if time.monotonic() > end:
                break
            seed = options.first + k
            case = case_of(seed, k)
            if (seed, case) in results:
                continue
            try:
                one = {"seed": seed, key: case, **run(seed, case, Path(scratch))}
            except (OSError, subprocess.CalledProcessError) as error:
                sys.exit(f"{name}: {error}")
            results[seed, case] = one
            with file.open("a") as out:
                print(json.dumps(one), file=out)
    print(table(list(results.values()), options.version))
