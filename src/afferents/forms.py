"""Forms of documents, apart: to define one takes time that the help does not need."""

from typing import Annotated

from pydantic import BaseModel, Field

Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0)]
Amount = Annotated[float, Field(ge=0)]
Speed = Annotated[float, Field(gt=0)]
"""mm/s."""
Shares = tuple[Share, Share]
Steady = tuple[Amount, Amount]
"""Start and stop of the part of a recording that is used, s."""


class StrictForm(BaseModel, frozen=True, extra="forbid"):
    """Base of what people write: an unknown key is a slip of the pen."""
