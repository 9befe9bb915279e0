"""What disturbed recordings, as results and cards keep it."""

from typing import Annotated

from pydantic import Field

Spoilt = dict[str, Annotated[float, Field(ge=0)]]
"""Amounts by name, those that are not 0; see `evaluation.disturbance.Disturbance`."""


def spoilt_by(disturbance: Spoilt) -> str:
    """Return a disturbance, as results and cards keep it, in the words of `--disturb`."""
    return ",".join(f"{name}={value:g}" for name, value in disturbance.items())
