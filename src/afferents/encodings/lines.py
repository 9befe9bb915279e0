"""A machine's lines in spectra: which frequencies they mask, and what stands for them."""

import re
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveFloat, model_validator

from afferents.errors import InputError

HARMONICS = 8
_WIDTH = 0.01
"""A line that follows the speed is as wide as the speed is uneven: this share of its frequency."""


class Lines(BaseModel):
    """Lines to be masked, with their harmonics.

    Attributes
    ----------
    hertz
        Fundamentals that stand still, such as 50.
    per_mm
        Fundamentals that follow the sliding speed, cycles per mm, such as a motor that turns 14.4
        times for 251 mm: 0.0573.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hertz: tuple[PositiveFloat, ...] = ()
    per_mm: tuple[PositiveFloat, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _of_text(cls, given: Any) -> Any:
        """Take text as well, so that an encoding's `mask` may be given as it is typed."""
        return cls.parse(given).model_dump() if isinstance(given, str) else given

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read an option such as ``50Hz,0.0573/mm``.

        Raises
        ------
        InputError
            If a part is neither.
        """
        found: dict[str, list[float]] = {"Hz": [], "/mm": []}
        for part in text.split(","):
            line = re.fullmatch(r"\s*(\d*\.?\d+)\s*(Hz|/mm)\s*", part)
            if line is None or float(line[1]) == 0:
                raise InputError(f"--mask: expected lines as in 50Hz,0.0573/mm, found '{part}'")
            found[line[2]].append(float(line[1]))
        return cls(hertz=tuple(found["Hz"]), per_mm=tuple(found["/mm"]))

    def masks(
        self, frequency: NDArray[np.float64], speed_mm_s: float, resolution_hz: float
    ) -> NDArray[np.bool_]:
        """Return which frequencies, Hz, lie on a line or a harmonic of it."""
        fundamentals = [(f, 0.0) for f in self.hertz]
        fundamentals += [(k * speed_mm_s, _WIDTH) for k in self.per_mm]
        masked = np.zeros(len(frequency), dtype=bool)
        for fundamental, width in fundamentals:
            for line in fundamental * np.arange(1, HARMONICS + 1):
                masked |= np.abs(frequency - line) <= max(resolution_hz, width * line)
        return masked


def bridge(
    power: NDArray[np.float64], frequency: NDArray[np.float64], masked: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return spectra (..., frequency), above 0, with masked stretches replaced by straight lines.

    Straight in the logarithm, from edge to edge: nothing of the masked values is left, and nothing
    at all where all are masked.
    """
    if not masked.any():
        return power
    if masked.all():
        return np.ones_like(power)
    kept = ~masked
    logs = np.log(power)
    flat = logs.reshape(-1, logs.shape[-1])
    for row in flat:
        row[masked] = np.interp(frequency[masked], frequency[kept], row[kept])
    return np.exp(logs)
