#!/usr/bin/env python3
"""Reads telemetry of a Flexspline drive and prints it as CSV: a program of one's own, without the tool.

    flexspline export --protocol-header --out flexspline_protocol.h
    read_telemetry.py --header flexspline_protocol.h --channels velocity,current,torque --frames 100

Numbers and layouts come from that header. Over USB it needs hidapi for Python (Debian: python3-hid);
--tcp HOST:PORT and --serial PORT need nothing, and carry the same messages in frames of a serial line.
"""
import argparse
import os
import re
import socket
import struct
import sys
import time
import zlib


def read_header(path):
    """Names of the header, without FLEXSPLINE_, and their numbers; units of channels from the comments."""
    numbers, units = {}, {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            found = re.match(r"#define FLEXSPLINE_(\w+)\s+(0x[0-9A-Fa-f]+|\d+)u(?: /\* (.*) \*/)?", line)
            if found:
                numbers[found[1]] = int(found[2], 0)
                if found[1].startswith("CHANNEL_"):
                    units[found[1][len("CHANNEL_"):].lower()] = found[3] or ""
    return numbers, units


class Usb:
    """Reports of 64 bytes over HID; on Linux the interpreter's user needs the udev rules."""

    def __init__(self, numbers, serial):
        import hid
        self.device = hid.device()
        try:
            self.device.open(numbers["USB_VENDOR"], numbers["USB_PRODUCT"], serial)
        except OSError:
            sys.exit("no drive is on USB, or your user may not open it: flexspline drives says which, and what to do")
        self.report = numbers["REPORT_BYTES"]

    def send(self, message):
        # The first byte is the report's number: these have none.
        if self.device.write(b"\0" + message.ljust(self.report, b"\0")) < 0:
            sys.exit("the drive is gone")

    def receive(self, timeout_s):
        try:
            return bytes(self.device.read(self.report, max(1, int(1000 * timeout_s))))
        except OSError:
            sys.exit("the drive is gone")


class Line:
    """The same messages on a line of bytes: message and CRC-32, stuffed by COBS, then a zero."""

    def __init__(self, read, write):
        self.read, self.write, self.buffer = read, write, b""

    def send(self, message):
        plain = message + struct.pack("<I", zlib.crc32(message))
        stuffed = b"".join(bytes([len(part) + 1]) + part for part in plain.split(b"\0"))
        self.write(stuffed + b"\0")

    def receive(self, timeout_s):
        until = time.monotonic() + timeout_s
        while b"\0" not in self.buffer:
            if time.monotonic() > until:
                return b""
            self.buffer += self.read()
        frame, self.buffer = self.buffer.split(b"\0", 1)
        plain = b""
        while frame:
            plain += frame[1:frame[0]] + b"\0"
            frame = frame[frame[0]:]
        plain = plain[:-1]
        message, checksum = plain[:-4], plain[-4:]
        # A garbled frame is no message; whoever waits for it asks again.
        return message if struct.pack("<I", zlib.crc32(message)) == checksum else b""


def tcp_line(where):
    where, _, token = where.partition("/")
    host, port = where.rsplit(":", 1)
    connection = socket.create_connection((host, int(port)), timeout=10)
    connection.sendall(f"flexspline {token}\n".encode())
    connection.settimeout(0.05)

    def read():
        try:
            piece = connection.recv(4096)
        except TimeoutError:
            return b""
        if not piece:
            sys.exit("the drive is gone")
        return piece

    return Line(read, connection.sendall)


def serial_line(port):
    import termios
    import tty
    handle = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(handle)
    settings = termios.tcgetattr(handle)
    settings[4] = settings[5] = termios.B115200
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, 1
    termios.tcsetattr(handle, termios.TCSANOW, settings)
    return Line(lambda: os.read(handle, 4096), lambda data: os.write(handle, data))


class Drive:
    def __init__(self, link, numbers):
        self.link, self.n, self.number = link, numbers, 0

    def ask(self, kind, payload=b"", timeout_s=2.0):
        """Sends a request; the payload of its answer. Telemetry that comes between is passed over."""
        self.number = self.number % 255 + 1
        head = struct.pack("<BBBB", self.n["KIND_" + kind], self.number, len(payload), 0)
        for _ in range(3):
            self.link.send(head + payload)
            until = time.monotonic() + timeout_s
            while time.monotonic() < until:
                message = self.link.receive(until - time.monotonic())
                if len(message) < 4 or message[0] != (head[0] | self.n["ANSWER_BIT"]) or message[1] != self.number:
                    continue
                if message[3] != self.n["CODE_DONE"]:
                    names = [key[5:].lower() for key in self.n if key.startswith("CODE_") and self.n[key] == message[3]]
                    sys.exit(f"the drive answers {kind.lower()} with {names[0] if names else message[3]}")
                return message[4:4 + message[2]]
        sys.exit(f"the drive does not answer {kind.lower()}")

    def read_base(self, name):
        """A base of the active block's header: mantissa 2^(exponent - 30)."""
        request = struct.pack("<BI", self.n["BLOCK_ACTIVE"], self.n[f"BASE_{name.upper()}_AT"])
        mantissa, exponent = struct.unpack_from("<ii", self.ask("BLOCK_READ", request), self.n["CHUNK_BYTES_AT"])
        return mantissa * 2.0 ** (exponent - 30)

    def frames(self, channels, every):
        """Subscribes; gives (tick, words) for each frame as it comes, and says where some are missing."""
        numbers = [self.n["CHANNEL_" + name.upper()] for name in channels]
        self.ask("TELEMETRY", struct.pack("<HB", every, len(numbers)) + bytes(numbers))
        expected = None
        quiet_since = time.monotonic()
        while True:
            message = self.link.receive(0.5)
            if len(message) < 4 or message[0] != self.n["KIND_TELEMETRY_FRAMES"]:
                if time.monotonic() - quiet_since > 10.0:
                    sys.exit("no telemetry for 10 s")
                continue
            quiet_since = time.monotonic()
            width, count = message[1], message[3]
            sequence, tick = struct.unpack_from("<II", message, 4)
            if width != len(channels):
                continue  # of a subscription before
            if expected is not None and sequence != expected:
                print(f"# {(sequence - expected) % 2**32} frames lost", file=sys.stderr)
            expected = (sequence + count) % 2**32
            for i in range(count):
                at = 4 + self.n["FRAME_HEAD_BYTES"] + 4 * width * i
                yield (tick + i * every) % 2**32, struct.unpack_from(f"<{width}i", message, at)


# What a channel is a share of; the header has the bases.
BASES = {"velocity": "velocity", "set_velocity": "velocity", "acceleration": "acceleration",
         "set_acceleration": "acceleration", "output_velocity": "output_velocity", "torque": "output_torque",
         "current": "current", "command_current": "current", "temperature": "temperature", "disturbance": "torque",
         "feedforward_torque": "torque", "command_torque": "torque", "torsion": "torsion"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--header", required=True, help="of flexspline export --protocol-header")
    parser.add_argument("--serial-number", help="of the drive on USB (default: the first)")
    parser.add_argument("--tcp", metavar="HOST:PORT/TOKEN", help="a twin, as flexspline twin says it")
    parser.add_argument("--serial", metavar="PORT", help="a serial port")
    parser.add_argument("--channels", default="velocity,current,torque")
    parser.add_argument("--every", type=int, default=100, help="ticks from frame to frame")
    parser.add_argument("--frames", type=int, default=100, help="ends after so many")
    options = parser.parse_args()
    numbers, units = read_header(options.header)
    channels = options.channels.split(",")
    for name in channels:
        if name not in units:
            sys.exit(f"there is no channel {name}; there are {', '.join(units)}")
    if options.tcp:
        link = tcp_line(options.tcp)
    elif options.serial:
        link = serial_line(options.serial)
    else:
        link = Usb(numbers, options.serial_number)
    drive = Drive(link, numbers)

    identity = drive.ask("IDENTIFY", bytes([numbers["PROTOCOL_MAJOR"], numbers["PROTOCOL_MINOR"]]))
    if identity[numbers["IDENTITY_MAJOR_AT"]] != numbers["PROTOCOL_MAJOR"]:
        sys.exit("the drive speaks another version of the protocol; make the header with the tool that fits it")
    serial = identity[numbers["IDENTITY_SERIAL_AT"]:][:16].rstrip(b"\0").decode("ascii")
    (tick_hz,) = struct.unpack_from("<I", identity, numbers["IDENTITY_TICK_HZ_AT"])
    print(f"# drive {serial}, {tick_hz} ticks a second", file=sys.stderr)

    scales = [drive.read_base(BASES[name]) * 2.0 ** -numbers["VALUE_FRACTION_BITS"] if name in BASES else 1
              for name in channels]
    print("time_s," + ",".join(f"{name} [{units[name]}]" if units[name] else name for name in channels))
    first = None
    count = 0
    for tick, words in drive.frames(channels, options.every):
        first = tick if first is None else first
        print(f"{(tick - first) % 2**32 / tick_hz:.6f}," + ",".join(f"{w * s:.7g}" for w, s in zip(words, scales)))
        count += 1
        if count == options.frames:
            break
    drive.ask("TELEMETRY", struct.pack("<HB", options.every, 0))


if __name__ == "__main__":
    main()
