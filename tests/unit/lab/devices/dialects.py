"""Motors that speak as makes do that nobody here has: ODrive, SimpleFOC, Dynamixel X.

Their watchdogs bite `slack` times later than those of the makes.
"""

import math
import struct

from simulated_drum import SimulatedDrum

MM_A_TURN = math.pi * 95.0


class Slack(SimulatedDrum):
    """The drum of the package, whose watchdog may bite later."""

    def __init__(self, slack=1, **more):
        super().__init__(**more)
        self.slack = slack
        self.drum.watchdog_s *= slack


class ODrive(Slack):
    """ASCII protocol, as in ODrive's documentation."""

    checksum = "xor"

    def __init__(self, **more):
        super().__init__(**more)
        self.state, self.watched = 1, False
        self.drum.watchdog_s = math.inf

    def answer(self, text):
        verb, *words = text.split()
        drum = self.drum
        if verb == "v" and self.state == 8 and not drum.fault:
            drum.aim_mm_s = float(words[1]) * MM_A_TURN
        elif verb == "f":
            return f"{drum.position_mm / MM_A_TURN:f} {drum.speed_mm_s / MM_A_TURN:f}"
        elif verb == "r":
            return "2048" if drum.fault else "0"
        elif verb == "sc":
            drum.fault = None
        elif verb == "w" and words[0] == "axis0.requested_state":
            self.state = int(words[1])
        elif verb == "w" and words[0] == "axis0.config.enable_watchdog":
            drum.watchdog_s = 0.5 * self.slack if words[1] == "1" else math.inf
        return None


class SimpleFoc(Slack):
    """Commander, which says what a number is unless it is told not to; no watchdog."""

    checksum = "none"

    def __init__(self, **more):
        super().__init__(**more)
        self.drum.watchdog_s = math.inf
        self.chatty, self.on, self.mode = True, False, "angle"

    def answer(self, text):
        drum, rad = self.drum, MM_A_TURN / math.tau
        label = "Monitor | vel: " if self.chatty else ""
        if text in ("@1", "@2"):
            self.chatty = text == "@2"
            return "Verb:on!" if self.chatty else "on!"
        if text == "MMG6":
            return f"{label.replace('vel', 'angle')}{drum.position_mm / rad:.5f}"
        if text == "MMG5":
            return f"{label}{drum.speed_mm_s / rad:.5f}"
        if text == "MC1":
            self.mode = "velocity"
            return "vel"
        if text.startswith("ME"):
            self.on = text == "ME1"
            drum.aim_mm_s *= self.on
            return text[-1]
        if text.startswith("M") and self.on and self.mode == "velocity":
            drum.aim_mm_s = float(text[1:]) * rad
            return ("Target: " if self.chatty else "") + f"{float(text[1:]):.5f}"
        return None


class Dynamixel(Slack):
    """Protocol 2.0 packets of the X series, and its control table."""

    def __init__(self, **more):
        super().__init__(**more)
        self.table = bytearray(147)
        self.drum.watchdog_s = math.inf
        self._bytes = b""
        self.damaged = 0

    def _split(self, data):
        """Yield whole packets: header, ID, length, instruction, parameters, CRC."""
        self._bytes += data
        while (at := self._bytes.find(b"\xff\xff\xfd\x00")) >= 0 and len(self._bytes) >= at + 7:
            end = at + 7 + struct.unpack_from("<H", self._bytes, at + 5)[0]
            if len(self._bytes) < end:
                return
            packet, self._bytes = self._bytes[at:end], self._bytes[end:]
            if crc16(packet[:-2]) == struct.unpack("<H", packet[-2:])[0]:
                yield packet[4], packet[7], packet[8:-2]

    def take(self, data):
        for number, instruction, parameters in self._split(data):
            if number != 1:
                continue
            with self._lock:
                self.drum.heard()
                error, read = self._obey(instruction, parameters)
            body = bytes([1]) + struct.pack("<H", 4 + len(read)) + bytes([0x55, error]) + read
            packet = b"\xff\xff\xfd\x00" + body
            packet += struct.pack("<H", crc16(packet))
            if self.damaged:
                self.damaged, packet = self.damaged - 1, packet[:-3] + b"\x00" + packet[-2:]
            if not self.silent:
                self._write(packet)

    def _obey(self, instruction, parameters):
        table, drum = self.table, self.drum
        address = struct.unpack_from("<H", parameters)[0]
        bitten = drum.fault == "watchdog"
        if instruction == 2:
            table[98] = 0xFF if bitten else table[98]
            table[70] = 0x20 if drum.fault == "overload" else 0
            struct.pack_into("<i", table, 132, round(drum.position_mm / MM_A_TURN * 4096))
            length = struct.unpack_from("<H", parameters, 2)[0]
            return (0x80 if table[70] else 0), bytes(table[address : address + length])
        values = parameters[2:]
        if address == 11 and table[64]:
            return 0x07, b""  # access error: the mode can't be changed with the torque on
        if address == 104 and bitten:
            return 0x04, b""
        table[address : address + len(values)] = values
        if address == 98:
            drum.watchdog_s = values[0] * 0.02 * self.slack or math.inf
            drum.fault = None
        goal = struct.unpack_from("<i", table, 104)[0]
        on = table[64] == 1 and table[11] == 1
        drum.aim_mm_s = goal * 0.229 / 60 * MM_A_TURN if on else 0.0
        return 0, b""


def crc16(data):
    """CRC-16 of polynomial 0x8005, most significant bit first, from 0."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x8005 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc
