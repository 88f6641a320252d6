#!/usr/bin/env python3
"""The workbench under load: workbench.py TOOLS MINUTES FOLDER VERSION

Four clients at once send a workbench of the embedded twin's recording the requests of its page, start work (diagnose, add, undo,
tabs), and send what no page would: invalid numbers, unknown fields, broken JSON, long texts, wrong tokens. Each request gets an
answer of its kind: 200 with JSON, or a refusal with its reason; never a 5xx, nothing without a token. At the end the page still
answers and has grown by less than 1500 MB (24 tabs, each with its steps and their results). Rounds of one minute, each with a new
workbench and seed; continues where the last run of this version stopped (FOLDER/workbench.jsonl). Exit code 1 if a round failed."""
import collections
import json
import random
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

CLIENTS, ROUND_S, MOST_GROWTH_MB = 4, 60.0, 1500.0
EFFECTS = ("stribeck_gaussian", "viscous_asymmetry", "current_offset", "torque_ripple:2", "no_such_effect", "", "x" * 5000)
ODD = ("", "-1", "nan", "1e999", "0x10", "9" * 40, "x" * 3000, "%00", "../../etc/passwd", "\u00fc\u2603", "NULL", "1;2")

tools, minutes, folder, version = Path(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4]
folder.mkdir(parents=True, exist_ok=True)
results_file, recording = folder / "workbench.jsonl", folder / "recording"


class Client(threading.Thread):
    def __init__(self, address, seed, end):
        super().__init__()
        self.address, self.chance, self.end = address, random.Random(seed), end
        self.codes, self.wrong, self.tab = collections.Counter(), [], ""

    def ask(self, path, query=None, body=None, token=True):
        url = self.address if token else self.address[: self.address.index("/", 8)] + "/" + "0" * 32 + "/"
        url += urllib.parse.quote(path) + ("?" + urllib.parse.urlencode(query) if query else "")
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        said = f"{'GET' if data is None else 'POST'} {path} {query} {(data or b'')[:120]!r}"
        try:
            with urllib.request.urlopen(urllib.request.Request(url, data=data), timeout=60) as answer:
                code, content = answer.status, answer.read()
        except urllib.error.HTTPError as refused:
            code, content = refused.code, refused.read()
        except OSError as gone:
            self.wrong.append(f"{said}: no answer: {gone}")
            return None
        self.codes[code] += 1
        if code >= 500 or (not token and code == 200):
            self.wrong.append(f"{said}: {code} {content[:200]!r}")
        if code == 200 and path.startswith("api/") and path != "api/file":
            try:
                return json.loads(content)
            except ValueError:
                self.wrong.append(f"{said}: 200 and no JSON: {content[:200]!r}")
        return None

    def any_of(self, *usual):
        return self.chance.choice(ODD if self.chance.random() < 0.2 else usual)

    def step(self):
        kind, q = self.chance.randrange(12), {"tab": self.any_of(self.tab)}
        if kind < 3:
            self.ask("api/trace", {**q, "experiment": self.any_of("free-sine-1hz", "free-composite"),
                                   "signal": self.any_of("motor_balance", "motor_velocity"), "from": self.any_of("0", "2"),
                                   "to": self.any_of("1", "12"), "points": self.any_of("10", "2000")})
        elif kind == 3:
            self.ask("api/maps", q)
        elif kind == 4:
            self.ask("api/stretches", {**q, "signal": self.any_of("motor_balance"), "variable": self.any_of("speed", "torque"),
                                       "low": self.any_of("0", "1"), "high": self.any_of("2", "100")})
        elif kind == 5:
            self.ask("api/state", {**q, "seen": self.any_of("0")})
        elif kind == 6:
            self.ask("api/do", q, {"do": self.any_of("diagnose", "undo", "redo", "cancel", "dismiss", "refit", "pack", "nonsense")})
        elif kind == 7:
            self.ask("api/do", q, {"do": self.chance.choice(("add", "remove")), "effect": self.chance.choice(EFFECTS)})
        elif kind == 8:
            self.ask("api/do", q, self.chance.choice((b"", b"{", b"[]", b"null", b"{\"do\": 1}", b"\xff\xfe", b"[" * 5000)))
        elif kind == 9:
            self.ask(self.any_of("", "index.html", "api/nothing", "api/file", "api/drive", "api/live"), q)
        elif kind == 10:
            self.ask("api/state", {"tab": self.tab, "seen": "0"}, token=False)
        else:
            opened = self.ask("api/tab", {"like": self.tab} if self.tab else None, {})
            if opened:
                self.tab = opened["tab"]
            self.ask("api/drop", q, {})  # without files

    def run(self):
        try:
            opened = self.ask("api/tab", None, {})
            self.tab = opened["tab"] if opened else ""
            while time.monotonic() < self.end and len(self.wrong) < 20:
                self.step()
        except Exception as error:  # an answer that is not what the page expects
            self.wrong.append(f"{type(error).__name__}: {error}")


