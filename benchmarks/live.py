"""How soon after a frame or sound a prediction or signals are there, how fast, in how much memory.

    python benchmarks/live.py                       # latency of every model, and the whole chain
    python benchmarks/live.py --hours 8             # memory over hours of frames and sound
    python benchmarks/live.py --large               # pictures of 1920 x 1080

No models are needed: networks that have learnt nothing take as long. A recording of the rig is
replayed at 90 frames/s; everything runs on one core, the decoder too, whose time is not counted: a
frame's clock starts when it lies decoded in memory, a window's when its last sample has come. Where
the milliseconds go is measured in processor's time, as fast as it goes, so that other work on the
machine does not count.
"""

import argparse
import math
import os
import platform
import resource
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import av
import cv2
import numpy as np
import torch

import afferents
from afferents.doctor import processor
from afferents.encodings.settings import Encodings
from afferents.lab.live import (
    CameraFrame,
    LivePipeline,
    Network,
    Pace,
    ReplayedSound,
    ReplayedVideo,
    Sound,
    run,
    stream,
)
from afferents.lab.live.fingertip import Fingertip
from afferents.lab.live.follower import Follower
from afferents.lab.live.touch import Filling
from afferents.markers.sensor import load_sensor
from afferents.markers.track import Tracker
from afferents.models.card import CARD, WEIGHTS, Card
from afferents.models.classifiers import build
from afferents.models.deployed import Deployed
from afferents.models.export import export
from afferents.models.folder import dump_weights
from afferents.models.model import MODELS, TABLE1
from afferents.recordings.audio import WavFile
from afferents.recordings.video import open_video
from afferents.rig import Rig, bumped_surface, record
from afferents.version import __version__

MEASURED = (*TABLE1, "sa-wave-vector", "ra-wave-vector")
SECONDS = 20.0
SETTLED = 180
"""Predictions that are not counted at first: caches fill, files are read."""

SHAPES = {
    "spatial": (19, 19),
    "spatiotemporal": (10, 19, 19),
    "spectral": (1, 200),
    "wavenumbers": (2, 19, 10),
}
"""Of samples, by encoding."""


def main() -> None:
    """Print a table for docs/performance.md."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float)
    parser.add_argument("--large", action="store_true")
    arguments = parser.parse_args()
    print(f"{processor()}, Python {platform.python_version()}")
    with tempfile.TemporaryDirectory() as folder:
        if arguments.large:
            large_pictures(Path(folder))
            return
        recording = Path(folder) / "3" / "50"
        record(Rig(), recording, "3", bumped_surface(3.0, Rig().drum), 50.0, SECONDS, seed=1)
        models = {name: untrained(name, Path(folder)) for name in MEASURED}
        if arguments.hours:
            memory(recording, models, arguments.hours)
            memory_of_signals(recording, arguments.hours)
        else:
            latency(recording, models)
            parts(recording, models)
            whole_chain(recording, models)


def untrained(name: str, folder: Path) -> Path:
    """Export a network of a model with random weights."""
    model = MODELS[name]
    encoding = Encodings().of(model.encoding)
    vibration, shape = encoding.of_vibration, SHAPES[model.encoding]
    network = build(model.classifier, 13, shape)
    card = Card(
        model=name,
        textures=tuple(f"{i / 2:g}" for i in range(13)),
        title=model.title,
        classifier=model.classifier,
        sample_dims=encoding.sample_dims,
        channel=model.channel,
        encoding=encoding.describe(),
        shape=shape,
        scale=1.0,
        sensor=None if vibration else load_sensor("tip_b").model_dump(mode="json"),
        fps_hz=None if vibration else 90.0,
        sample_rate_hz=44100.0 if vibration else None,
        preset="none",
        seed=0,
        learnt_from_mm_s=(40, 60),
        validated_on_mm_s=50,
        named_by_spacing=True,
        most_sure=1,
        validation_accuracy=0,
        validation_ci95=(0, 1),
        data=(),
        versions={"afferents": __version__},
    )
    trained = folder / name
    trained.mkdir()
    (trained / CARD).write_text(card.model_dump_json())
    (trained / WEIGHTS).write_bytes(dump_weights(Deployed(network, 13, 1.0)))
    export(trained, folder / f"{name}.onnx")
    return folder / f"{name}.onnx"


def sources(recording: Path, speed: float) -> list[ReplayedVideo | ReplayedSound]:
    """Both channels of a recording, at a pace."""
    pace = Pace(speed)
    return [
        ReplayedVideo(open_video(recording / "video.mp4"), pace),
        ReplayedSound(WavFile(recording / "audio.wav"), pace),
    ]


def latency(recording: Path, models: dict[str, Path]) -> None:
    """Every model alone, with spikes and figures of quality, at true speed, on one core."""
    torch.set_num_threads(1)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    print("| model | p50, ms | p99, ms | longest, ms | predictions | dropped |")
    print("|---|---|---|---|---|---|")
    for name, path in models.items():
        pipeline = LivePipeline.with_models([Network(path)])
        pipeline.show_spikes()
        predictions = list(run(sources(recording, 1.0), pipeline))
        latency_ms = [p.latency_ms for p in predictions if p.latency_ms is not None]
        latency_ms = latency_ms[SETTLED:] if len(latency_ms) > 2 * SETTLED else latency_ms[2:]
        middle, high = np.percentile(latency_ms, [50, 99])
        dropped = predictions[-1].counters.dropped
        title = MODELS[name].title
        print(
            f"| {title} | {middle:.2f} | {high:.2f} | {max(latency_ms):.2f} | {len(latency_ms)} "
            f"| {dropped} |"
        )
    signals_ms, dropped = signals(recording)
    middle, high = np.percentile(signals_ms, [50, 99])
    print(
        f"| SA-I, RA-I, shear (`stream`) | {middle:.2f} | {high:.2f} | {max(signals_ms):.2f} "
        f"| {len(signals_ms)} | {dropped} |"
    )
    os.sched_setaffinity(0, cores)


def signals(recording: Path) -> tuple[list[float], int]:
    """Return how soon after each frame its signals are there, ms; and how many were dropped."""
    video, _ = sources(recording, 1.0)
    arrived, given, found_ms = {}, video.events, []

    def noted() -> Iterator[Any]:
        for event in given():
            if isinstance(event, CameraFrame):
                arrived[event.time_s] = event.arrived_s
            yield event

    with (
        patch.object(video, "events", noted),
        Fingertip([video], load_sensor("tip_b")) as fingertip,
    ):
        for touch in fingertip:
            assert all(len(one) for one in (touch.sa1, touch.ra1, touch.shear, touch.position))
            found_ms.append(1000 * (time.monotonic() - arrived[touch.time_s]))
    return found_ms[SETTLED:], touch.quality.dropped


class Stopwatch:
    """Processor's time that this thread spends in methods, ms."""

    def __init__(self) -> None:
        """Nothing is timed yet."""
        self.ms: Counter[str] = Counter()

    def around(self, function: Callable[..., Any], name: str) -> Callable[..., Any]:
        """Return a function that is timed."""

        def timed(*given: Any) -> Any:
            start_s = time.thread_time()
            result = function(*given)
            self.ms[name] += 1000 * (time.thread_time() - start_s)
            return result

        return timed


