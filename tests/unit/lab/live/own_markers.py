"""Models of a user's own that learn from single markers, not from images."""

from sklearn.linear_model import LogisticRegression
from torch import nn

from afferents import Model


def linear(n_classes, sample_shape):
    components, markers = sample_shape
    return nn.Sequential(nn.Flatten(), nn.Linear(components * markers, n_classes))


network = Model("own-linear", channel="ra1_vector", encoding="markers", classifier=linear)
logistic = Model(
    "own-logistic",
    channel="sa1",
    encoding="markers",
    classifier=LogisticRegression(max_iter=50, tol=0.1),
)
