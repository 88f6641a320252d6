#!/usr/bin/env python3
"""What an effect's header says, written where else it has to stand.

effect_rows.py TOOL ROOT          writes the tables of shared/effects/CATALOGUE.md
effect_rows.py TOOL ROOT NAME     and the rows of effect NAME in the tests that lack it: its published number, keys and
                                  units, and a place for its law as a formula, which fails until you write it
effect_rows.py TOOL ROOT --check  exit code 1 where CATALOGUE.md is not what the headers say
"""
import json
import pathlib
import re
import subprocess
import sys

BALANCES = ("motor", "transmission", "load")
BEGIN, END = "<!-- {} balance: made by ./dev effect -->\n", "<!-- end -->\n"


def effects_of(tool):
    answer = subprocess.run([tool, "effects", "--json", "-"], capture_output=True, text=True, check=True)
    return [e for e in json.loads(answer.stdout)["effects"] if e["balance"] is not None]


def in_code(names):
    return ", ".join(f"`{name}`" for name in names)


def parameters_cell(effect):
    """Keys with their letters; those that are counted, as weight_1 to weight_8, by their first and last."""
    keys = effect["parameters"]
    groups = {}
    for p in keys:
        counted = re.match(r"(.*_)\d+$", p["parameter"])
        groups.setdefault(counted[1] if counted and len(keys) > 8 else p["parameter"], []).append(p)
    cells = []
    for group in groups.values():
        first = group[0]
        if len(group) > 1:
            cell = f"`{first['parameter']}` to `{group[-1]['parameter']}`"
        elif first["symbol"] != first["parameter"]:
            cell = f"`{first['parameter']}` {first['symbol']}"
        else:
            cell = f"`{first['parameter']}`"
        if first["kind"] == "given":
            cell += " (stated)"
        cells.append(cell)
    return ", ".join(cells)


def tables_of(effects):
    tables = {}
    for balance in BALANCES:
        rows = ["| effect | torque or change | parameters | confused with |\n", "| --- | --- | --- | --- |\n"]
        for e in sorted((e for e in effects if e["balance"] == balance), key=lambda e: e["number"]):
            torque = f"`{e['equation']}`"
            if e["replaces"] and not e["equation"].startswith("replaces"):
                torque = f"replaces {in_code(e['replaces'])}: {torque}"
            if e["host_only"]:
                torque += "; host only"
            rows.append(f"| `{e['name']}` | {torque} | {parameters_cell(e)} | {in_code(e['rivals'])} |\n")
        tables[balance] = "".join(rows)
    return tables


def with_tables(document, effects):
    for balance, table in tables_of(effects).items():
        begin = BEGIN.format(balance)
        if begin not in document:
            sys.exit(f"CATALOGUE.md has no line {begin.strip()}")
        head, rest = document.split(begin, 1)
        document = head + begin + table + END + rest.split(END, 1)[1]
    return document


def number(value):
    return f"{value:g}" if value != int(value) or abs(value) >= 1e5 else f"{value:.1f}"


def published_row(effect):
    kinds = {"shape": "nonlinear"}
    parameters = ", ".join(
        f'{{"{p["parameter"]}", "{p["unit"]}", {kinds.get(p["kind"], p["kind"])}, {number(p["usual"])}, '
        f'{number(p["usual"])}}}' for p in effect["parameters"])
    return f'      {{"{effect["name"]}", {effect["number"]}, {effect["balance"]}, {effect["phase"]}, {{{parameters}}}}},\n'


def law_to_write(effect):
    message = f"write the law of {effect['name']} here, from its equation: {effect['equation']}"
    return (f'      {{"{effect["name"]}", each([](const Values&, const Instant&) -> double {{\n'
            f'         throw std::logic_error("{message}");\n       }})}},\n')


def insert(path, name, row, before):
    """Inserts `row` before the last `before`, where no row of `name` stands yet. Returns what was done, in words."""
    text = path.read_text()
    if f'"{name}"' in text:
        return f"{path.name}: has {name} already"
    at = text.rindex(before)
    path.write_text(text[:at] + row + text[at:])
    return f"{path.name}: a row was added"


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    tool, root = sys.argv[1], pathlib.Path(sys.argv[2])
    wanted = sys.argv[3] if len(sys.argv) == 4 else None
    effects = effects_of(tool)
    page = root / "shared/effects/CATALOGUE.md"
    document = page.read_text()
    made = with_tables(document, effects)
    if wanted == "--check":
        if made != document:
            sys.exit("shared/effects/CATALOGUE.md is not what the effects' headers say; run: ./dev effect")
        return
    page.write_text(made)
    last = max(e["number"] for e in effects)
    print(f"CATALOGUE.md: {len(effects)} effects; the next one's number: {last + 1}, the last possible one: 63")
    if wanted is None:
        return
    found = [e for e in effects if e["name"] == wanted]
    if not found:
        sys.exit(f"no effect '{wanted}'; write shared/effects/{wanted}.hpp and its line in list.hpp first "
                 "(shared/effects/ADD-YOUR-OWN.md)")
    unit = root / "tests/unit"
    print(insert(unit / "catalogue_published.hpp", wanted, published_row(found[0]), "  };\n  return kList;"))
    print(insert(unit / "effects_truths.cpp", wanted, law_to_write(found[0]), "  };\n  return table;"))


if __name__ == "__main__":
    main()