def parts(recording: Path, models: dict[str, Path]) -> None:
    """Where the time between a frame, or the last sound of a window, and its prediction goes.

    What comes after the prediction (figures of quality, spikes) stands in the last column.
    """
    print("| model | markers | SA-I, RA-I | model | rest | all, ms | after |")
    print("|---|---|---|---|---|---|---|")
    for name, path in models.items():
        found = np.median(list(measure_parts(recording, path))[10:], axis=0)
        print(f"| {MODELS[name].title} | {' | '.join(f'{ms:.2f}' for ms in found)} |", flush=True)


def measure_parts(recording: Path, model: Path) -> Iterator[list[float]]:
    """Yield the parts of every prediction's time, ms."""
    watch, pipeline = Stopwatch(), LivePipeline.with_models([Network(model)])
    pipeline.show_spikes()
    predict = watch.around(lambda predictions: next(predictions, None), "all")
    finish = watch.around(list, "after")
    with (
        patch.object(Tracker, "step", watch.around(Tracker.step, "markers")),
        patch.object(Follower, "feed", watch.around(Follower.feed, "images")),
        patch.object(Filling, "feed", watch.around(Filling.feed, "images")),
        patch.object(Network, "predict", watch.around(Network.predict, "model")),
    ):
        for source in sources(recording, math.inf):
            used = pipeline.by_channel.get(source.channel)
            if used is None:
                continue
            used.speed = math.inf
            for event in source.events():
                watch.ms.clear()
                predictions = pipeline.feed(event)
                is_predicted = predict(predictions) is not None
                finish(predictions)
                if is_predicted:
                    ms = watch.ms
                    images = ms["images"] - ms["markers"]
                    rest = ms["all"] - ms["images"] - ms["model"]
                    yield [ms["markers"], images, ms["model"], rest, ms["all"], ms["after"]]


def whole_chain(recording: Path, models: dict[str, Path]) -> None:
    """Video and sound from their files to predictions, as fast as it goes."""
    for names in (["ra-se"], ["ra-ste"], ["ra-wave-vector"], ["ra-wave-vector", "vib-te-aug"]):
        seconds = []
        for _ in range(3):
            start = time.perf_counter()
            for _ in stream(sources(recording, math.inf), [models[name] for name in names]):
                pass
            seconds.append(time.perf_counter() - start)
        speed = SECONDS / float(np.median(seconds))
        print(f"- {', '.join(names)}: {speed:.1f} times real time, decoding included")


