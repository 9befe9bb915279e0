"""One of each that a researcher adds, written outside the package."""

from typing import Annotated

import numpy as np
from pydantic import PositiveFloat
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from torch import nn

from afferents import Channel, ImageEncoding, Model, SpatialEncoding, dims
from afferents.encodings.base import Option
from afferents.encodings.images import frame_extents
from afferents.encodings.samples import make_samples


class Height(Channel):
    """How far each marker stands above its place at rest, px."""

    name, title, made_of, lookback = "height", "height", dims.POSITION, 0

    def response(self, recording):
        up = recording.rest_position - recording.position
        return up.isel(space=1, drop=True).rename(self.name).assign_attrs(units="px")

    def step(self, now, before):
        return (now.rest - now.position)[:, 1]


class LastImage:
    """The mean over rows of every image as it comes."""

    def skip(self):
        pass

    def feed(self, image):
        return image.mean(axis=0)


class Columns(ImageEncoding):
    """The mean of every column of markers, frame by frame; of one frame in `every`."""

    name, sample_dims = "columns", (dims.COLUMN,)
    power: float = 1.0

    def samples(self, response, kept, lookback):
        start_s, stop_s = frame_extents(response.time.values, kept, lookback)
        columns = response.groupby(dims.COLUMN).mean().values[kept]
        values = (np.sign(columns) * np.abs(columns) ** self.power).astype(np.float32)
        return make_samples(values, self.sample_dims, start_s, stop_s, response.attrs)

    def stream(self, lookback):
        return LastImage()


class Powers(SpatialEncoding):
    """Images to a power, which is an option of the command line."""

    name = "powers"
    power: Annotated[PositiveFloat, Option("--power", "Exponent of every pixel.")] = 1.0

    def samples(self, response, kept, lookback):
        found = super().samples(response, kept, lookback)
        return found.copy(data=abs(found.values) ** self.power)


def perceptron(n_classes, sample_shape):
    """A small network of somebody's."""
    n = int(np.prod(sample_shape))
    return nn.Sequential(nn.Flatten(), nn.Linear(n, 16), nn.ReLU(), nn.Linear(16, n_classes))


class Rude(ClassifierMixin, BaseEstimator):
    """An estimator that does what it is told to do wrong."""

    def __init__(self, fault="raise"):
        self.fault = fault

    def fit(self, values, labels):
        if self.fault == "raise":
            raise ValueError("no, thank you")
        self.classes_ = np.unique(labels)
        return self

    def predict_proba(self, values):
        shares = np.full((len(values), len(self.classes_)), 1 / len(self.classes_))
        if self.fault == "sum":
            return 2 * shares
        if self.fault == "nan":
            return shares * np.nan
        return shares[:-1] if self.fault == "shape" else shares


class Nearest(ClassifierMixin, BaseEstimator):
    """An estimator of somebody's, that keeps a mean of each class."""

    def fit(self, values, labels):
        self.classes_ = np.unique(labels)
        self.means_ = np.stack([values[labels == c].mean(axis=0) for c in self.classes_])
        return self

    def predict_proba(self, values):
        near = np.exp(-((values[:, np.newaxis] - self.means_) ** 2).mean(axis=2))
        return near / near.sum(axis=1, keepdims=True)


def doubled(values):
    return 2 * values


def two_logits(n_classes, sample_shape):
    return nn.Sequential(nn.Flatten(), nn.LazyLinear(n_classes + 1))


logistic = Model(
    "logistic", channel="ra1", encoding="spatial", classifier=LogisticRegression(max_iter=50)
)
powers = Model(
    "powers", channel="ra1", encoding=Powers(), classifier=LogisticRegression(max_iter=50)
)
forest = Model(
    "forest",
    "some trees",
    channel="ra1",
    encoding="spatial",
    classifier=RandomForestClassifier(5, random_state=0),
)
nearest = Model("nearest", channel="sa1", encoding="spatial", classifier=Nearest())
scaled = Model(
    "scaled",
    channel="sa1",
    encoding="spatial",
    classifier=make_pipeline(StandardScaler(), Nearest()),
)
with_function = Model(
    "with-function",
    channel="sa1",
    encoding="spatial",
    classifier=make_pipeline(FunctionTransformer(doubled), Nearest()),
)
mlp = Model("mlp", "a perceptron", channel="sa1", encoding="spatial", classifier=perceptron)
mine = Model("all-mine", channel=Height(), encoding=Columns(), classifier=perceptron)
second = Model("second-net", channel="sa1", encoding="spatial", classifier="spatial-net")
raises = Model("raises", channel="ra1", encoding="spatial", classifier=Rude())
sums = Model("sums", channel="ra1", encoding="spatial", classifier=Rude("sum"))
nans = Model("nans", channel="ra1", encoding="spatial", classifier=Rude("nan"))
shapes = Model("shapes", channel="ra1", encoding="spatial", classifier=Rude("shape"))
misshapen = Model("misshapen", channel="ra1", encoding="spatial", classifier=two_logits)
taken = Model("ra-se", channel="ra1", encoding="spatial", classifier=perceptron)
no_model = 3
