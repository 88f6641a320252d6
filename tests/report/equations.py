#!/usr/bin/env python3
"""Checks EQUATIONS.md: equations.py SOURCE. Every equation from 1 to 86 has one line, and every file and test that is named exists."""
import re
import sys
from pathlib import Path


def numbers(cell):
    found = []
    for part in cell.split(","):
        ends = [int(n) for n in re.findall(r"\d+", part)]
        found += range(ends[0], ends[-1] + 1)
    return found


def main():
    root = Path(sys.argv[1])
    tests = set()
    for source in (root / "tests").rglob("*_test.cpp"):
        for suite, name in re.findall(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", source.read_text(), re.M):
            tests.add(f"{suite}.{name}")
    problems, seen = [], []
    for line in (root / "tests/report/EQUATIONS.md").read_text().splitlines():
        if not re.match(r"- \d", line):
            continue
        equation, text = line[2:].split(": ", 1)
        where, test = text.split("; ")[-2:]
        seen += numbers(equation)
        if "/" in where.split(" ")[0] and not (root / where.split(" ")[0]).exists():
            problems.append(f"equation {equation}: there is no {where}")
        if test not in tests:
            problems.append(f"equation {equation}: there is no test {test}")
    if sorted(seen) != list(range(1, 87)):
        problems.append(f"equations without a line, or with two: {sorted(set(range(1, 87)) ^ set(seen)) or sorted(seen)}")
    print("\n".join(problems))
    sys.exit(1 if problems else 0)


main()
