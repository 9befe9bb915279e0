"""What may be said of a device in a plan: each kind has a form of its own."""

from pydantic import BaseModel, ConfigDict


class Options(BaseModel):
    """Base of the options of all kinds: frozen, and no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")
