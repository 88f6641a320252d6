"""Runs `flexspline diagnose` for the scripts that compare what it names with the truth, and reads its answer."""
import json
import subprocess
import tempfile
from pathlib import Path

TIMEOUT_S = 300


def run(command):
    """What the tool printed as JSON, or a text that says why there is nothing."""
    try:
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return f"no answer within {TIMEOUT_S} s"
    if done.returncode != 0:
        return done.stderr.strip()[-300:] or f"exit code {done.returncode}"
    return json.loads(done.stdout)


def diagnose(tool, model, fit, holdout=None, more=()):
    data = [fit] + (["--holdout", holdout] if holdout else [])
    return run([tool, "diagnose", "--model", model, *data, "--tolerate", "jitter", "--json", "-", *more])


def automatic_cutoff(tool, model, fit, answer):
    """The cut-off that the tool chose, in Hz: by its answer, or else as `identify` says it; None where neither does."""
    if isinstance(answer.get("cutoff_hz"), (int, float)):
        return answer["cutoff_hz"]
    with tempfile.TemporaryDirectory() as scratch:
        found = run([tool, "identify", "--model", model, fit, "--tolerate", "jitter", "--out", Path(scratch) / "model.toml", "--json", "-"])
    return None if isinstance(found, str) else found.get("cutoff_hz")


def variants(tool, model, fit, answer):
    """Names and arguments of the analyses that must give the same verdict."""
    out = {"no mask": ("--mask", "none")}
    cutoff = automatic_cutoff(tool, model, fit, answer)
    if cutoff:
        out["half the cut-off"] = ("--cutoff-hz", f"{0.5 * cutoff:.6g}")
        out["twice the cut-off"] = ("--cutoff-hz", f"{2.0 * cutoff:.6g}")
    return out


def named(answer):
    """Pairs of effect and order."""
    return [(n["effect"], n.get("order")) for n in answer["named"]]
