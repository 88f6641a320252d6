#!/usr/bin/env python3
"""twin.py TOOLS: how much faster than real time a drive runs in closed loop on the desktop, firmware, plant, sensors and telemetry
together. Rows as rows.hpp has them on standard output. One core: processor time of flexspline-hil, its start included,
median of five; the batch: the prediction of `flexspline hil`, by the clock."""
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

tools = Path(sys.argv[1])
SECONDS = 60.0


def processor_time(words):
    """Seconds that a command and what it starts take of processors, and by the clock."""
    def taken():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)  # os.times() counts in hundredths: some per cent of a run
        return usage.ru_utime + usage.ru_stime

    before, began = taken(), time.monotonic()
    subprocess.run([str(w) for w in words], check=True, stdout=subprocess.DEVNULL)
    return taken() - before, time.monotonic() - began


def one_core(what, goal, *words):
    command = [tools / "flexspline-hil", "drive", "--compensation", "on", "--seconds", SECONDS, *words]
    factors = [SECONDS / processor_time(command)[0] for _ in range(5)]
    print(f"{what} | real time | {goal} | {statistics.median(factors):.3g}", flush=True)


one_core("the twin, slow reversals, 8 kHz, one core", "at least 200", "--scenario", "slow-reversals", "--tick-hz", 8000)
one_core("the twin, sine, 8 kHz, one core", "at least 200", "--scenario", "sine", "--tick-hz", 8000)
one_core("the twin, slow reversals with Stribeck friction, 8 kHz, one core", "-", "--scenario", "slow-reversals", "--with",
         "stribeck_gaussian", "--tick-hz", 8000)
one_core("the twin, slow reversals, 20 kHz, one core", "-", "--scenario", "slow-reversals")

DRAWS = 40
with tempfile.TemporaryDirectory() as folder:
    answer = Path(folder) / "hil.json"
    busy, clock = processor_time([tools / "flexspline", "hil", "--scenario", "slow-reversals", "--tick-hz", 8000, "--seconds", SECONDS, "--draws",
                                  DRAWS, "--json", answer])
    runs = json.loads(answer.read_text())["runs"]
cores = len(os.sched_getaffinity(0))
count = DRAWS * len(runs) + len(runs)  # each drawn drive runs without compensation and with each model, and so does the drive
print(f"a batch of {count} runs, 8 kHz, all cores | real time | - | {count * SECONDS / clock:.3g}")
print(f"a batch of {count} runs, cores that it keeps busy | of {cores} | at least {0.8 * cores:g} | {busy / clock:.3g}")
