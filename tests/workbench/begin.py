#!/usr/bin/env python3
"""The workbench without arguments: recordings of many formats are dropped and a first model is identified: begin.py TOOL FIXTURES

Does what the page does, by the same requests: a file, what the user types, "Identify a first model". The drive is that of
FIXTURES/make.py; inertia and Coulomb friction have to come out within 5 %."""
import gzip
import io
import json
import math
import struct
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
import zipfile
from pathlib import Path

TOOL, FIXTURES = str(Path(sys.argv[1]).absolute()), Path(sys.argv[2])
INERTIA, COULOMB, TORQUE_CONSTANT, RATIO = 2e-4, 0.05, 0.1, 100
TIMES = [0.008 * k for k in range(1500)]


def motion(t):
    """Angle, speed, current of the motor."""
    angle = 60 * (math.sin(2 * t) / 2 + 0.5 * math.sin(5.3 * t) / 5.3)
    speed = 60 * (math.cos(2 * t) + 0.5 * math.cos(5.3 * t))
    acceleration = -60 * (2 * math.sin(2 * t) + 0.5 * 5.3 * math.sin(5.3 * t))
    return angle, speed, (INERTIA * acceleration + 1e-3 * speed + COULOMB * math.tanh(speed / 0.05)) / TORQUE_CONSTANT


def csv(header, line):
    return (header + "\n" + "".join(line(t, *motion(t)) + "\n" for t in TIMES)).encode()


def robot():
    names = [f"{name}_{k}" for name in ("target_q", "actual_q", "actual_qd", "actual_current") for k in range(2)]
    return csv("timestamp " + " ".join(names), lambda t, q, v, i: f"{93100.5 + t:.4f} 0 {q / RATIO:.9g} 0 {q / RATIO:.9g} 0 {v / RATIO:.9g} 0 {i:.9g}")


