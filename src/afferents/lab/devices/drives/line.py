"""A serial port that speaks lines, with checksums where the drive has them."""

import binascii
import re
import time
from collections.abc import Callable
from functools import reduce
from operator import xor
from typing import Any

from afferents.errors import reason_of
from afferents.lab.devices.base import DeviceError, not_free
from afferents.plugins import import_extra

ANSWER_S = 0.2
"""An answer takes some ms; of a USB adapter up to 16 more."""
TRIES = 5
"""A drive is given up when its answer is lost this many times in a row."""


CHECKSUMS: dict[str, Callable[[bytes], int]] = {
    "xor": lambda data: reduce(xor, data, 0),
    "crc16": lambda data: binascii.crc_hqx(data, 0),
}
"""The number after the ``*`` of a line, by its kind. Two like bytes that are lost leave the XOR as
it was, so that 36.4517 and 49.584 may come as 36.517 and 49.58; CRC-16/XMODEM finds it."""


def frame_line(text: str, checksum: str) -> bytes:
    """Return a line as it is sent: with its checksum, if it has one, and its end."""
    data = text.encode("ascii")
    if checksum in CHECKSUMS:
        data += b"*%d" % CHECKSUMS[checksum](data)
    return data + b"\n"


def unframe_line(line: bytes, checksum: str) -> str | None:
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

    Raises
    ------
    InputError
        If there is no such port, or it is in use.
    """

    def __init__(self, port: str, baud: int, checksum: str) -> None:
        """Open it."""
        serial: Any = import_extra("lab", "a serial drive", "serial")
        self.port, self._checksum, self.sent_s = port, checksum, 0.0
        self._broken = (serial.SerialException, OSError)
        try:
            self._serial = serial.Serial(port, baud, timeout=0.02, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise not_free(f"drive at {port}", "a serial port", error) from error

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
            self._serial.write(frame_line(text, self._checksum))
        except self._broken as error:
            raise self._lost(reason_of(error).lower()) from error

    def ask(self, text: str, pattern: re.Pattern[str], tries: int = TRIES) -> "re.Match[str]":
        """Send a line until its answer comes whole; `sent_s` is when it was sent last.

        Raises
        ------
        DeviceError
            If the port is gone, or no such answer comes.
        """
        for _ in range(tries):
            try:
                self._serial.reset_input_buffer()
            except Exception as error:  # termios.error is no OSError
                raise self._lost(reason_of(error).lower()) from error
            self.sent_s, received = time.monotonic(), b""
            self.tell(text)
            until_s = time.monotonic() + ANSWER_S
            while time.monotonic() < until_s:
                try:
                    received += self._serial.readline()
                except self._broken as error:
                    raise self._lost(reason_of(error).lower()) from error
                if received.endswith(b"\n"):
                    answer = unframe_line(received, self._checksum)
                    if answer is not None and (found := pattern.search(answer)):
                        return found
                    received = b""
        raise self._lost(f"no answer to '{text}'")

    def _lost(self, why: str) -> DeviceError:
        return DeviceError(
            f"drive at {self.port}: lost ({why}); see that the drum stands still, then plug it in"
        )
