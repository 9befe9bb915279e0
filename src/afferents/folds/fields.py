"""What numbers and names in our files may be."""

from typing import Annotated, Any

from pydantic import Field

from afferents.folds.held_out import NAME


def _counted(value: Any) -> Any:
    if not isinstance(value, int) or value < 0:
        raise ValueError("a count, true or false")
    return value


Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0)]
Amount = Annotated[float, Field(ge=0)]
Speed = Annotated[float, Field(gt=0)]
Key = Annotated[str, Field(pattern=r"^\d+(\.\d+)?(e[+-]?\d+)?$")]
"""A speed or a spacing as the key of a table: ``10``, ``12.5``."""
Shares = tuple[Share, Share]
GroupName = Annotated[str, Field(min_length=1)]
SplitName = Annotated[str, Field(pattern=f"^{NAME}$")]
Steady = tuple[Amount, Amount]