def npz():
    columns = {"t": TIMES, "theta_m": [motion(t)[0] for t in TIMES], "iq": [motion(t)[2] for t in TIMES]}
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, values in columns.items():
            header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({len(values)},), }}".ljust(117) + "\n"
            archive.writestr(name + ".npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + struct.pack(f"<{len(values)}d", *values))
    return out.getvalue()


def timetable():
    return csv("Time,theta_m,omega_m,iq", lambda t, q, v, i: f"{t:.9g} sec,{q:.9g},{v:.9g},{i:.9g}")


COUNTS = 65536 / (2 * math.pi)
WITH_CURRENT = {"torque_constant_nm_a": TORQUE_CONSTANT}
JOINT = {"joint": 1, "gear_ratio": RATIO}
CASES = [
    ("robot_data.csv", robot, {**WITH_CURRENT, **JOINT}),
    ("joint_states.bag", None, JOINT),
    ("joint_states.db3", None, JOINT),
    ("joint_states.mcap", None, JOINT),
    ("tview.log", None, WITH_CURRENT),
    ("controldesk.mat", None, WITH_CURRENT),
    ("timetable.csv", timetable, WITH_CURRENT),
    ("timetable.csv.gz", lambda: gzip.compress(timetable()), WITH_CURRENT),
    ("recorder.csv", lambda: csv("Time [sec],Position [cnt],Velocity [cnt/sec],Active Current [A]", lambda t, q, v, i: f"{t:.9g},{COUNTS * q:.0f},{COUNTS * v:.0f},{i:.9g}"),
     {**WITH_CURRENT, "encoder_counts": 65536}),
    ("log.npz", npz, WITH_CURRENT),
    # Names that say nothing, a current of the other sign: all of it is chosen.
    ("x.txt", lambda: csv("a;b;c", lambda t, q, v, i: f"{1e3 * t:.9g};{q * 180 / math.pi:.9g};{-1e3 * i:.9g}"),
     {**WITH_CURRENT, "map": ["time_s=a:ms", "motor_position_rad=b:deg", "current_a=c:mA"], "turned": ["current_a"]}),
]


class Page:
    def __init__(self, address):
        self.address, self.tab = address, ""
        self.tab = self.ask("api/tab", b"")["tab"]

    def ask(self, path, data=None, headers=None, **query):
        url = f"{self.address}{path}?{urllib.parse.urlencode({'tab': self.tab, **query})}"
        try:
            with urllib.request.urlopen(urllib.request.Request(url, data=data, headers=headers or {}), timeout=60) as answer:
                return json.loads(answer.read())
        except urllib.error.HTTPError as refused:
            raise SystemExit(f"{path}: {refused.code} {refused.read()!r}") from refused

    def act(self, what, **more):
        self.ask("api/do", json.dumps({"do": what, **more}).encode())
        return self.idle()

    def drop(self, name, content):
        body = b"--x\r\nContent-Disposition: form-data; name=\"file0\"; filename=\"" + name.encode() + b"\"\r\n\r\n" + content + b"\r\n--x--\r\n"
        self.ask("api/drop", body, {"Content-Type": "multipart/form-data; boundary=x"})
        return self.idle()

    def idle(self):
        seen = 0
        while True:
            state = self.ask("api/state", seen=seen)
            if "work" in state and state["work"] is None:
                return state
            seen = state["changes"]


def expect(condition, what):
    if not condition:
        raise SystemExit(f"begin.py: {what}")


def try_format(address, name, content, choices):
    page = Page(address)
    expect(page.idle()["steps"] == [], "there is a model before there are recordings")
    state = page.drop(name, content)
    expect("proposal" in state, f"{name}: nothing is proposed: {state.get('problem')}")
    if "turned" in choices:
        warnings = page.act("propose", choices={**choices, "turned": []})["proposal"]["warnings"]
        expect("scale = -1" in json.dumps(warnings), f"{name}: nothing is said of the sign: {warnings}")
    proposal = page.act("propose", choices=choices)["proposal"]
    used = {c["column"]: c["source"] for c in proposal["columns"] if c["source"]}
    expect(proposal["can_begin"], f"{name}: {proposal['why_not']} {proposal['findings']} {used}")
    expect(all(s.get("low") for s in proposal["signals"] if s["name"] in used.values()), f"{name}: a signal without a picture")
    state = page.act("begin", choices=choices)
    expect(len(state["steps"]) == 1, f"{name}: no model: {state.get('problem')}")
    values = {p["effect"]: p["value"] for p in state["parameters"]}
    for effect, truth in (("inertia", INERTIA), ("coulomb_friction", COULOMB)):
        expect(values.get(effect) is not None and abs(values[effect] / truth - 1) < 0.05, f"{name}: {effect} is {values.get(effect)}, not {truth}")
    return page


def main():
    with tempfile.TemporaryDirectory() as folder:
        served = Path(folder) / "served.json"
        server = subprocess.Popen([TOOL, "workbench", "--no-open", "--json", str(served), "--seconds", "600"], cwd=folder, stdout=subprocess.PIPE, text=True)
        try:
            while not served.exists():
                expect(server.poll() is None, "the workbench has ended")
                time.sleep(0.02)
            address = json.loads(served.read_text())["address"]
            for name, made, choices in CASES:
                page = try_format(address, name, made() if made else (FIXTURES / name).read_bytes(), choices)
            # A foreign file into data that are open: it is asked which column is which, and the recordings are added.
            # The drive is known by now.
            page = try_format(address, *[(n, m(), c) for n, m, c in CASES if n == "timetable.csv"][0])
            before = len(page.idle()["experiments"])
            state = page.drop("other.csv", robot())
            expect(state.get("proposal", {}).get("adds"), f"a foreign file: {state.get('problem')}")
            state = page.act("begin", choices={"joint": 1, "gear_ratio": RATIO, **WITH_CURRENT})
            expect(len(state["experiments"]) > before and len(state["steps"]) == 2, f"it was not added: {state.get('problem')}")
            # A format that is not read says how to convert it.
            page = Page(address)
            state = page.drop("log.parquet", b"PAR1" + b"\0" * 100 + b"PAR1")
            expect("to_csv" in json.dumps(state.get("problem")) or "convert" in json.dumps(state.get("problem")), f"Parquet: {state.get('problem')}")
            expect(server.poll() is None, "the workbench has ended")
        finally:
            server.terminate()
            server.wait(20)
    print(f"{len(CASES)} formats, each to a first model")


if __name__ == "__main__":
    main()
