"""A serial line: a text sent, a text answered, asked again if bytes were lost."""

import binascii
import re
import time
from collections.abc import Callable
from functools import reduce
from operator import xor
from typing import Any

from afferents.core.errors import InputError, reason_of
from afferents.core.extras import import_extra
from afferents.devices.base import DeviceError

ANSWER_S = 0.2
"""An answer takes some ms; of a USB adapter up to 16 more."""
TRIES = 5
"""A line is lost at most so many times in a row before the drive is given up."""


CHECKSUMS: dict[str, Callable[[bytes], int]] = {
    "xor": lambda data: reduce(xor, data, 0),
    "crc16": lambda data: binascii.crc_hqx(data, 0),
}
"""The number after the ``*`` of a line, by its kind. Two like bytes that are lost leave the XOR as
it was, so that 36.4517 and 49.584 may come as 36.517 and 49.58; CRC-16/XMODEM tells them."""


def framed(text: str, checksum: str) -> bytes:
    """Return a line as it is sent: with its checksum, if it has one, and its end."""
    data = text.encode("ascii")
    if checksum in CHECKSUMS:
        data += b"*%d" % CHECKSUMS[checksum](data)
    return data + b"\n"


def unframed(line: bytes, checksum: str) -> str | None:
    """Return the text of a line that came; None if bytes of it were lost."""
    data = line.strip()
    if checksum in CHECKSUMS:
        data, star, number = data.rpartition(b"*")
        if not star or number != b"%d" % CHECKSUMS[checksum](data):
            return None
    return data.decode("ascii", "replace")


class Line:
    """An open serial port that speaks lines.

    Parameters
    ----------
    port
        Such as ``/dev/ttyACM0`` or ``COM3``.
    baud
        Of the port.
    checksum
        ``crc16``, ``xor`` or ``none``.

    Attributes
    ----------
    again
        How often a line had to be sent again.

    Raises
    ------
    InputError
        If there is no such port, or it is in use.
    """

    def __init__(self, port: str, baud: int, checksum: str) -> None:
        """Open it."""
        serial: Any = import_extra("record", "a serial drive", "serial")
        self.port, self._checksum = port, checksum
        self._broken = (serial.SerialException, OSError)
        self.again = 0
        try:
            self._serial = serial.Serial(port, baud, timeout=0.02, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise InputError(
                f"drive at {port}", "a serial port that is plugged in and free",
                reason_of(error).lower(), "'afferents devices' lists what there is",
            ) from error  # fmt: skip

    @property
    def fd(self) -> int | None:
        """Number of the open port, for another process; None where ports have none."""
        return self._serial.fileno() if hasattr(self._serial, "fd") else None

    def close(self) -> None:
        """Close it; twice is no error."""
        self._serial.close()

    def tell(self, text: str) -> None:
        """Send a line.

        Raises
        ------
        DeviceError
            If the port is gone.
        """
        try:
            self._serial.write(framed(text, self._checksum))
        except self._broken as error:
            raise self._lost(reason_of(error).lower()) from error

    def ask(self, text: str, pattern: str, tries: int = TRIES) -> "re.Match[str]":
        """Send a line until its answer comes whole.

        Raises
        ------
        DeviceError
            If the port is gone, or no such answer comes.
        """
        for attempt in range(tries):
            self.again += attempt > 0
            try:
                self._serial.reset_input_buffer()
            except Exception as error:  # termios.error is no OSError
                raise self._lost(reason_of(error).lower()) from error
            self.tell(text)
            found = self._answer(pattern, time.monotonic() + ANSWER_S)
            if found is not None:
                return found
        raise self._lost(f"no answer to '{text}'")

    def _answer(self, pattern: str, until_s: float) -> "re.Match[str] | None":
        line = b""
        while time.monotonic() < until_s:
            try:
                line += self._serial.readline()
            except self._broken as error:
                raise self._lost(reason_of(error).lower()) from error
            if not line.endswith(b"\n"):
                continue
            text = unframed(line, self._checksum)
            found = None if text is None else re.search(pattern, text)
            if found is not None:
                return found
            line = b""
        return None

    def _lost(self, why: str) -> DeviceError:
        return DeviceError(
            f"drive at {self.port}: lost ({why}); see that the drum stands still, then plug it in"
        )