def memory(recording: Path, models: dict[str, Path], hours: float) -> None:
    """Feed the same seconds again and again, as if they went on; print the memory in use."""
    pipeline = LivePipeline.with_models([Network(models["ra-ste"]), Network(models["vib-te-aug"])])
    for one in pipeline.by_channel.values():
        one.speed = math.inf
    video, sound = sources(recording, math.inf)
    frames = [e.frame for e in video.events() if isinstance(e, CameraFrame)][200:380]
    chunks = [e.samples for e in sound.events() if isinstance(e, Sound)][300:500]
    n = round(hours * 3600 / 2)
    for turn in range(n):
        for i, frame in enumerate(frames):
            list(pipeline.feed(CameraFrame(frame._replace(time_s=2 * turn + i / 90), 0.0)))
        for i, samples in enumerate(chunks):
            list(pipeline.feed(Sound(2 * turn + i / 100, samples, 0.0)))
        if turn % max(1, n // 8) == 0 or turn == n - 1:
            print(f"{2 * (turn + 1) / 3600:6.2f} h: {resident_mb():.1f} MB resident", flush=True)
    print(f"peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.1f} MB")


def large_pictures(folder: Path) -> None:
    """How long a frame of 1920 x 1080 takes from MJPEG to signals, with 331 pins, on one core."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rng, clip = np.random.default_rng(0), folder / "large.avi"
    places = 2.25 * np.array(load_sensor("hex331").markers, float) + (240, 0)
    with av.open(clip, "w") as out:
        stream = out.add_stream("mjpeg", rate=120)
        stream.width, stream.height, stream.pix_fmt = 1920, 1080, "yuvj420p"
        stream.options = {"qscale": "3"}
        for n in range(240):
            image = np.full((1080, 1920), 20, np.uint8)
            shift = np.array([6 * math.sin(n / 8), 3 * math.cos(n / 5) - 3]) * (n > 25)
            for x, y in (16 * (places + shift)).round().astype(int).tolist():
                cv2.circle(image, (x, y), 16 * 12, 255, -1, cv2.LINE_AA, 4)
            image = cv2.GaussianBlur(image, (0, 0), 1.5) + rng.normal(0, 2, image.shape)
            grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
            frame = av.VideoFrame.from_ndarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB), "rgb24")
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    begun_s = time.process_time()
    n = sum(1 for _ in open_video(clip).frames())
    decoding_ms = 1000 * (time.process_time() - begun_s) / n
    with afferents.stream(clip) as tip:
        for number, touch in enumerate(tip):
            touch.sa1, touch.ra1, touch.shear  # noqa: B018  as who reads all
            if number == 60:  # it has begun; frames are decoded a constant number ahead
                begun_s = time.process_time()
            elif number == 200:
                all_ms = 1000 * (time.process_time() - begun_s) / 140
    print(f"1920 x 1080, 331 pins: {all_ms:.1f} ms a frame, {decoding_ms:.1f} of it for decoding")


class Repeated:
    """The same seconds again and again, as if a camera or a microphone went on."""

    speed = math.inf

    def __init__(self, events: list[Any], rate_hz: float, hours: float) -> None:
        self.channel, self.rate_hz = events[0].channel, rate_hz
        self._events, self._n = events, round(hours * 3600 / 2)

    def events(self) -> Iterator[Any]:
        """Yield them, and again."""
        begun_s = self._events[0].time_s
        for turn in range(self._n):
            for event in self._events:
                time_s = 2 * turn + event.time_s - begun_s
                if isinstance(event, CameraFrame):
                    yield event._replace(frame=event.frame._replace(time_s=time_s))
                else:
                    yield event._replace(time_s=time_s)

    def close(self) -> None:
        """There is no device."""


def memory_of_signals(recording: Path, hours: float) -> None:
    """Read touches for hours; print the memory in use."""
    video, sound = sources(recording, math.inf)
    frames = [e for e in video.events() if isinstance(e, CameraFrame)][200:380]
    chunks = [e for e in sound.events() if isinstance(e, Sound)][300:500]
    given = [Repeated(frames, 90.0, hours), Repeated(chunks, sound.rate_hz, hours)]
    every = round(hours * 3600 * 90 / 8)
    with Fingertip(given, load_sensor("tip_b")) as tip:
        for n, touch in enumerate(tip, start=1):
            touch.sa1, touch.ra1, touch.shear, touch.ra2  # noqa: B018  as who reads all
            if n % every == 0 or n == every // 8:
                print(f"signals, {n / 324000:6.2f} h: {resident_mb():.1f} MB resident", flush=True)


def resident_mb() -> float:
    """Memory in use now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


if __name__ == "__main__":
    main()
