"""A Dynamixel of the X series (protocol 2.0), through dynamixel-sdk."""

import atexit
import math
import threading
import time
from contextlib import suppress
from typing import Annotated, Any, Literal

from pydantic import Field

from afferents.errors import InputError, reason_of
from afferents.lab.devices import base
from afferents.lab.devices.base import DeviceError, DriveLimits, DriveState
from afferents.plugins import import_extra

OPERATING_MODE, TORQUE, ERRORS, WATCHDOG = 11, 64, 70, 98
GOAL_SPEED, POSITION = 104, 132
"""Addresses in the control table of the X series (emanual.robotis.com)."""
STATE_BYTES = POSITION + 4 - ERRORS
"""From `ERRORS` to the position: what is read in one answer."""
BY_SPEED = 1
"""Operating mode."""
TURN = 4096
"""Counts of position a turn."""
TURNS_A_COUNT = 0.229 / 60
"""One count of speed is 0.229 turns a minute."""
WATCHDOG_UNITS = 25
"""Of 20 ms: it stops when it hears nothing for 0.5 s."""
TRIES = 3
LATE_S = 0.05
"""An answer comes at most this late, s."""
FAULTS = {
    0x01: "input voltage", 0x04: "overheating", 0x08: "encoder", 0x10: "electrical shock",
    0x20: "overload",
}  # fmt: skip


class DynamixelOptions(base.Options):
    """A Dynamixel of the X series.

    Attributes
    ----------
    port
        Such as ``/dev/ttyUSB0``.
    number
        Its ID.
    baud
        Of the line.
    diameter_mm
        Of the drum.
    gear
        Turns of the motor for one of the drum.
    reversed
        Whether the drum turns the other way.
    highest_mm_s
        Fastest speed that a plan may hold.
    """

    kind: Literal["dynamixel"] = "dynamixel"
    port: str
    number: Annotated[int, Field(ge=0, le=252)] = 1
    baud: int = 57_600
    diameter_mm: Annotated[float, Field(gt=0, lt=1e6)]
    gear: Annotated[float, Field(gt=0, lt=1e6)] = 1.0
    reversed: bool = False
    highest_mm_s: Annotated[float, Field(gt=0, lt=1e6)] = 200.0


