"""Results of a campaign as JSON lines, so that it continues where its last run stopped."""
import json


def results_so_far(file, version, key):
    """By key(result); a file of another version is renamed."""
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
        except json.JSONDecodeError:  # incomplete, from a run that was stopped
            continue
        known[key(one)] = one
    return known
