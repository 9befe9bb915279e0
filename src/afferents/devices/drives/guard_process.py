"""The process that `guard` starts: writes a stop to the drive if it hears nothing more."""

import os
import select
import sys


def main(fd: int, patience_s: float, stop: bytes) -> None:
    """Heed stdin: ``1`` while the drum turns, ``0`` when it stands; its end is the end of all."""
    turning = False
    while True:
        there, _, _ = select.select([0], [], [], patience_s if turning else None)
        said = os.read(0, 4096) if there else b""
        if turning and not said:
            for _ in range(3):
                try:
                    os.write(fd, stop)
                except OSError:
                    break
                select.select([], [], [], 0.05)
        if there and not said:
            return
        turning = said.endswith(b"1") if there else False


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]), bytes.fromhex(sys.argv[3]))
