"""One model to feel with: trained on all speeds but one, calibrated on that, with its card."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from afferents import __version__
from afferents.core import dims
from afferents.core.card import CARD, WEIGHTS, Card, Score, read_card
from afferents.core.cut import Cut
from afferents.core.errors import InputError
from afferents.core.evidence import Evidence
from afferents.core.families import Family
from afferents.core.files import holds_only, write_aside
from afferents.core.outputs import require_free
from afferents.core.progress import Progress
from afferents.core.protocol import PROTOCOLS
from afferents.core.results import load_results
from afferents.core.samples import Samples, labels_of, textures_of
from afferents.core.store import store_config
from afferents.encodings import Encodings
from afferents.evaluation import Fold, least_surprise, surprise
from afferents.models import STRENGTH, Deployed, build
from afferents.pipeline.data import DataSet, recordings_in
from afferents.pipeline.encode import encode_all, require_support, require_used, sources_of
from afferents.pipeline.job import fit
from afferents.pipeline.learning import LearningSet, learning_set
from afferents.pipeline.solve import learn, model_of
from afferents.training import Compute, Preset, load_weights, save_weights, training_config

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_BATCH = 256
_EVIDENCE_PER_S = np.geomspace(0.05, 100, 45)


@dataclass(frozen=True)
class Training:
    """What is trained and how.

    Attributes
    ----------
    results
        Results folder whose scores the card is to carry; None for 'not evaluated'.
    """

    data: list[DataSet]
    family: Family
    preset: Preset
    cut: Cut
    encodings: Encodings
    seed: int = 0
    results: Path | None = None
    compute: Compute = field(default_factory=Compute)


def train_model(training: Training, out: Path, progress: Progress, force: bool = False) -> Card:
    """Train a model and write its folder, whole or not at all; return its card.

    The weights learn from all speeds but the middle one, which stops the training, sets the
    temperature, how much evidence a second of touch is, and from where on a touch is unknown:
    what a speed never learnt from needs, not what was learnt by heart.

    Parameters
    ----------
    force
        Whether a model that was written there before may be replaced.

    Raises
    ------
    InputError
        If something else stands at `out`, the data don't support the family or have fewer than
        two speeds, or the results folder holds no finished evaluation of the family.
    AfferentsError
        If the loss is no longer a number.
    """
    reads = [Path(data.located.rpartition(":")[2]) for data in training.data]
    require_free(out, "a model", _is_model, force=force, reads=reads)
    recordings = recordings_in(training.data)
    require_support([training.family], recordings, may_leave_out=False)
    require_used([training.family], training.encodings)
    source = sources_of(training.family, training.encodings)[0]
    if source.encoding.step != 1:
        found = f"one of {source.encoding.step}"
        raise InputError("encodings", "every frame, as live feels them", found)
    scores = scores_of(training) if training.results else ()
    family = training.family
    samples = encode_all(recordings, source, training.cut, progress)
    fold = all_but_the_middle(samples)
    with progress.task("training", 1) as mark:
        deployed, learnt = trained_on(training, samples, fold)
        mark(1)
    calibration = calibrate(deployed, learnt, fold, samples)
    card = Card(
        family=family.name,
        textures=tuple(textures_of(samples)),
        shape=tuple(learnt.values.shape[1:]),
        scale=learnt.scale,
        preset=training.preset,
        seed=training.seed,
        learnt_from_mm_s=_speeds_of(samples, fold.train),
        validated_on_mm_s=fold.validation_mm_s,
        data=tuple(data.describe() for data in training.data),
        scores=scores,
        versions={"afferents": __version__, "torch": version("torch")},
        **calibration._asdict(),
        **felt_with(training.data, family, training.encodings),
    )
    with write_aside(out, replaces=_is_model) as partial:
        partial.mkdir()
        save_weights(deployed, partial / WEIGHTS)
        (partial / CARD).write_text(card.to_json(indent=2) + "\n", encoding="utf-8")
    return card


def trained_on(training: Training, samples: Samples, fold: Fold) -> tuple[Deployed, LearningSet]:
    """Train on a fold; return the network to be deployed, and what it learnt from."""
    family = training.family
    if family.learner == "ridge":
        return _solved(training, samples, fold)
    config = training_config(training.preset, family.encoding, training.compute)
    rng = np.random.default_rng(training.seed)
    encoding, nested = training.encodings.of(family.encoding), PROTOCOLS["nested"]
    learnt = learning_set(samples, encoding, family.augmented, nested, fold, config, rng)
    torch.set_num_threads(1)
    n_classes = len(textures_of(samples))
    network = build(family.encoding, n_classes, tuple(learnt.values.shape[1:]), training.seed)
    fit(network, learnt, config, training.seed)
    return Deployed(network.cpu(), n_classes, learnt.scale).eval(), learnt


def _solved(training: Training, samples: Samples, fold: Fold) -> tuple[Deployed, LearningSet]:
    """Solve a ridge on a fold."""
    labels, nothing = labels_of(samples), np.empty(0, dtype=np.int64)
    ridge = model_of(training.family, samples, training.encodings)
    learn(ridge, samples, labels, fold.train, training.seed, STRENGTH)
    arrays = torch.from_numpy(samples.values), torch.from_numpy(labels)
    learnt = LearningSet(*arrays, fold.train, fold.validation, 1.0, nothing)
    return Deployed(ridge, len(textures_of(samples)), learnt.scale).eval(), learnt


class Calibration(NamedTuple):
    """What the speed says that nothing was learnt from; see `Card`."""

    temperature: float
    evidence_per_s: float
    validation_accuracy: float


@torch.no_grad()
def calibrate(deployed: Deployed, learnt: LearningSet, fold: Fold, samples: Samples) -> Calibration:
    """Set a network's temperature and what it knows, in place."""
    train, held = torch.from_numpy(learnt.train), torch.from_numpy(fold.validation)
    unseen = _last_features(deployed, learnt.values, held)
    deployed.know(_last_features(deployed, learnt.values, train), learnt.labels[train], unseen)
    labels = learnt.labels[held].numpy()
    logits = deployed.last(unseen).double().numpy()
    temperature = least_surprise(lambda temperature: logits / temperature, labels)
    deployed.temperature = torch.tensor(temperature)
    probabilities = deployed.outcome(unseen)[0].double().numpy()
    recording = samples[dims.RECORDING].values[fold.validation]
    stop_s = samples[dims.STOP].values[fold.validation]
    return Calibration(
        temperature,
        best_evidence(probabilities, labels, recording, stop_s),
        float((probabilities.argmax(1) == labels).mean()),
    )


