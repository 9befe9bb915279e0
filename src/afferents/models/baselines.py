"""Models to compare with: ``--models chance,nearest``."""

from sklearn.dummy import DummyClassifier
from sklearn.neighbors import KNeighborsClassifier

from afferents.models.model import Model

chance = Model(
    "chance",
    "chance",
    channel="ra2",
    encoding="orders",
    classifier=DummyClassifier(strategy="prior"),
)
nearest = Model(
    "nearest", "nearest neighbour on log spectra",
    channel="ra2", encoding="orders", classifier=KNeighborsClassifier(1),
)  # fmt: skip