def resident_mb(pid):
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return float(line.split()[1]) / 1024.0
    return 0.0


def one_round(number, seconds):
    if not recording.exists():
        subprocess.run([tools / "flexspline-hil", "record", "--out", recording, "--hide", "stribeck_gaussian"], check=True,
                       capture_output=True)
    listening = folder / "listening.json"
    listening.unlink(missing_ok=True)
    result = {"round": number, "codes": {}, "wrong": []}
    with open(folder / "workbench.txt", "w") as said:
        server = subprocess.Popen([tools / "flexspline", "workbench", recording, "--model", recording / "base-model.toml",
                                   "--no-open", "--json", listening], stdout=said, stderr=said)
    try:
        for _ in range(600):
            if listening.exists() or server.poll() is not None:
                break
            time.sleep(0.1)
        if not listening.exists():
            result["wrong"] = ["it did not start: " + (folder / "workbench.txt").read_text()[-300:]]
            return result
        address = next(v for v in json.loads(listening.read_text()).values() if str(v).startswith("http"))
        clients = [Client(address, 1000 * number + i, time.monotonic() + seconds) for i in range(CLIENTS)]
        before = resident_mb(server.pid)
        for client in clients:
            client.start()
        for client in clients:
            client.join()
        codes = collections.Counter()
        for client in clients:
            codes.update(client.codes)
            result["wrong"] += client.wrong
        result["codes"] = {str(code): count for code, count in sorted(codes.items())}
        if server.poll() is not None:
            result["wrong"].append(f"it ended with {server.returncode}: " + (folder / "workbench.txt").read_text()[-300:])
        else:
            result["grown_mb"] = resident_mb(server.pid) - before
            if result["grown_mb"] > MOST_GROWTH_MB:
                result["wrong"].append(f"it has grown by {result['grown_mb']:.0f} MB")
            last = Client(address, 0, 0.0)
            if not isinstance(last.ask("api/drive"), dict) and not last.codes:
                result["wrong"].append("it does not answer any more")
    finally:
        server.terminate()
        try:
            server.wait(20)
        except subprocess.TimeoutExpired:
            server.kill()
            result["wrong"].append("it did not end on request")
    return result


rounds = {}
if results_file.exists():
    lines = results_file.read_text().splitlines()
    if lines and json.loads(lines[0]) == {"version": version}:
        for line in lines[1:]:
            try:
                one = json.loads(line)
                rounds[one["round"]] = one
            except json.JSONDecodeError:  # incomplete, from a run that was stopped
                pass
    else:
        results_file.rename(str(results_file) + ".old")
if not results_file.exists():
    results_file.write_text(json.dumps({"version": version}) + "\n")

end = time.monotonic() + 60.0 * minutes
number = 0
while end - time.monotonic() > 1.0:
    if number not in rounds:
        rounds[number] = one_round(number, min(ROUND_S, end - time.monotonic()))
        with results_file.open("a") as out:
            print(json.dumps(rounds[number]), file=out)
        for wrong in rounds[number]["wrong"]:
            print(f"WRONG in round {number}: {wrong}", flush=True)
    number += 1

codes = collections.Counter()
for one in rounds.values():
    codes.update(one["codes"])
bad = sum(bool(one["wrong"]) for one in rounds.values())
grown = max((one.get("grown_mb", 0.0) for one in rounds.values()), default=0.0)
print(f"{len(rounds)} rounds with {CLIENTS} clients, version {version}: {sum(codes.values())} requests answered "
      f"({', '.join(f'{count} times {code}' for code, count in sorted(codes.items()))}); memory grew by {grown:.0f} MB at most "
      f"in a round; {bad} rounds went wrong")
sys.exit(bad > 0)
