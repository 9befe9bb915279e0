"""What can be chosen of an evaluation or a training: one list for Python, shell, files and report.

A field here is an option everywhere: `afferents.evaluate(..., split="trial")`, ``evaluate --split
trial``, ``split = "trial"`` in a file that ``--config`` names, and the line of the report with what
was chosen. Options of encodings, such as ``frames=20``, stand next to the fields.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Literal, Self

import pydantic

from afferents import choices, documents
from afferents.encodings.settings import options as encoding_options
from afferents.errors import InputError, raised
from afferents.folds.ablation import Ablation, parse_speeds
from afferents.folds.bands import name_bands
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import SPEED, Group, Split, condition_text, split_named
from afferents.folds.protocol import PROTOCOLS, Protocol
from afferents.models import config, model
from afferents.store.trimming import Steady, parse_steady, written

_Seed = Annotated[int, pydantic.Field(ge=0, le=choices.LARGEST_SEED)]
IN_SUMMARY = frozenset({
    "models", "protocol", "preset", "cut", "seed", "seeds", "keep_going", "workers", "cluster",
    "device", "precision",
})  # fmt: skip
"""What a summary has entries of its own for, and what changes no number."""


def _as_list(given: Any) -> Any:
    """Return a number as a list of one, as a file may give it; all else as it is."""
    return [given] if isinstance(given, int | float) else given


def _read_names(given: str | float | Iterable[Any]) -> tuple[str, ...]:
    parts = given.split(",") if isinstance(given, str) else _as_list(given)
    return tuple(str(part).strip() for part in parts)


class TrainingOptions(pydantic.BaseModel):
    """What can be chosen of every training; `EvaluationOptions` has more.

    Raises
    ------
    InputError
        When it is made of something that makes no sense, naming the option.
    """

    model_config = pydantic.ConfigDict(
        frozen=True, extra="allow", arbitrary_types_allowed=True, use_attribute_docstrings=True
    )

    preset: choices.Preset = choices.PRESET_ASKED
    """How networks are trained: as in the 'paper' (days for Table 1), 'fast', or 'quick', to see
    that it runs."""
    recipe: Annotated[
        config.Hyperparameters, pydantic.PlainSerializer(lambda r: r.source or r.changed)
    ] = pydantic.Field(default_factory=config.Hyperparameters)
    """TOML file of hyperparameters that are not to be the preset's: learning_rate, max_epochs,
    dropout and others, for all networks or in a table for each."""
    cut: choices.Cut = "all"
    """Part of each recording to use: 'all' at constant speed, or the 'published' cut."""
    split: str = SPEED.name
    """What is held out in turn: 'speed' (with --bands a band of speeds), a condition of recordings
    such as 'trial', two at once ('speed,force'), or an 'angle' of the drum.

    Of two at once, what is learnt from shares neither with what is tested. Of angles one of five is
    held out, with 'angle-8' one of eight.
    """
    bands: str = ""
    """Hold out bands of speed (mm/s) or of force (N) in turn, where they change within recordings:
    edges 20,40,60, or 4 for as many with equally long parts."""
    steady: Annotated[Steady | None, pydantic.PlainSerializer(lambda s: s and written(s))] = None
    """Use this part of every recording, START:STOP in s, as in 0.2:2.8 (default: what session.json
    says, else all but 2.5 s at each end)."""
    disturb_training: Annotated[
        Corruption,
        pydantic.BeforeValidator(lambda given: Corruption.of(given, "--disturb-training")),
    ] = Corruption()
    """Corrupt the recordings that are learnt from: markers=0.1 (noise, px), sound=-20dB (noise, by
    the sound's own level), frames=0.05 and lost=0.1 (share of the frames dropped, of the markers
    lost), seed=0."""
    statistics: choices.Statistics = "warmed-up"
    """Running statistics of batch normalisation: 'warmed-up' as plain averages, or from 0 and 1 as
    'keras' keeps them (matters where an epoch has few steps)."""
    device: choices.Device = "auto"
    """Where networks are trained; 'auto' takes a GPU if there is one."""
    precision: choices.Precision = "auto"
    """Number format; 'auto' is bfloat16 where the processor supports it."""

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _in_one_sentence(cls, given: Any, validate: Callable[[Any], Self]) -> Self:
        try:
            chosen = {name: v for name, v in dict(given).items() if v is not None}
            if bands := chosen.pop("bands", ""):  # what is held out has one name
                if not isinstance(bands, str):
                    bands = ",".join(f"{edge:g}" for edge in _as_list(bands))
                chosen["split"] = name_bands(chosen.get("split", SPEED.name), bands)
            return validate(chosen)
        except pydantic.ValidationError as error:
            fault = error.errors()[0]
            raise InputError(
                f"{choices.flag_of(str(fault['loc'][0]))}: expected "
                f"{documents.reason_in(fault)}, found {fault['input']!r}"
            ) from None
        except (AttributeError, TypeError) as error:
            raise InputError(
                f"the options: expected values of the kind that each takes, found {raised(error)}"
            ) from error

    @pydantic.field_validator("recipe", mode="before")
    @classmethod
    def _read_recipe(cls, given: Any, info: pydantic.ValidationInfo) -> Any:
        if isinstance(given, config.Hyperparameters):
            return given
        return config.Hyperparameters.of(given, info.data.get("preset", choices.PRESET_ASKED))

    @pydantic.field_validator("steady", mode="before")
    @classmethod
    def _read_steady(cls, given: Any, info: pydantic.ValidationInfo) -> Steady | None:
        return parse_steady(given, info.data.get("cut", "all"))

    @property
    def by(self) -> Split:
        """What is held out, as an object."""
        return split_named(self.split)

    def training(self, network: str) -> config.TrainingConfig:
        """Return how a network is trained; by name, see `models.config.RECIPES`."""
        changed = self.recipe.changed.get(network)
        return config.training_config(
            self.preset, network, changed, self.statistics, self.device, self.precision
        )

    @property
    def encoding(self) -> dict[str, Any]:
        """Options of encodings by name of the field, for whatever encodings are used."""
        return dict(self.model_extra or {})

    def chosen(self) -> dict[str, Any]:
        """Return what is not as usual by name, as Python takes it again."""
        usual, names = type(self)(), (*type(self).model_fields, *self.encoding)
        found = {name: getattr(self, name) for name in names}
        return {name: v for name, v in found.items() if v != getattr(usual, name, None)}

    def given(self) -> dict[str, Any]:
        """Return the same ready for JSON, as ``--config`` takes it."""
        written_out = self.model_dump(mode="json", fallback=str)
        return {name: written_out[name] for name in self.chosen()}


class EvaluationOptions(TrainingOptions):
    """What can be chosen of an evaluation; frozen, and checked when it is made.

    Every field is an option of `afferents.evaluate` and of the command line; any other name is
    an option of an encoding, such as `frames`.

    Raises
    ------
    InputError
        When it is made of something that makes no sense, naming the option.

    Examples
    --------
    >>> options = EvaluationOptions(models="ra-ste", held_out="20,50", frames=5)
    >>> options.held_out, options.seeds, options.encoding
    ((20.0, 50.0), (0,), {'frames': 5})
    """

    models: Annotated[
        Any,
        pydantic.PlainSerializer(
            lambda given: ",".join(
                one if isinstance(one, str) else one.name for one in model.list_wanted(given)
            )
        ),
    ] = choices.MODELS_ASKED
    """Names, comma-separated: 'all' for the paper's Table 1, 'best' for what we recommend for such
    data, 'chance' and 'nearest' to compare with, FILE.py:NAME for one of your own."""
    protocol: Literal["nested", "published", "both"] = "nested"
    """'nested': the held-out speed is unseen until the test. 'published', as in the paper's code:
    half of it selects the model (leaky), and spectra are scaled and stretched otherwise. Or
    'both'."""
    seed: _Seed = 0
    """First random seed."""
    seeds: tuple[_Seed, ...] = pydantic.Field(
        default_factory=lambda others: (others["seed"],), min_length=1
    )
    """How many seeds each model is trained with (default: 1).

    In Python a list names them: ``seeds=(3, 5)``.
    """
    textures: Annotated[tuple[str, ...], pydantic.BeforeValidator(_read_names)] = ()
    """Use only these textures: folder names or the paper's letters."""
    speeds: tuple[float, ...] = ()
    """Use only these speeds, mm/s: 10,50,100 or 10..100:30."""
    markers: float = 1.0
    """Share of the markers that tactile images show, evenly spread."""
    train_speeds: int | None = None
    """How many speeds each fold trains on (default: all it has)."""
    test_only: Annotated[
        tuple[str, str] | None, pydantic.PlainSerializer(lambda pair: pair and dict([pair]))
    ] = None
    """Test only recordings with this condition and train on the others: repetition=1."""
    speed_change: float | None = pydantic.Field(default=None, gt=0)
    """Leave out samples whose speed changes by more than this share of its mean, from the slowest
    to the fastest moment."""
    held_out: tuple[Group, ...] = ()
    """Hold out only these speeds, mm/s, or values of --split's condition (default: each)."""
    without: dict[str, str] = pydantic.Field(default_factory=dict)
    """Leave out recordings with this condition: pressure=F250."""
    penalty: choices.Penalty = "fixed"
    """Penalty of ridges (all models beyond the paper's): the usual one ('fixed'), or chosen inside
    each fold by leaving out its training speeds in turn ('searched')."""
    disturb: Annotated[
        Corruption, pydantic.BeforeValidator(lambda given: Corruption.of(given, "--disturb"))
    ] = Corruption()
    """Corrupt the recordings that are tested, as --disturb-training does others."""
    control: choices.Control = "none"
    """Take from all recordings what should distinguish textures: 'permuted' labels, time
    'shuffled', 'offsets' or 'amplitudes' of channels alone. What is recognised then rests on
    something else."""
    keep_going: bool = False
    """Skip recordings that fail, name them, and exit with code 3."""
    workers: int | None = pydantic.Field(default=None, ge=1)
    """Processes to run in parallel (default: one per core)."""
    cluster: str | None = None
    """Run on a Dask cluster instead, such as tcp://scheduler:8786."""

    @pydantic.field_validator("speeds", mode="before")
    @classmethod
    def _read_speeds(cls, given: Any) -> tuple[float, ...]:
        if isinstance(given, str):
            return parse_speeds(given)
        return tuple(map(float, _as_list(given)))

    @pydantic.field_validator("without", mode="before")
    @classmethod
    def _read_conditions(cls, given: Any) -> dict[str, str]:
        if isinstance(given, Mapping):
            return {str(name): condition_text(value) for name, value in given.items()}
        return choices.parse_conditions([given] if isinstance(given, str) else given, "--without")

    @pydantic.field_validator("test_only", mode="before")
    @classmethod
    def _read_condition(cls, given: Any) -> tuple[str, str]:
        if isinstance(given, str):
            given = choices.parse_conditions([given], "--test-only")
        ((name, value),) = given.items() if isinstance(given, Mapping) else [tuple(given)]
        return str(name), condition_text(value)

    @pydantic.field_validator("seeds", mode="before")
    @classmethod
    def _count_seeds(cls, given: Any, info: pydantic.ValidationInfo) -> tuple[int, ...]:
        if isinstance(given, str | int):
            try:
                count = int(given)
            except ValueError:
                count = 0
            if count < 1:
                raise InputError(f"--seeds: expected how many seeds, 1 or more, found '{given}'")
            first = info.data.get("seed", 0)
            return tuple(range(first, first + count))
        return tuple(dict.fromkeys(_as_list(given)))

    @pydantic.field_validator("held_out", mode="before")
    @classmethod
    def _read_groups(cls, given: Any, info: pydantic.ValidationInfo) -> tuple[Group, ...]:
        split = split_named(info.data.get("split", SPEED.name))
        if isinstance(given, str):
            given = parse_speeds(given, "--held-out") if split == SPEED else _read_names(given)
        given = _as_list(given)
        if split != SPEED:
            return tuple(map(condition_text, given))
        try:
            return tuple(map(float, given))
        except (TypeError, ValueError):
            raise InputError(f"--held-out: expected speeds in mm/s, found {given!r}") from None

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        _ = self.ablation  # which refuses what makes no sense
        return self

    def given(self) -> dict[str, Any]:
        """Return the same ready for JSON; seeds in a row as a number, so that the first may change.

        What stands in a file may be taken again together with another `seed`.
        """
        written_out, n = super().given(), len(self.seeds)
        if "seeds" in written_out and self.seeds == tuple(range(self.seed, self.seed + n)):
            written_out["seeds"] = n
        return written_out

    @property
    def ablation(self) -> Ablation:
        """What of the data is used."""
        return Ablation(
            self.textures, self.speeds, self.markers, self.train_speeds, self.test_only,
            self.speed_change,
        )  # fmt: skip

    @property
    def protocols(self) -> list[Protocol]:
        """The protocols to run: `nested`, `published`, or both, nested first."""
        return [one for name, one in PROTOCOLS.items() if self.protocol in (name, "both")]


def shell_words(options: Mapping[str, Any]) -> list[str]:
    """Return options by name, as `TrainingOptions.given` has them, as a shell takes them."""
    flags = {name: option.flag for name, option in encoding_options().items()}
    words: list[str] = []
    for name, value in options.items():
        texts = [",".join(map(_text, value)) if isinstance(value, list | tuple) else _text(value)]
        if isinstance(value, dict):
            pairs = [f"{key}={_text(one)}" for key, one in value.items()]
            texts = pairs if name == "without" else [",".join(pairs)]
            texts = [] if name == "recipe" else texts  # made in Python: no file to name
        words += [word for text in texts for word in (flags.get(name, choices.flag_of(name)), text)]
    return words


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)
