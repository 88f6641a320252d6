"""Results of a campaign as JSON lines, so that it goes on where its last run stopped."""
import json


def results_so_far(file, version, key):
    """By key(result); those of another version are put aside."""
    if not file.exists():
        return {}
    lines = file.read_text().splitlines()
    if not lines or json.loads(lines[0]) != {"version": version}:
        file.rename(str(file) + ".old")
        return {}
    known = {}
    for line in lines[1:]:
        try:
            one = json.loads(line)
        except json.JSONDecodeError:  # half written, by a run that was stopped
            continue
        known[key(one)] = one
    return known
