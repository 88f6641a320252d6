"""Writes the page of coverage.sh to standard output. Arguments: gcovr's JSON, file of reasons, version, tests that
passed, programs in which tests failed."""
import collections
import json
import re
import sys

FEW_LINES = 8  # of a file that is named as little covered
LITTLE_PERCENT = 80.0
MOST_FUNCTIONS = 60

files = json.load(open(sys.argv[1]))["files"]
version, passed, failed = sys.argv[3], int(sys.argv[4]), int(sys.argv[5])
reasons = []  # (start of a path, why)
for line in open(sys.argv[2]):
    if line.strip() and not line.startswith("#"):
        start, why = line.split(None, 1)
        reasons.append((start, why.strip()))


def reason(path):
    fitting = [r for r in reasons if path.startswith(r[0])]
    return max(fitting, key=lambda r: len(r[0]))[1] if fitting else "no reason: tests are missing"


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
    folder = "/".join(path.split("/")[:2]) if path.count("/") > 1 else path.split("/")[0]
    code = [l for l in f["lines"] if not l.get("gcovr/noncode", False)]
    run = sum(l["count"] > 0 for l in code)
    lines[folder][0] += len(code)
    lines[folder][1] += run
    if len(code) >= FEW_LINES and percent(run, len(code)) < LITTLE_PERCENT:
        little.append((percent(run, len(code)), len(code) - run, path))
    # All instances of a template stand at one line: it was called where one of them was.
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
      + ". gcc's counters at -O1, without sanitizers; unit tests, command tests and those of the report. Campaigns, fuzzing, boards,")
print("guests and the workbench's page run more than this, and are not counted. A line that ran is not a line that was judged.\n")
print("| folder | lines | of which ran | functions | of which called |\n| --- | ---: | ---: | ---: | ---: |")
for folder in sorted(lines):
    all_lines, run = lines[folder]
    all_functions, called = functions[folder]
    print(f"| `{folder}` | {all_lines} | {percent(run, all_lines):.1f} % | {all_functions} | {percent(called, all_functions):.1f} % |")
all_lines, run = (sum(x[i] for x in lines.values()) for i in (0, 1))
all_functions, called = (sum(x[i] for x in functions.values()) for i in (0, 1))
print(f"| all | {all_lines} | {percent(run, all_lines):.1f} % | {all_functions} | {percent(called, all_functions):.1f} % |\n")

print(f"## Files of which less than {LITTLE_PERCENT:.0f} % ran\n\n| file | ran | lines that did not | why |\n| --- | ---: | ---: | --- |")
for share, missing, path in sorted(little):
    print(f"| `{path}` | {share:.0f} % | {missing} | {reason(path)} |")
print(f"\n## Functions never called: {len(never)}\n")
by_file = collections.defaultdict(list)
for path, at, name in sorted(never):
    by_file[path].append(f"`{name}` ({at})")
shown = 0
for path in sorted(by_file, key=lambda p: -len(by_file[p])):
    if shown >= MOST_FUNCTIONS:
        print(f"\nAnd {len(never) - shown} more, a few in each of the other files.")
        break
    print(f"- `{path}`: {', '.join(by_file[path])}")
    shown += len(by_file[path])
