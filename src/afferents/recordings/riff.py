"""What a wav file's own header declares; libsndfile counts what is there, whatever that says."""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

_UNKNOWN_BYTES = frozenset({0, 0xFFFFFFFF, 0xFFFFFFFFFFFFFFFF})
"""Lengths that a recorder writes into a wav whose end it does not know yet."""
_IN_DS64 = 0xFFFFFFFF
"""Length of the data in a file of more than 4 GB: it stands in the chunk `ds64`, in 64 bits."""
_PLAIN = frozenset({0x0001, 0x0003, 0x0006, 0x0007, 0xFFFE})
"""Formats that write each sample by itself: integers, float, A-law, mu-law, extensible. In the
others a block holds many samples."""
_MOST_CHUNKS = 1000
"""No recorder writes more; noise with a wav's first bytes would be walked for long."""


def declared_samples(path: Path) -> int | None:
    """Return the samples a channel that a wav declares.

    Returns
    -------
    None where that can't be told: no wav, no data in it, a compressed format, or a length that the
    recorder left open.
    """
    with path.open("rb") as file:
        declared = _declared(file)
    if declared is None:
        return None
    data_bytes, block_align = declared
    return data_bytes // block_align if block_align else None


def _declared(file: BinaryIO) -> tuple[int, int] | None:
    """Return bytes of data and bytes of a sample in all channels; None where not declared."""
    head = file.read(12)
    if head[:4] not in (b"RIFF", b"RIFX", b"RF64", b"BW64") or head[8:] != b"WAVE":
        return None
    order = ">" if head[:4] == b"RIFX" else "<"
    long_bytes: int | None = None
    block_align = 0
    for name, n_bytes in _chunks(file, order):
        if name == b"ds64":
            sizes = file.read(16)
            long_bytes = struct.unpack("<QQ", sizes)[1] if len(sizes) == 16 else None
        elif name == b"fmt ":
            fields = file.read(16)
            if len(fields) < 16 or struct.unpack(f"{order}H", fields[:2])[0] not in _PLAIN:
                return None
            block_align = struct.unpack(f"{order}H", fields[12:14])[0]
        elif name == b"data":
            if n_bytes == _IN_DS64 and long_bytes is not None:
                n_bytes = long_bytes
            return None if n_bytes in _UNKNOWN_BYTES else (n_bytes, block_align)
    return None


def _chunks(file: BinaryIO, order: str) -> Iterator[tuple[bytes, int]]:
    """Yield name and length of each chunk, the file at its content."""
    for _ in range(_MOST_CHUNKS):
        head = file.read(8)
        if len(head) < 8:
            return
        name, n_bytes = struct.unpack(f"{order}4sI", head)
        content = file.tell()
        yield name, n_bytes
        file.seek(content + n_bytes + n_bytes % 2, os.SEEK_SET)
