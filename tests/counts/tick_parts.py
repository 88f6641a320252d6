#!/usr/bin/env python3
"""tick_parts.py IMAGE FOLDER TICKS: runs an image of the application in QEMU on the recorded inputs FOLDER/to_drive and
counts the instructions of TICKS armed control ticks by part. Prints "PART least most mean", and last the whole. The part
of an instruction is that of the innermost function of the list below which it was inlined into; what is called and
belongs to none of them counts for its caller."""
import collections
import os
import re
import subprocess
import sys

SKIPPED = 150  # ticks that arm the drive, as in tick_inputs.cpp
PARTS = [  # innermost function first: the first pattern that fits its name; members of templates come without their class
    ("effects", r"model::(detail::AllPlaces|DriveModel)::|flexspline::effects::\w+::"),
    ("residual_map", r"ResidualMap::"),
    ("telemetry", r"firmware::Telemetry::|(^|::)(channels|record)$"),
    ("safety", r"firmware::(Safety|Watchdog)::|(^|::)check_safety$"),
    ("sensors", r"EncoderAngle::|control::shown|(^|::)(watch_rest|read)$"),
    ("observers", r"(EncoderKalman|RippleFilter|DisturbanceObserver|TorsionObserver)::|Control::(observe|estimate)"),
    ("set_point", r"control::(Trajectory|Stream)::|Control::(follow|set$)"),
    ("feedforward", r"control::Feedforward::|Control::compensate"),
    ("loops", r"control::(Loops|SpeedGuard)::|(^|::)actuation$|Control::update"),
    ("modes", r"firmware::(Application|Control)::|(^|::)(tick|release_or_take_parameters|take_command|obey|update_mode|tick_overrun)$"),
]
OUTSIDE = r"(^|::)(SysTick_Handler|co_simulate|main|background)$|qemu::HostFile"


def bare(name):
    """A function's qualified name without arguments, template arguments and return type."""
    name = re.sub(r" \[clone [^]]*\]| \[[^]]*\]| const$", "", name)
    name = name.replace("(anonymous namespace)", "anonymous").replace("operator()", "call")
    while True:
        shorter = re.sub(r"<[^<>]*>|\([^()]*\)", "", name)
        if shorter == name:
            break
        name = shorter
    return name.replace(" const", "").split(" ")[-1]


def part_of(chain):
    """None for a function that is called from several parts."""
    names = [bare(name) for name in chain]
    of_tick = any(re.search(r"(^|::)tick$", name) and "DriveModel" not in name for name in names)
    if not of_tick and any(re.search(OUTSIDE, name) for name in names):
        return "outside"
    for name in names:
        for part, pattern in PARTS:
            if re.search(pattern, name):
                return part
    return None


def chains(image, addresses):
    """By address the functions that it was inlined through, innermost first."""
    text = subprocess.run(["arm-none-eabi-addr2line", "-e", image, "-f", "-i", "-a", "-C"], check=True, text=True,
                          capture_output=True, input="\n".join(hex(a) for a in addresses)).stdout
    found, at, lines = {}, None, iter(text.splitlines())
    for line in lines:
        if line.startswith("0x"):
            at = int(line, 16)
            found[at] = []
        else:
            found[at].append(line)
            next(lines)
    return found


def functions(image):
    text = subprocess.run(["arm-none-eabi-nm", image], check=True, text=True, capture_output=True).stdout
    return {line.split()[2]: int(line.split()[0], 16) & ~1 for line in text.splitlines() if len(line.split()) == 3}


def trace(image, folder, begins, ticks):
    """Addresses of the instructions of each of `ticks` interrupts, as lists."""
    log = os.path.join(folder, "trace")
    if os.path.exists(log):
        os.remove(log)
    os.mkfifo(log)
    qemu = subprocess.Popen(
        ["qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "none",
         "-semihosting-config", "enable=on,target=native", "-icount", "shift=0,sleep=off", "-singlestep", "-d",
         "exec,nochain", "-D", "trace", "-kernel", os.path.abspath(image)],
        cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    begin = f"/{begins:08x}/"
    seen, tick = 0, []
    try:
        with open(log) as lines:  # "Trace 0: 0x7f.. [flags/ADDRESS/..."
            for line in lines:
                if begin in line and line.startswith("Trace"):
                    if seen > SKIPPED:
                        yield tick
                    seen, tick = seen + 1, []
                    if seen > SKIPPED + ticks:
                        return
                if seen > SKIPPED:
                    if line.startswith("Trace"):
                        tick.append(line.split("/", 2)[1])
                    elif tick:  # "Stopped execution" of what it was about to run; it comes again
                        tick.pop()
        sys.exit(f"tick_parts.py: {image} ended after {seen} ticks")
    finally:
        qemu.kill()
        qemu.wait()
        os.remove(log)


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    image, folder, ticks = sys.argv[1], sys.argv[2], int(sys.argv[3])
    recorded = list(trace(image, folder, functions(image)["SysTick_Handler"], ticks))
    addresses = sorted({address for tick in recorded for address in tick})
    found = chains(image, [int(address, 16) for address in addresses])
    names = [part for part, _ in PARTS]
    part_at = {address: part_of(found[int(address, 16)]) for address in addresses}
    counts = collections.defaultdict(list)
    for tick in recorded:
        one, part = collections.Counter(), "outside"
        for address in tick:
            part = part_at[address] or part
            one[part] += 1
        for name in names:
            counts[name].append(one[name])
        counts["whole"].append(sum(one[name] for name in names))
    for name in names + ["whole"]:
        values = counts[name]
        print(name, min(values), max(values), round(sum(values) / len(values)))


if __name__ == "__main__":
    main()
