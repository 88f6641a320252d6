#!/usr/bin/env python3
"""cycles.py PROCESSOR ELF PART=FUNCTION...: estimates the cycles of functions from the instructions that QEMU ran and
the timings that ARM published for Cortex-M0, M3 and M4 (technical reference manuals, "instruction timing"); the larger
figure where one states a range. Prints "PART least most mean". No wait states, no cache, and nothing of loads that follow
one another in a cycle less: an estimate, not a measurement."""
import collections
import os
import re
import subprocess
import sys
import tempfile

REFILL = {"m0": 2, "m3": 3, "m4": 3}  # a branch that is taken empties the pipeline
MULTIPLY = {
    "m0": {},
    "m3": {"mla": 2, "mls": 2, "smull": 5, "umull": 5, "smlal": 7, "umlal": 7},
    "m4": {},
}
FLOATING = {"vdiv": 14, "vsqrt": 14, "vmla": 3, "vmls": 3, "vnmla": 3, "vnmls": 3, "vnmul": 1, "vfma": 3, "vfms": 3,
            "vfnma": 3, "vfnms": 3, "vldr": 2, "vstr": 2}
BRANCHES = ("b", "bl", "bx", "blx", "cbz", "cbnz", "tbb", "tbh")
CONDITIONS = "eq ne cs hs cc lo mi pl vs vc hi ls ge lt gt le".split()


class Instruction(collections.namedtuple("Instruction", "size name operands")):
    @property
    def registers(self):
        inside = self.operands[self.operands.find("{") + 1 : self.operands.find("}")]
        count = 0
        for one in inside.replace(" ", "").split(","):
            ends = re.fullmatch(r"([rsd])(\d+)-[rsd](\d+)", one)
            count += int(ends[3]) - int(ends[2]) + 1 if ends else 1
        return count


def plain(mnemonic):
    """Without width, type and condition: ldr.w, vmul.f32, addeq."""
    name = mnemonic.split(".")[0]
    if name in BRANCHES or name in ("bls", "teq", "mls", "vmls", "muls", "lsls", "bics"):
        return "b" if name == "bls" else name
    for condition in CONDITIONS:
        if name.endswith(condition) and len(name) > len(condition):
            return name[: -len(condition)]
    return name


def straight_cycles(processor, i):
    """Of an instruction behind which the next one follows."""
    name = plain(i.name)
    if name.startswith("v"):
        if name.startswith(("vldm", "vstm", "vpush", "vpop")):
            return 1 + i.registers
        return FLOATING.get(name, 1)
    if name in ("push", "pop") or name.startswith(("ldm", "stm")):
        return 1 + i.registers
    if name in ("ldrd", "strd"):
        return 3
    if name.startswith("ldr"):
        return 2
    if name.startswith("str"):
        at_register = re.search(r"\[[^\]]*, *r\d", i.operands)
        return 2 if processor == "m0" or at_register else 1
    if name in ("sdiv", "udiv"):
        return 12
    if name in ("mrs", "msr", "dmb", "dsb", "isb"):
        return 4
    return MULTIPLY[processor].get(name, 1)


def cycles(processor, i, taken):
    cost = straight_cycles(processor, i)
    if not taken:
        return cost
    if plain(i.name) == "bl":
        return 4 if processor == "m0" else 1 + REFILL[processor]
    if "pop" in i.name or i.name.startswith("ldm"):
        return cost + REFILL[processor] + (1 if processor == "m0" else 0)
    return cost + REFILL[processor]


def program(elf):
    """Instructions by address, functions by name."""
    text = subprocess.run(["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", elf], check=True, capture_output=True,
                          text=True).stdout
    lines = []
    for line in text.splitlines():
        match = re.match(r"\s*([0-9a-f]+):\s+(\S+)\s*(.*)", line)
        if match:
            lines.append((int(match[1], 16), match[2], match[3]))
    instructions = {}
    for (at, name, operands), following in zip(lines, lines[1:] + [(0, "", "")]):
        size = following[0] - at
        instructions[at] = Instruction(size if size in (2, 4) else 4, name, operands)
    names = subprocess.run(["arm-none-eabi-nm", "-C", elf], check=True, capture_output=True, text=True).stdout
    functions = {}
    for line in names.splitlines():
        at, _, name = line.split(" ", 2)
        functions[name] = int(at, 16) & ~1
    return instructions, functions


def run(elf):
    """Addresses of the instructions that ran, in their order."""
    with tempfile.TemporaryDirectory() as folder:
        log = os.path.join(folder, "trace")
        os.mkfifo(log)
        qemu = subprocess.Popen(
            ["qemu-system-arm", "-M", "netduinoplus2", "-nographic", "-monitor", "none", "-serial", "none",
             "-semihosting-config", "enable=on,target=native", "-icount", "shift=0,sleep=off", "-singlestep", "-d",
             "exec,nochain", "-D", log, "-kernel", elf],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        at = None
        with open(log) as lines:  # "Trace 0: 0x7f.. [flags/ADDRESS/..."
            for line in lines:
                if line.startswith("Trace"):
                    if at is not None:
                        yield at
                    at = int(line.split("/", 2)[1], 16)
                elif line.startswith("Stopped execution"):  # of what it was about to run; it comes again
                    at = None
        if at is not None:
            yield at
        if qemu.wait() != 0:
            sys.exit(f"cycles.py: {elf} ended with {qemu.returncode}")


def main():
    if len(sys.argv) < 4 or sys.argv[1] not in REFILL:
        sys.exit(__doc__)
    processor, elf = sys.argv[1:3]
    instructions, functions = program(elf)
    begins = {}
    for part in sys.argv[3:]:
        name, _, function = part.partition("=")
        found = [at for full, at in functions.items() if f"{function}(" in full]
        if len(found) != 1:
            sys.exit(f"cycles.py: {len(found)} functions in {elf} are named {function}; one is looked for")
        begins[found[0]] = name
    counts = {name: [] for name in begins.values()}
    part, ends_at, count, before = None, 0, 0, None
    for at in run(elf):
        if before is not None and part is not None:
            i = instructions[before]
            count += cycles(processor, i, at != before + i.size)
        if part is not None and at == ends_at:
            counts[part].append(count)
            part = None
        if part is None and at in begins and before is not None:
            part, ends_at, count = begins[at], before + instructions[before].size, 0
        before = at
    for name, seen in counts.items():
        # The first ticks only take note of where the drive stands.
        if len(seen) < 10:
            sys.exit(f"cycles.py: {name} ran {len(seen)} times only")
        mean = sum(seen[2:]) / len(seen[2:])
        print(name, min(seen[2:]), max(seen[2:]), f"{mean:.0f}")


main()
