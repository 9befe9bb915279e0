"""The base of what people write, apart: to define a form takes time that the help does not need."""

from pydantic import BaseModel


class StrictForm(BaseModel, frozen=True, extra="forbid"):
    """Base of what people write: an unknown key is a slip of the pen."""
