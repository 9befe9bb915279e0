"""A Dynamixel of the X series (protocol 2.0), through dynamixel-sdk."""

import atexit
import math
import threading
import time
from contextlib import suppress
from typing import Annotated, Any, Literal

from pydantic import Field

from afferents.errors import InputError, reason_of
from afferents.lab.devices.base import (
    DeviceError,
    Drive,
    DriveLimits,
    DriveState,
    Options,
    not_free,
)
from afferents.lab.devices.drives.serial_drive import SpeedFromPosition
from afferents.plugins import import_extra

# Addresses in the control table of the X series (emanual.robotis.com).
OPERATING_MODE, TORQUE, ERRORS, WATCHDOG = 11, 64, 70, 98
GOAL_SPEED, POSITION = 104, 132
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
"""An answer comes at most so late."""
FAULTS = {
    0x01: "input voltage", 0x04: "overheating", 0x08: "encoder", 0x10: "electrical shock",
    0x20: "overload",
}  # fmt: skip


class DynamixelOptions(Options):
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
        Whether the drum is to turn the other way.
    highest_mm_s
        Fastest speed asked for.
    """

    kind: Literal["dynamixel"] = "dynamixel"
    port: str
    number: Annotated[int, Field(ge=0, le=252)] = 1
    baud: int = 57_600
    diameter_mm: Annotated[float, Field(gt=0, lt=1e6)]
    gear: Annotated[float, Field(gt=0, lt=1e6)] = 1.0
    reversed: bool = False
    highest_mm_s: Annotated[float, Field(gt=0, lt=1e6)] = 200.0


class DynamixelDrive(Drive):
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
        self._asked_s = 0.0
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
            raise not_free(where, "a serial port", error) from error
        if not there:
            raise InputError(
                f"{where}: expected a baud rate that the SDK knows, found {self.options.baud!s}"
            )
        self._port, self._packets = port, sdk.PacketHandler(2.0)
        self._measured = SpeedFromPosition()
        step_mm_s = abs(self._mm_a_turn) * TURNS_A_COUNT
        self.limits = DriveLimits(step_mm_s, self.options.highest_mm_s)
        atexit.register(self.stop)
        try:
            for address, value in ((WATCHDOG, 0), (TORQUE, 0), (OPERATING_MODE, BY_SPEED)):
                self._write1(address, value)
            self._write4(GOAL_SPEED, 0)
            self._write1(TORQUE, 1)
        except DeviceError as error:
            self.close()
            raise InputError(
                f"{where}: expected a motor of the X series that answers, found "
                f"{str(error).partition('(')[2][:-1]}; look at its power, ID and baud"
            ) from error

    def start(self, speed_mm_s: float) -> None:
        """Turn at the nearest speed that it has a step for."""
        self.require_speed(speed_mm_s)
        self._write1(WATCHDOG, 0)  # clears one that has bitten
        self._write1(WATCHDOG, WATCHDOG_UNITS)
        self._write4(GOAL_SPEED, round(speed_mm_s / self._mm_a_turn / TURNS_A_COUNT))

    def query(self) -> DriveState:
        """Return its state; hearing of it keeps its watchdog quiet."""
        state = self._state()
        time_s = (self._asked_s + time.monotonic()) / 2
        counts = int.from_bytes(state[-4:], "little", signed=True)
        position_mm = counts / TURN * self._mm_a_turn
        said = [text for bit, text in FAULTS.items() if state[0] & bit]
        bitten = state[WATCHDOG - ERRORS] == 0xFF
        said += ["watchdog: it heard nothing for 0.5 s"] if bitten else []
        speed_mm_s = self._measured.read(time_s, position_mm)
        return DriveState(time_s, position_mm, speed_mm_s, ", ".join(said) or None)

    def stop(self) -> None:
        """Stop the drum; never raises."""
        if self._port is None:
            return
        # Once more after the watchdog is cleared, since one that has bitten takes no speed. Its
        # port may be gone, and the SDK raises whatever comes.
        for write, address in (
            (self._write4, GOAL_SPEED), (self._write1, WATCHDOG), (self._write4, GOAL_SPEED)
        ):  # fmt: skip
            with suppress(Exception):
                write(address, 0)

    def close(self) -> None:
        """Stop the drum, release the motor and let the port go."""
        self.stop()
        atexit.unregister(self.stop)
        port = self._port
        if port is not None:
            with suppress(Exception):
                self._write1(TORQUE, 0)
            self._port = None
            with suppress(Exception):
                port.closePort()

    def _write1(self, address: int, value: int) -> None:
        self._ask("write1ByteTxRx", address, value)

    def _write4(self, address: int, value: int) -> None:
        self._ask("write4ByteTxRx", address, value & 0xFFFFFFFF)

    def _state(self) -> bytes:
        """Return the table from `ERRORS` to the position, in one answer."""
        length = POSITION + 4 - ERRORS
        for _ in range(TRIES):
            data = bytes(self._ask("readTxRx", ERRORS, length) or ())
            if len(data) == length:
                return data
        raise self._lost("its answers are too short")

    def _ask(self, verb: str, address: int, value: int) -> list[int] | None:
        """Send a packet until its answer comes whole; return what was read, if anything."""
        with self._speaking:
            for _ in range(TRIES):
                if self._port is None:
                    raise self._lost("it is not open")
                self._port.is_using = False  # as the SDK leaves it where a signal interrupts it
                self._asked_s = time.monotonic()
                try:
                    *read, result, error = getattr(self._packets, verb)(
                        self._port, self.options.number, address, value
                    )
                except Exception as raised:
                    raise self._lost(reason_of(raised).lower()) from raised
                if result == 0:
                    if error & 0x7F:  # bit 7 tells of a hardware fault, which `read` names
                        raise self._lost(f"refused: {self._packets.getRxPacketError(error)}")
                    return read[0] if read else None
                # An answer that is only late must not be taken for that of the next question;
                # the SDK empties the port before each.
                time.sleep(LATE_S)
            raise self._lost(self._packets.getTxRxResult(result))

    def _lost(self, why: str) -> DeviceError:
        why = why.replace("[TxRxResult] ", "").replace("[RxPacketError] ", "").rstrip("!. ")
        return DeviceError(f"Dynamixel {self.options.number} at {self.options.port}: lost ({why})")