def _is_model(folder: Path) -> bool:
    """Tell whether a folder is a model's, and holds nothing else."""
    return (folder / CARD).is_file() and holds_only(CARD, WEIGHTS)(folder)


def load_model(folder: Path) -> tuple[Card, Deployed]:
    """Read a model's folder.

    Raises
    ------
    InputError
        If it is none, or one of its files is damaged.
    """
    path = folder / CARD
    if not path.is_file():
        raise InputError(folder, f"a model's folder with {CARD}", "none", "run 'afferents train'")
    card = read_card(path)
    network = build(card.of_family.encoding, len(card.textures), card.shape)
    deployed = Deployed(network, len(card.textures), card.scale)
    load_weights(deployed, folder / WEIGHTS)
    return card, deployed.eval()


def all_but_the_middle(samples: Samples) -> Fold:
    """Return the fold that trains on all speeds but the middle one, and tests nothing.

    Raises
    ------
    InputError
        If there is one speed only, or a texture at the middle one alone.
    """
    speed = samples[dims.SPEED].values
    speeds = np.unique(speed)
    if len(speeds) < 2:
        raise InputError(
            "the data", "at least 2 speeds, one of them to validate with", f"{len(speeds)}"
        )
    middle = float(speeds[len(speeds) // 2])
    train, validation = np.flatnonzero(speed != middle), np.flatnonzero(speed == middle)
    texture = samples[dims.TEXTURE].values
    only_there = sorted(set(texture[validation]) - set(texture[train]))
    if only_there:
        found = f"none of {', '.join(map(str, only_there))}"
        raise InputError("the data", f"every texture at another speed than {middle:g} mm/s", found)
    return Fold(middle, middle, train, validation, np.empty(0, dtype=np.int64))


def _last_features(deployed: Deployed, values: Tensor, index: Tensor) -> Tensor:
    """Return what enters the last layer for some samples, (n, feature)."""
    parts = torch.split(index, _BATCH)
    return torch.cat([deployed.last_features(values.index_select(0, part)) for part in parts])


def best_evidence(
    probabilities: Floats, labels: Indices, recording: NDArray[Any], stop_s: Floats
) -> float:
    """Return how many samples' worth of evidence a second is (`Evidence`).

    That under which the true textures are most likely, whenever one looks.

    Parameters
    ----------
    probabilities, labels, recording, stop_s
        Of samples not learnt from, recording by recording in the order of time.
    """
    every_s = _stride(stop_s, recording)
    logs = np.empty_like(probabilities)
    for name in np.unique(recording):
        evidence = Evidence(probabilities.shape[1], per_s=1.0)
        for k in np.flatnonzero(recording == name):
            evidence.add(float(stop_s[k]), probabilities[k], every_s)
            logs[k] = evidence.logs
    surprises = [surprise(per_s * logs, labels) for per_s in _EVIDENCE_PER_S]
    return float(_EVIDENCE_PER_S[np.argmin(surprises)])


def _stride(stop_s: Floats, recording: NDArray[Any]) -> float:
    """Return the usual time between samples of one recording, s."""
    steps = np.diff(stop_s)[recording[1:] == recording[:-1]]
    return float(np.median(steps)) if len(steps) else 1.0


def _speeds_of(samples: Samples, index: Indices) -> tuple[float, ...]:
    """Return the speeds of some samples, ascending, mm/s."""
    return tuple(float(v) for v in np.unique(samples[dims.SPEED].values[index]))


def scores_of(training: Training) -> tuple[Score, ...]:
    """Return what a results folder says of the family, `nested` first.

    Raises
    ------
    InputError
        If it says nothing of it.
    """
    assert training.results is not None
    results = load_results(training.results)
    summary = results.summary
    found = summary["models"].get(training.family.name, {})
    if not found:
        raise InputError(
            training.results,
            f"a finished evaluation of {training.family.name}",
            f"of {', '.join(summary['models']) or 'nothing'}",
            "evaluate it there, or leave out --results",
        )
    same = _same_data(training, results.config)
    return tuple(
        Score(
            protocol=protocol,
            preset=summary["preset"],
            seeds=tuple(entry["seeds"]),
            mean_accuracy=entry["mean_accuracy"],
            ci95=tuple(entry["ci95"]),
            worst_accuracy=entry["by_speed"][entry["worst_speed"]],
            worst_mm_s=float(entry["worst_speed"]),
            same_data=same,
        )
        for protocol, entry in sorted(found.items())
    )


def _same_data(training: Training, config: dict[str, Any]) -> bool:
    """Say whether an evaluation of that configuration learnt from what the training learns from."""
    fingerprints = [data["fingerprint"] for data in config["data"]]
    encoding = training.encodings.of(training.family.encoding)
    return (
        fingerprints == [data.fingerprint for data in training.data]
        and "ablation" not in config
        and config["cut"] == training.cut
        and config.get(encoding.name) == encoding.model_dump(mode="json")
    )


def felt_with(data: Sequence[DataSet], family: Family, how: Encodings) -> dict[str, Any]:
    """Return what the card says of the sensor: of camera and markers, or of the microphone.

    Raises
    ------
    InputError
        If stores were extracted with different sensor files.
    """
    first = data[0].responses[0]
    encoding = how.of(family.encoding)
    said: dict[str, Any] = {
        "channel": family.channel,
        "encoding": {"name": encoding.name, **encoding.model_dump(mode="json")},
    }
    if encoding.of_vibration:
        return said | {"sample_rate_hz": float(first[dims.RA2].attrs[dims.SAMPLE_RATE])}
    sensors = [store_config(Path(one.source))["sensor"] for one in data]
    if any(sensor != sensors[0] for sensor in sensors):
        raise InputError("STORE", "stores of one sensor", "of several", "extract with one file")
    step_s = float(np.median(np.diff(first[dims.TIME].values)))
    return said | {"sensor": sensors[0], "fps_hz": round(1 / step_s, 3)}
