"""The commands as functions, with the same words: what `afferents NAME` does from a shell.

Each takes strings or paths, shows progress in a terminal or a notebook (``quiet=True`` for none),
returns something to go on with, and raises `InputError`, one sentence, where something given is not
what it should be. What a function writes is kept if it is called again, as the commands do.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import xarray as xr

from afferents.core.card import Card
from afferents.core.cut import Cut
from afferents.core.doubt import kinds_named
from afferents.core.errors import InputError
from afferents.core.model import Model, models_named
from afferents.core.progress import Progress
from afferents.core.protocol import protocols
from afferents.core.recording import Session, Video
from afferents.core.responses import Responses
from afferents.core.results import Results, load_results
from afferents.core.samples import Samples
from afferents.core.store import open_responses

if TYPE_CHECKING:
    from afferents.markers import Sensor
    from afferents.pipeline.explain import Explanation
    from afferents.pipeline.inspect import Inspection

Place = str | Path
Preset = Literal["quick", "fast", "paper"]


def calibrate(
    video: Place, out: Place, pitch_mm: float | None = None, force: bool = False
) -> "Sensor":
    """Find out how a sensor's markers look and what layout they form; write its sensor file.

    Parameters
    ----------
    video
        A clip that begins with the skin at rest.
    out
        Sensor file to write, ending in ``.toml``; a picture to check comes beside it.
    pitch_mm
        Distance of the markers on the skin, mm, if known.
    force
        Whether those of an earlier calibration may be replaced.

    Returns
    -------
    Sensor
        What was written, to be given as ``sensor`` to the other functions.
    """
    from afferents.markers import load_sensor
    from afferents.pipeline.calibrate import calibrate_sensor

    calibrate_sensor(Path(video), Path(out), pitch_mm, force)
    return load_sensor(str(out))


def track(video: Place | Video, sensor: "str | Path | Sensor" = "tip_b") -> xr.Dataset:
    """Follow the markers of a video.

    Parameters
    ----------
    video
        Any file that FFmpeg reads, or the video of a recording.
    sensor
        A sensor file, the name of a packaged one, or a `Sensor`.

    Returns
    -------
    xarray.Dataset
        `position (time, marker, space)` px, NaN where a marker was lost; `detected (time, marker)`;
        `rest_position (marker, space)`.
    """
    from afferents.markers import track as follow
    from afferents.recordings import open_video

    opened = open_video(video) if isinstance(video, str | Path) else video
    return follow(opened, _sensor(sensor))


def simulate(
    session: Place,
    preset: Literal["quick", "paper"] = "quick",
    textures: Iterable[str] = "abcdefghijklm",
    speeds_mm_s: Iterable[float] | None = None,
    seconds: float | None = None,
    seed: int = 0,
    workers: int | None = None,
    quiet: bool = False,
    **further: Any,
) -> Session:
    """Simulate the rig: fingertip, drums, camera and microphone, as raw mp4 and wav.

    Parameters
    ----------
    session
        Folder to write, in the published layout.
    preset
        ``quick``, 5 speeds of 7.5 s, or ``paper``, 10 speeds of 65 s.
    textures
        Letters a to m, or bump spacings in mm.
    speeds_mm_s, seconds
        Instead of the preset's.
    seed
        The same seed gives the same session.
    workers
        Processes; None for one a core.
    quiet
        Whether no progress is shown.
    further
        `height_maps`, `nuisances`, `remount` and `sensor`, as ``afferents simulate --help`` has
        them.

    Returns
    -------
    Session
        As `read_session` reads it.
    """
    from afferents.pipeline.simulate import simulate_session, simulation_of
    from afferents.recordings import read_session

    speeds = None if speeds_mm_s is None else [float(speed) for speed in speeds_mm_s]
    with Progress(quiet) as progress:
        wanted = simulation_of(
            Path(session), preset, list(textures), speeds, seconds, seed=seed, **further
        )
        simulate_session(wanted, workers, progress)
    return read_session(Path(session))


def extract(
    session: Place,
    out: Place,
    sensor: "str | Path | Sensor" = "tip_b",
    method: Literal["windowed", "one-to-one", "published"] = "windowed",
    keep_going: bool = False,
    accept: Sequence[str] = (),
    workers: int | None = None,
    quiet: bool = False,
) -> list[Responses]:
    """Turn videos and audio into marker tracks, SA-I, RA-I and RA-II.

    Parameters
    ----------
    session
        Folder in the published layout: ``<texture>/<speed>/video.mp4`` and ``audio.wav``.
    out
        Store to write, such as ``S.zarr``; recordings that are in it are kept.
    sensor, method
        Whose markers they are, and how they are followed.
    keep_going
        Whether recordings that can't be read are skipped.
    accept
        Kinds of what is wrong with a recording that are taken all the same.
    workers
        Processes; None for one a core.
    quiet
        Whether no progress is shown.

    Returns
    -------
    list of xarray.Dataset
        A recording each, opened lazily; see `afferents.core.responses` for what is in it.
    """
    from afferents.pipeline.extract import Extraction
    from afferents.pipeline.extract import extract as run

    wanted = Extraction(
        Path(session), Path(out), _sensor(sensor), method, keep_going, workers,
        accept=kinds_named(list(accept)),
    )  # fmt: skip
    with Progress(quiet) as progress:
        run(wanted, progress)
    return open_responses(Path(out))


def evaluate(
    data: Place | Sequence[Place],
    out: Place,
    models: str | Model | Sequence[str | Model] = "best",
    protocol: Literal["nested", "published", "both"] = "nested",
    preset: Preset = "fast",
    cut: Cut = "all",
    seeds: Iterable[int] = (0,),
    held_out: Sequence[float] = (),
    without: Mapping[str, str] | None = None,
    keep_going: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
    **encoding: Any,
) -> Results:
    """Train and test models, one speed held out at a time.

    Parameters
    ----------
    data
        Extracted stores, or ``fabricslide:PATH``.
    out
        Results folder; finished folds in it are kept.
    models
        Names, `Model` objects of your own, or both; ``all`` for the six of the paper's Table 1,
        ``best`` for what we recommend for such data.
    protocol
        Whether anything of the held-out speed may be seen before the test; see docs/protocols.md.
    preset
        Training recipe of networks: ``paper`` as published, ``fast`` a shorter road, ``quick`` to
        see that it runs.
    cut
        Part of the recordings that is used.
    seeds
        Each model is trained with each.
    held_out
        Speeds that are held out in turn, mm/s; none for all.
    without
        Conditions of recordings that are left out, such as ``{"pressure": "F250"}``.
    keep_going
        Whether recordings that can't be used are skipped.
    workers, cluster
        Processes here, or the address of a Dask scheduler.
    quiet
        Whether no progress is shown.
    encoding
        Options of the encodings by name, such as ``frames=20`` or ``window_s=2``.

    Returns
    -------
    Results
        `accuracy` is a table by speed, `predictions` one of all test samples.
    """
    from afferents.pipeline.copies import warn_of_copies
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import best_of
    from afferents.pipeline.evaluate import Evaluation
    from afferents.pipeline.evaluate import evaluate as run

    sources = [data] if isinstance(data, str | Path) else list(data)
    with Progress(quiet) as progress:
        opened = open_data([str(source) for source in sources], without, keep_going, progress)
        warn_of_copies(recordings_in(opened), progress)
        wanted = _models(models) or [best_of(recordings_in(opened))]
        evaluation = Evaluation(
            data=opened,
            out=Path(out),
            models=wanted,
            protocols=protocols(protocol),
            preset=preset,
            cut=cut,
            encodings=opened[0].encodings.changed(**encoding),
            seeds=list(seeds),
            without=without or {},
            may_leave_out=models == "all",
            keep_going=keep_going,
            held_out=tuple(held_out),
            workers=workers,
            cluster=cluster,
        )
        run(evaluation, progress)
    return load_results(Path(out))


def report(results: Place, quiet: bool = False) -> Path:
    """Write Table 1, figures and a self-contained page from a results folder.

    Parameters
    ----------
    results
        As `evaluate` leaves it.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the page, ``report.html``.
    """
    from afferents.pipeline.report import write_report

    with Progress(quiet) as progress:
        return write_report(Path(results), progress)


def train(
    data: Place,
    out: Place,
    model: str | Model = "best",
    preset: Preset = "fast",
    cut: Cut = "all",
    seed: int = 0,
    results: Place | None = None,
    force: bool = False,
    device: Literal["auto", "cpu", "cuda"] = "auto",
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
    quiet: bool = False,
    **encoding: Any,
) -> Card:
    """Train one model to feel with, on all speeds but the one that calibrates it.

    Parameters
    ----------
    data
        An extracted store.
    out
        Folder of the model to write.
    model
        A name, a `Model` of your own, or ``best``.
    preset, cut, seed, encoding
        As of `evaluate`.
    results
        Results folder whose scores the model's card is to carry.
    force
        Whether a model that was written there before may be replaced.
    device, precision
        What networks learn on, and in which numbers.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Card
        What the model is, what it learnt from, and how far it was tested.
    """
    from afferents.pipeline.copies import warn_of_copies
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import best_of
    from afferents.pipeline.train import Training
    from afferents.pipeline.train import train as run
    from afferents.training import Compute

    asked = _models(model)
    if len(asked) > 1:
        raise InputError("--model", "'best' or one model", f"'{model}'")
    with Progress(quiet) as progress:
        opened = open_data([str(data)], progress=progress)
        warn_of_copies(recordings_in(opened), progress)
        (chosen,) = asked or [best_of(recordings_in(opened))]
        wanted = Training(
            opened, chosen, preset, cut, opened[0].encodings.changed(**encoding), seed,
            None if results is None else Path(results), Compute(device, precision),
        )  # fmt: skip
        return run(wanted, Path(out), progress, force)


def export(model: Place, out: Place, force: bool = False) -> Path:
    """Write a trained model as one ONNX file, with its card, to be felt live with.

    Parameters
    ----------
    model
        Folder of a trained model.
    out
        File to write, ending in ``.onnx``.
    force
        Whether a model that was exported there before may be replaced.

    Returns
    -------
    Path
        Of the file.
    """
    from afferents.pipeline.export import export_model

    export_model(Path(model), Path(out), force)
    return Path(out)


def explain(
    model: Place, data: Place, out: Place, cut: Cut = "all", quiet: bool = False
) -> "Explanation":
    """Show what decides: the markers, waves, or frequencies without which a model fails.

    Parameters
    ----------
    model
        Folder of a trained model.
    data
        An extracted store.
    out
        Folder for the pictures.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Explanation
        Sentences, pictures, and numbers.
    """
    from afferents.pipeline.data import open_data
    from afferents.pipeline.explain import explain as run

    with Progress(quiet) as progress:
        (opened,) = open_data([str(data)], progress=progress)
        return run(Path(model), opened, Path(out), cut, progress)


def inspect(
    source: Place,
    out: Place | None = None,
    sensor: "str | Path | Sensor | None" = None,
    overlay: Place | None = None,
    force: bool = False,
    quiet: bool = False,
) -> "Inspection":
    """Say what is in a file or session and whether it is sound, and draw pictures of it.

    Parameters
    ----------
    source
        A video, a wav file, a session, a store or ``fabricslide:PATH``.
    out
        Folder for the pictures; None for ``NAME-inspected``.
    sensor
        Whose markers to look for.
    overlay
        Video to write with the markers drawn in, such as ``o.mp4``; None for none.
    force
        Whether one that was written there before may be replaced.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Inspection
        Sentences, problems, pictures and facts.
    """
    from afferents.pipeline.inspect import inspect as look

    name = Path(str(source).rpartition(":")[2].rstrip("/")).stem or "source"
    given = None if sensor is None else _sensor(sensor)
    folder = Path(out) if out is not None else Path(f"{name}-inspected")
    drawn = None if overlay is None else Path(overlay)
    with Progress(quiet) as progress:
        return look(str(source), folder, given, progress, drawn, force)


def samples(
    data: Place,
    channel: Any,
    encoding: Any,
    cut: Cut = "all",
    quiet: bool = False,
    **options: Any,
) -> Samples:
    """Return what a classifier would learn from, of all recordings of a store.

    Parameters
    ----------
    data
        An extracted store, or ``fabricslide:PATH``.
    channel, encoding
        Names, or objects of your own, as of `Model`.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.
    options
        Of the encoding, such as ``frames=20``.

    Returns
    -------
    xarray.DataArray
        Dims `sample` and those of the encoding; on `sample` stand `texture`, `speed_mm_s`,
        `recording`, `start_s`, `stop_s`. For scikit-learn's cross-validation take
        ``x.values.reshape(len(x), -1)``, ``x.texture`` and ``groups=x.speed_mm_s``.
    """
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import encode_all, require_used, sources_of

    asked = Model("samples", channel=channel, encoding=encoding, classifier=None)
    with Progress(quiet) as progress:
        opened = open_data([str(data)], progress=progress)
        encodings = opened[0].encodings.changed(**options)
        (source,) = sources_of(asked, encodings)
        require_used([asked], encodings)
        return encode_all(recordings_in(opened), source, cut, progress)


def _models(wanted: str | Model | Sequence[str | Model]) -> list[Model]:
    """Return the models asked for; none for the recommended one."""
    if isinstance(wanted, Model):
        return [wanted]
    if isinstance(wanted, str):
        return [] if wanted == "best" else models_named(wanted)
    names = [one for one in wanted if isinstance(one, str)]
    found = models_named(",".join(names)) if names else []
    return found + [one for one in wanted if isinstance(one, Model)]


def _sensor(wanted: "str | Path | Sensor") -> "Sensor":
    from afferents.markers import Sensor, load_sensor

    return wanted if isinstance(wanted, Sensor) else load_sensor(str(wanted))
