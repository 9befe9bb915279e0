"""An encoding from outside the package, with an option of its own."""

from typing import Annotated

from pydantic import PositiveFloat
from sklearn.linear_model import LogisticRegression

from afferents import Model, SpatialEncoding
from afferents.encodings.base import Option


class Powers(SpatialEncoding):
    """Images to a power."""

    name = "powers"
    power: Annotated[PositiveFloat, Option("--power", "Exponent of every pixel.")] = 1.0

    def samples(self, response, kept, lookback):
        found = super().samples(response, kept, lookback)
        return found.copy(data=abs(found.values) ** self.power)


powers = Model(
    "powers", channel="ra1", encoding=Powers(), classifier=LogisticRegression(max_iter=50)
)