class DynamixelDrive(base.Drive):
    """A Dynamixel in velocity mode; its bus watchdog stops it when it hears nothing more.

    Its speed is set in steps of 0.229 turns a minute, and is measured from its position.
    """

    Options = DynamixelOptions

    def __init__(self, options: DynamixelOptions) -> None:
        """Touch nothing yet."""
        self.options = options
        sign = -1 if options.reversed else 1
        self._mm_a_turn = sign * math.pi * options.diameter_mm / options.gear
        self._port: Any = None
        self._sent_s = 0.0
        self._speaking = threading.RLock()  # read in one thread, stopped from another

    def open(self) -> None:
        """Open the port, and set velocity mode.

        Raises
        ------
        InputError
            If dynamixel-sdk is missing, there is no such port, or no motor answers there.
        """
        sdk: Any = import_extra("dynamixel", "a Dynamixel", "dynamixel_sdk")
        where = f"Dynamixel {self.options.number} at {self.options.port}"
        port = sdk.PortHandler(self.options.port)
        port.baudrate = self.options.baud
        try:
            there = port.openPort()
        except Exception as error:
            raise base.not_free(where, "a serial port", error) from error
        if not there:
            raise InputError(
                f"{where}: expected a baud rate that the SDK knows, found {self.options.baud!s}"
            )
        self._port, self._packets = port, sdk.PacketHandler(2.0)
        self._measured = base.SpeedFromPosition()
        step_mm_s = abs(self._mm_a_turn) * TURNS_A_COUNT
        self.limits = DriveLimits(step_mm_s, self.options.highest_mm_s)
        atexit.register(self.stop)
        try:
            prepared = (WATCHDOG, 0), (TORQUE, 0), (OPERATING_MODE, BY_SPEED), (GOAL_SPEED, 0)
            for address, value in (*prepared, (TORQUE, 1)):
                self._write(address, value)
        except DeviceError as error:
            self.close()
            raise InputError(
                f"{where}: expected a motor of the X series that answers, found "
                f"{str(error).partition('(')[2][:-1]}; look at its power, ID and baud"
            ) from error

    def start(self, speed_mm_s: float) -> None:
        """Turn at the nearest speed that it has a step for."""
        self.require_speed(speed_mm_s)
        self._write(WATCHDOG, 0)  # clears one that has stopped the motor
        self._write(WATCHDOG, WATCHDOG_UNITS)
        self._write(GOAL_SPEED, round(speed_mm_s / self._mm_a_turn / TURNS_A_COUNT))

    def query(self) -> DriveState:
        """Return its state; hearing of it keeps its watchdog quiet."""
        for _ in range(TRIES):
            state = bytes(self._ask("readTxRx", ERRORS, STATE_BYTES) or ())
            if len(state) == STATE_BYTES:
                break
        else:
            raise self._lost("its answers are too short")
        time_s = (self._sent_s + time.monotonic()) / 2
        counts = int.from_bytes(state[-4:], "little", signed=True)
        position_mm = counts / TURN * self._mm_a_turn
        faults = [text for bit, text in FAULTS.items() if state[0] & bit]
        if state[WATCHDOG - ERRORS] == 0xFF:
            faults.append("watchdog: it heard nothing for 0.5 s")
        speed_mm_s = self._measured.read(time_s, position_mm)
        return DriveState(time_s, position_mm, speed_mm_s, ", ".join(faults) or None)

    def stop(self) -> None:
        """Stop the drum; never raises."""
        if self._port is None:
            return
        # Once more after the watchdog is cleared: once it has acted, no speed is taken. Its
        # port may be gone, and the SDK raises whatever comes.
        for address in (GOAL_SPEED, WATCHDOG, GOAL_SPEED):
            with suppress(Exception):
                self._write(address, 0)

    def close(self) -> None:
        """Stop the drum, release the motor and let the port go."""
        self.stop()
        atexit.unregister(self.stop)
        port = self._port
        if port is not None:
            with suppress(Exception):
                self._write(TORQUE, 0)
            self._port = None
            with suppress(Exception):
                port.closePort()

    def _write(self, address: int, value: int) -> None:
        verb = "write4ByteTxRx" if address == GOAL_SPEED else "write1ByteTxRx"
        self._ask(verb, address, value & 0xFFFFFFFF)

    def _ask(self, verb: str, address: int, value: int) -> list[int] | None:
        """Send a packet until its answer comes whole; return what was read, if anything."""
        with self._speaking:
            for _ in range(TRIES):
                if self._port is None:
                    raise self._lost("it is not open")
                self._port.is_using = False  # as the SDK leaves it where a signal interrupts it
                self._sent_s = time.monotonic()
                try:
                    *read, result, error = getattr(self._packets, verb)(
                        self._port, self.options.number, address, value
                    )
                except Exception as raised:
                    raise self._lost(reason_of(raised).lower()) from raised
                if result == 0:
                    if error & 0x7F:  # bit 7 is a hardware fault, which `read` names
                        raise self._lost(f"refused: {self._packets.getRxPacketError(error)}")
                    return read[0] if read else None
                # An answer that is only late must not answer the next question; the SDK empties
                # the port before each.
                time.sleep(LATE_S)
            raise self._lost(self._packets.getTxRxResult(result))

    def _lost(self, why: str) -> DeviceError:
        why = why.replace("[TxRxResult] ", "").replace("[RxPacketError] ", "").rstrip("!. ")
        return DeviceError(f"Dynamixel {self.options.number} at {self.options.port}: lost ({why})")
