"""Writes the page of coverage.sh, by folder, to standard output. Arguments: gcovr's JSON, file of reasons, version, tests
that passed, programs in which tests failed, output file for the list of files and functions."""
import collections
import json
import re
import sys

FEW_LINES = 8  # of a file that is named as little covered
LITTLE_PERCENT = 80.0
NO_REASON = "no reason: tests are missing"

files = json.load(open(sys.argv[1]))["files"]
version, passed, failed = sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
reasons = []  # (start of a path, why)
for line in open(sys.argv[2]):
    if line.strip() and not line.startswith("#"):
        start, why = line.split(None, 1)
        reasons.append((start, why.strip()))


def reason(path):
    fitting = [r for r in reasons if path.startswith(r[0])]
    return max(fitting, key=lambda r: len(r[0]))[1] if fitting else NO_REASON


def percent(part, whole):
    return 100.0 * part / whole if whole else 100.0


def readable(name):
    """A function's name without its template's arguments and parameters."""
    while True:
        shorter = re.sub(r"<[^<>]*>", "", name)
        if shorter == name:
            break
        name = shorter
    return name.split("(")[0].split(" ")[-1].replace("flexspline::", "")


lines = collections.defaultdict(lambda: [0, 0])  # by folder: all, run
little, never = [], []
functions = collections.defaultdict(lambda: [0, 0])
for f in files:
    path = f["file"]
    # host/ has groups of folders, the other top folders do not.
    folder = "/".join(path.split("/")[:-1][:3 if path.startswith("host/") else 2])
    code = [l for l in f["lines"] if not l.get("gcovr/noncode", False)]
    run = sum(l["count"] > 0 for l in code)
    lines[folder][0] += len(code)
    lines[folder][1] += run
    if len(code) >= FEW_LINES and percent(run, len(code)) < LITTLE_PERCENT:
        little.append((percent(run, len(code)), len(code) - run, path))
    # All instances of a template are at one line: it was called if one of them was.
    called = collections.defaultdict(int)
    names = {}
    for g in f.get("functions", []):
        called[g["lineno"]] += g["execution_count"]
        names[g["lineno"]] = g["name"]
    functions[folder][0] += len(called)
    functions[folder][1] += sum(count > 0 for count in called.values())
    never += [(path, at, readable(names[at])) for at, count in called.items() if count == 0]

print("# What the quick tests run, by folder\n")
print(f"Written by `./dev coverage` from version {version}: {passed} tests passed"
      + (f", and tests failed in {failed} runs" if failed else "")
      + ". gcc's counters at -O1; unit, command and report tests; not campaigns, fuzzing, boards,")
print("guests and the workbench's page. That a line ran does not prove that it is right. Files and functions: `build/coverage/coverage/files.md`.\n")
shares = sorted((percent(run, whole), folder) for folder, (whole, run) in lines.items())
print("Share of the lines that ran, in percent, least first: "
      + ", ".join(f"`{folder}` {share:.1f}" for share, folder in shares) + ".\n")
all_lines, run = (sum(x[i] for x in lines.values()) for i in (0, 1))
print(f"All: {percent(run, all_lines):.1f} % of {all_lines} lines. ", end="")
all_functions, called = (sum(x[i] for x in functions.values()) for i in (0, 1))
print(f"Of {all_functions} functions {called} were called ({percent(called, all_functions):.1f} %). "
      f"Of {len(little)} files less than {LITTLE_PERCENT:.0f} % of the lines ran; "
      f"{sum(reason(path) == NO_REASON for _, _, path in little)} of these have no reason in `tests/coverage/reasons.txt`.")

with open(sys.argv[6], "w") as out:
    print(f"# Files of which less than {LITTLE_PERCENT:.0f} % ran\n\n| file | ran | lines that did not | why |\n| --- | ---: | ---: | --- |", file=out)
    for share, missing, path in sorted(little):
        print(f"| `{path}` | {share:.0f} % | {missing} | {reason(path)} |", file=out)
    print(f"\n# Functions never called: {len(never)}\n", file=out)
    by_file = collections.defaultdict(list)
    for path, at, name in sorted(never):
        by_file[path].append(f"`{name}` ({at})")
    for path in sorted(by_file, key=lambda p: -len(by_file[p])):
        print(f"- `{path}`: {', '.join(by_file[path])}", file=out)
