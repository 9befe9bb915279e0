"""The models: the six of the paper's Table 1, and our own beyond it. A model is a row."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, Literal

from afferents.dims import RA1, RA1_VECTOR, RA2, SA1, SA1_LOCAL, SA1_VECTOR, SHEAR
from afferents.errors import InputError
from afferents.plugins import named

MODEL_NAME = r"[^./\\,:\s][^/\\,:\s]*"
"""A model's folder is named by it."""
SpeedFrom = Literal["none", "given", "measured"]
"""What tells a model the sliding speed of a sample that it names: the fingertip measures it."""


@dataclass(frozen=True)
class Model:
    """A way from a channel to textures: what is measured, how it is encoded, and what learns it.

    Each of the three is a name, or an object of your own:

    >>> from sklearn.linear_model import LogisticRegression
    >>> mine = Model(
    ...     "logistic", channel="ra1", encoding="spatial", classifier=LogisticRegression()
    ... )
    >>> mine.title
    'logistic'

    Attributes
    ----------
    name
        In commands, files and code.
    title
        In tables and figures; the name, if none is given.
    channel
        A name in `CHANNELS`, or a `Channel`; of a fusion that of its first part.
    encoding
        A name in `ENCODINGS`, or an `Encoding`.
    classifier
        A name in `CLASSIFIERS`; a scikit-learn estimator with `predict_proba`; or a function
        from the number of textures and the shape of a sample to a torch module that gives logits.
    recipe
        Of networks, how they are trained: a name in `RECIPES`; none for the classifier's.
    stretched
        Whether copies of the training samples stand in for speeds that were never seen: spectra
        stretched in frequency (section 2.4.3), or images gone through faster and slower (ours).
    speed_from
        Where the speed of a test sample comes from: `none` needs none, `given` is told it (by a
        robot), `measured` estimates it from the fingertip's own channels.
    parts
        Names of the models that ``late-fusion`` joins, each solved at once; its decisions are timed
        by the first.
    variant_of
        Name of the model that it is, but for the length of its windows; none of most.
    """

    name: str
    title: str = ""
    _: KW_ONLY
    channel: Any
    encoding: Any
    classifier: Any
    recipe: str = ""
    stretched: bool = False
    speed_from: SpeedFrom = "none"
    parts: tuple[str, ...] = ()
    variant_of: str = ""

    def __post_init__(self) -> None:
        """Refuse names that are no names of folders, and take the name for a title."""
        if not re.fullmatch(MODEL_NAME, self.name):
            raise InputError(
                f"a model's name: expected letters, digits and hyphens, found {self.name!r}"
            )
        if not self.title:
            object.__setattr__(self, "title", self.name)


def _row(name: str, title: str, channel: str, encoding: str, classifier: str, **more: Any) -> Model:
    return Model(name, title, channel=channel, encoding=encoding, classifier=classifier, **more)


_PAPER = (
    _row("sa-se", "SA-SE", SA1, "spatial", "spatial-net"),
    _row("ra-se", "RA-SE", RA1, "spatial", "spatial-net"),
    _row("sa-ste", "SA-STE", SA1, "spatiotemporal", "cnn-lstm"),
    _row("ra-ste", "RA-STE", RA1, "spatiotemporal", "cnn-lstm"),
    _row("vib-te", "vib-TE", RA2, "spectral", "vibration-net"),
    _row("vib-te-aug", "vib-TE augmented", RA2, "spectral", "vibration-net", stretched=True),
)
_OURS = (
    _row("ra-se-aug", "RA-SE augmented", RA1, "spatial", "spatial-net", stretched=True),
    _row("sa-ste-aug", "SA-STE augmented", SA1, "spatiotemporal", "cnn-lstm", stretched=True),
    _row("ra-ste-aug", "RA-STE augmented", RA1, "spatiotemporal", "cnn-lstm", stretched=True),
    _row("ridge-te", "ridge on log spectra", RA2, "orders", "ridge"),
    _row("order-te", "orders", RA2, "orders", "orders"),
    _row(
        "order-te-measured", "orders, speed measured", RA2, "orders", "orders",
        speed_from="measured",
    ),
    _row(
        "order-te-speed-known", "orders, speed known", RA2, "orders", "orders",
        speed_from="given",
    ),
    _row("sa-wave", "SA-I waves", SA1, "wavenumbers", "ridge"),
    _row("sa-wave-vector", "SA-I vector waves", SA1_VECTOR, "wavenumbers", "ridge"),
    _row("ra-wave", "RA-I waves", RA1, "wavenumbers", "ridge"),
    _row("ra-wave-vector", "RA-I vector waves", RA1_VECTOR, "wavenumbers", "ridge"),
    _row("shear", "global shear", SHEAR, "moments", "discriminant"),
    _row("sa-local", "SA-I vector without shear", SA1_LOCAL, "moments", "discriminant"),
    _row("sa-wave-local", "SA-I vector waves without shear", SA1_LOCAL, "wavenumbers", "ridge"),
    _row(
        "fusion", "fusion, late", RA2, "orders", "late-fusion",
        parts=("order-te", "sa-wave-vector"),
    ),
    _row(
        "fusion-speed-known", "fusion, late, speed known", RA2, "orders", "late-fusion",
        speed_from="given", parts=("order-te-speed-known", "sa-wave-vector"),
    ),
)  # fmt: skip

TABLE1: dict[str, Model] = {model.name: model for model in _PAPER}
"""The paper's."""
BEYOND: dict[str, Model] = {model.name: model for model in _OURS}
"""Our own: docs/models.md describes them."""
MODELS: dict[str, Model] = TABLE1 | BEYOND

BEST = ("sa-wave-vector", "vib-te-aug")
"""What is recommended: the first that the data support, to be trained and run live.

Picked once, on sessions of the simulated rig (docs/results.md has the rule); never by scores
on the data at hand.
"""
OF_CELLS = "sa-wave"
"""What stands in for them where there are cells, which have no displacement, and no sound."""


def pick_own(models: Sequence[Model]) -> list[Model]:
    """Return those that are none of the package's.

    Raises
    ------
    InputError
        If one has the name of a model of the package, or two have one name: a name stands for one
        model.
    """
    own = [model for model in models if MODELS.get(model.name) is not model]
    for model in own:
        if model.name in MODELS:
            expected = "a name that no model of this package has"
            raise InputError(f"a model's name: expected {expected}, found '{model.name}'")
        if any(other.name == model.name and other is not model for other in own):
            raise InputError(
                f"a model's name: expected one model of each, found several '{model.name}'"
            )
    return own


BASELINES = {name: f"afferents.models.baselines:{name}" for name in ("chance", "nearest")}
"""Models to compare with, by name; where they are, as they are made of scikit-learn."""


def choose_models(wanted: str | Model | Sequence[str | Model]) -> list[Model]:
    """Return the models wanted: those of the tables in their order, then the user's own.

    Parameters
    ----------
    wanted
        Models, or names separated by commas: ``all`` for the six of Table 1; ``chance`` and
        ``nearest`` to compare with;
        ``package.module:NAME`` or ``file.py:NAME`` for a `Model` of the user's; nothing for
        ``best``, which depends on the data.

    Raises
    ------
    InputError
        If a name is unknown, or what is imported is no model.
    """
    names = [name for name in list_names(wanted) if name != "best"]
    chosen = [one for name in names for one in (TABLE1 if name == "all" else [name])]
    chosen = [BASELINES.get(name, name) for name in chosen]
    for name in chosen:
        if ":" not in name and name not in MODELS:
            do = f"; name what is in the file, as in {name}:NAME" if name.endswith(".py") else ""
            raise InputError(
                f"--models: expected 'all', 'best', some of {', '.join([*MODELS, *BASELINES])}, "
                f"or FILE.py:NAME, found '{name}'{do}"
            )
    own = []
    for where in dict.fromkeys(name for name in chosen if ":" in name):
        found = named(where)
        if not isinstance(found, Model):
            raise InputError(
                f"--models: expected an afferents.Model at {where}, found {type(found).__name__}"
            )
        own.append(found)
    own += [one for one in list_wanted(wanted) if isinstance(one, Model)]
    return [model for name, model in MODELS.items() if name in chosen] + own


def list_names(wanted: str | Model | Sequence[str | Model]) -> list[str]:
    """Return the names among the models wanted, ``all`` and ``best`` with them."""
    texts = [one for one in list_wanted(wanted) if isinstance(one, str)]
    return [name.strip() for text in texts for name in text.split(",")]


def list_wanted(wanted: str | Model | Sequence[str | Model]) -> Sequence[str | Model]:
    """Return what names models, texts and objects, as a list."""
    found = (
        list(wanted) if isinstance(wanted, Iterable) and not isinstance(wanted, str) else [wanted]
    )
    for one in found:
        if not isinstance(one, str | Model):
            raise InputError(f"--models: expected names, or an afferents.Model, found {one!r}")
    return found
