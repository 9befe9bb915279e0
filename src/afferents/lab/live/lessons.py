"""Lessons: what was taught, kept as recordings, and the classifier solved from it.

A lesson is one touch. Its frames lie in a folder of their own, some at rest in front, and
`session.json` lists it with the part that was learnt from, so that `extract` and `evaluate` come to
the same samples.
"""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from afferents import dims, documents, files
from afferents.encodings.samples import Samples, concatenate, make_samples
from afferents.encodings.settings import Encodings
from afferents.errors import InputError
from afferents.evaluation.data import encode, find_sources
from afferents.extraction.extract import responses_of
from afferents.lab.devices.base import FULL_SCALE, CameraSettings
from afferents.lab.live import events, follower, network, reporters, touch
from afferents.lab.writers import SoundWriter, VideoWriter
from afferents.markers.calibrate import sensor_toml
from afferents.markers.rest import N_FIRST
from afferents.markers.sensor import Sensor, load_sensor
from afferents.models.taught import MODEL, Taught, solve_taught
from afferents.recordings import check, data_sets, layouts, pattern, session_file
from afferents.store.recording import GreyImage, fold_label, require_distinct

NAME = "lessons"
"""Of the model in predictions."""
EDGE_S = 0.5
"""This part of each end of a touch is not learnt from: the skin is pressed, or let go."""
LEAST = 9
"""Samples that a touch must give: a second of them, at 90 frames/s."""
MOST_S = 60.0
"""A lesson ends after this time."""
SOURCE = find_sources(MODEL, Encodings())[0]
SENSOR = "sensor.toml"
_MADE_BY = "afferents live --learn"
_QUALITY = 95
"""Of the JPEGs, per cent."""


class TaughtNetwork:
    """What was taught, used as a `Network` is; it is its own card.

    Parameters
    ----------
    taught
        That recognises.
    sentences
        That describe it.
    """

    model, title, named_by_spacing, of_pixels = NAME, "What was taught", False, True
    channel = SOURCE.channel

    def __init__(self, taught: Taught, sentences: list[str]) -> None:
        """Wait for the first run of frames."""
        self.card, self.textures = self, taught.textures
        self.most_sure, self.evidence_per_s = taught.most_sure, taught.evidence_per_s
        self._taught, self._sentences = taught, sentences
        self._stream = SOURCE.encoding.stream(self.channel.lookback)
        self.skip = self._stream.skip

    def describe(self) -> list[str]:
        """Return in sentences what was taught, and how far it was tested."""
        return self._sentences

    def predict(self, sample: touch.Response) -> network.Outcome | None:
        """Return what an image (component, row, column) and those before it are; see `Network`."""
        run = self._stream.feed(sample)
        return None if run is None else network.Outcome(*self._taught.ask(run))


class _Lesson:
    """A touch that is being recorded, and the samples made of it.

    Parameters
    ----------
    folder
        To write into.
    at_rest
        Frames that stand in front, (height, width) each.
    begins_s
        When the touch begins, s on the video's clock.
    fps_hz, sample_rate_hz
        Of the sources; None without sound.
    """

    def __init__(
        self,
        folder: Path,
        at_rest: Sequence[GreyImage],
        begins_s: float,
        fps_hz: float,
        sample_rate_hz: float | None,
    ) -> None:
        """Write the frames at rest."""
        self.begins_s = self.touched_s = begins_s
        self.period_s = 1 / fps_hz
        self.zero_s = begins_s - len(at_rest) * self.period_s
        self.runs: list[tuple[float, float, touch.Response]] = []
        """Start and end, s, and sample of each run of frames."""
        self._frames = SOURCE.encoding.stream(SOURCE.channel.lookback)
        self._since_s, self._n_off, self._rate_hz = math.nan, 0, sample_rate_hz
        height, width = at_rest[0].shape
        settings = CameraSettings(NAME, "MJPG", width, height, fps_hz)
        self._video = VideoWriter(folder / layouts.VIDEO, settings)
        self._sound: SoundWriter | None = None
        if sample_rate_hz:
            self._sound = SoundWriter(folder / layouts.AUDIO, sample_rate_hz, 1)
        for i, image in enumerate(at_rest):
            self._write(image, self.zero_s + i * self.period_s)

    def _write(self, image: GreyImage, time_s: float) -> None:
        _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        self._video.write(jpeg.tobytes(), time_s - self.zero_s)

    def add(self, picture: events.CameraFrame, filled: touch.Filled) -> bool:
        """Take in a frame; return whether the touch goes on."""
        time_s = picture.time_s
        self._write(picture.frame.image, time_s)
        self._n_off = 0 if filled.touch.touching else self._n_off + 1
        if not self._n_off:
            self.touched_s = time_s
        if filled.touch.before is None:
            self._frames.skip()
            self._since_s = math.nan
        if time_s >= self.begins_s + EDGE_S:
            self._since_s = time_s if math.isnan(self._since_s) else self._since_s
            image = filled.image(SOURCE.channel.name)
            assert image is not None  # as `require_places` has checked
            if (run := self._frames.feed(image)) is not None:
                self.runs.append((self._since_s, time_s + self.period_s, run))
                self._frames.skip()  # the next run begins after it, as offline
                self._since_s = math.nan
        return self._n_off < follower.REST_FRAMES and time_s < self.begins_s + MOST_S

    def hear(self, time_s: float, samples: touch.Response) -> None:
        """Take in sound, (n, 1), at its place; silence stands where some is missing."""
        if self._sound is None or self._rate_hz is None:
            return
        missing = round((time_s - self.zero_s) * self._rate_hz) - self._sound.n_samples
        silence = np.zeros((max(missing, 0), 1), np.float32)
        whole = np.rint(FULL_SCALE * np.concatenate([silence, samples[max(-missing, 0) :]]))
        self._sound.write(np.clip(whole, -FULL_SCALE, FULL_SCALE - 1).astype(np.int16))

    def close(self) -> None:
        """Write what is left, and keep the runs that are learnt from."""
        self.runs = [run for run in self.runs if run[1] <= self.touched_s - EDGE_S]
        if self._sound is not None:
            self._sound.close()
        self._video.close()


class Lessons:
    """Keeps what is taught as recordings in a folder, and solves the classifier anew.

    `start` and `stop` may be called by another thread than the one that takes in frames.

    Parameters
    ----------
    folder
        Of lessons, which are read; or a new one.
    sensor
        Whose markers are followed; None for that of the lessons, or the one that is found.
    fps_hz, sample_rate_hz
        Of the sources; None without sound.
    simulated
        Whether these are simulated.

    Attributes
    ----------
    network
        Recognises what was taught so far.
    reporter
        Reports what the network recognises, and what happened to lessons; None before one learns.

    Raises
    ------
    InputError
        If the folder holds something else, or lessons of another sensor, or with sound where there
        is none now.
    """

    def __init__(
        self,
        folder: Path,
        sensor: Sensor | None,
        fps_hz: float,
        sample_rate_hz: float | None = None,
        simulated: bool = False,
    ) -> None:
        """Read what was taught before."""
        self._folder, self._fps_hz, self._sample_rate_hz = folder, fps_hz, sample_rate_hz
        self._content: dict[str, Any] = {"made_by": _MADE_BY, "simulated": simulated}
        self._content |= {"sensor": SENSOR, "rest_frame": 0, "recordings": []}
        self._partial = folder / f"{files.PARTIAL_PREFIX}lesson"
        self._samples: list[Samples] = []
        self._requested: tuple[str, float | None] | None = None
        self._lesson: _Lesson | None = None
        self._at_rest, self._rest = deque[GreyImage](maxlen=N_FIRST), object()
        self._ending, self._last = False, ""
        self.reporter: reporters.ModelReporter | None = None
        if folder.exists() and not files.holds_only()(folder):
            self._read(sensor)
        self._solve()

    def _read(self, sensor: Sensor | None) -> None:
        """Read lessons that were taught before, as `extract` and `evaluate` do."""
        wanted, where = "a folder of lessons, or a new one", f"--learn {self._folder}"
        self._content = documents.read_json(self._folder / session_file.SESSION_FILE, wanted)
        if self._content.get("made_by") != _MADE_BY:
            raise InputError(f"{where}: expected {wanted}, found another session")
        own = load_sensor(self._folder / SENSOR).model_copy(update={"rest_frame": 0})
        if sensor and sensor_toml(sensor.model_copy(update={"rest_frame": 0})) != sensor_toml(own):
            expected = f"the sensor of its lessons, '{own.name}'"
            raise InputError(f"{where}: expected {expected}, found another; begin another folder")
        heard = any("audio" in one for one in self._content["recordings"])
        if heard and self._sample_rate_hz is None:
            raise InputError(f"{where}: expected --audio, as its lessons have sound, found none")
        self._sample_rate_hz = self._sample_rate_hz if heard else None
        for recording in data_sets.read_session(self._folder).recordings:
            rate_hz = getattr(recording.video, "fps_hz", self._fps_hz)
            if abs(rate_hz - self._fps_hz) > check.RATE_TOLERANCE * rate_hz:
                expected = f"{rate_hz:.3g} frames/s, as its lessons have"
                raise InputError(f"{where}: expected {expected}, found {self._fps_hz:.3g}")
            samples = encode(responses_of(recording, own), SOURCE, "all")
            self._samples.append(samples.drop_vars((dims.ROW_WAVENUMBER, dims.COLUMN_WAVENUMBER)))

    def _solve(self) -> None:
        """Solve the classifier anew, and describe how long each texture was taught."""
        taught, sentences, at_two = Taught(), [], []
        if self._samples:
            taught = solve_taught(concatenate(self._samples), SOURCE.encoding)
        for texture in taught.textures:
            its = [one for one in self._content["recordings"] if one["texture"] == texture]
            lasted_s = sum(stop - start for start, stop in (one["steady_s"] for one in its))
            touches = f"{len(its)} touches" if len(its) > 1 else "one touch"
            speeds = sorted({one["speed_mm_s"] for one in its if "speed_mm_s" in one})
            at_two.append(len(speeds) > 1)
            at = " and ".join(f"{speed:g}" for speed in speeds)
            at = f"at {at} mm/s" if speeds else "at a speed that was not given"
            sentences.append(f"{texture}: {lasted_s:.1f} s in {touches} {at}.")
        if taught.tested:
            sentences.append(taught.tested)
        if not all(at_two):
            sentences.append(
                "Nothing is known of other speeds: teach each at a second one and give both, or "
                "record others and evaluate them."
            )
        self.network = TaughtNetwork(taught, sentences)
        if self.reporter is not None:
            self.reporter.use(self.network)

    def start(self, name: str, speed: float | str = "") -> None:
        """Let the touch that goes on, or the next, be a lesson.

        Parameters
        ----------
        name
            Of the texture. One of a name that was taught before is another touch of it.
        speed
            In mm/s; empty where it is not known.

        Raises
        ------
        InputError
            If the name or speed is none, or nearly one that was taught; or while another lesson
            runs.
        """
        try:
            name = session_file.require_label(fold_label(name))
        except ValueError as error:
            raise InputError(f"the name: expected {error}, found '{name}'") from None
        try:
            speed_mm_s = pattern.parse_speed(f"{speed}") if speed else None
        except ValueError:
            speed_mm_s = math.nan
        if speed_mm_s is not None and not 0 < speed_mm_s < math.inf:
            raise InputError(f"the speed: expected a number of mm/s, found '{speed}'")
        if self._requested is not None:
            raise InputError(
                f"a lesson: expected an end of '{self._requested[0]}' first, found none"
            )
        listed = self._content["recordings"]
        speeds = {one.get("speed_mm_s") for one in listed} | {speed_mm_s}
        named = {(f"{speed:g}", speed) for speed in speeds if speed is not None}
        require_distinct("a lesson", [name, *(one["texture"] for one in listed)], named)
        self._ending, self._requested = False, (name, speed_mm_s)

    def stop(self) -> None:
        """Let the lesson end with the next frame.

        Raises
        ------
        InputError
            If none runs.
        """
        if self._requested is None:
            raise InputError("a lesson: expected one that runs, found none; begin one by a name")
        self._ending = True

    def state(self) -> dict[str, Any]:
        """Return what a page shows: the texture that is taught, and for how long it is touched."""
        lesson, requested = self._lesson, self._requested
        lasts_s = round(lesson.touched_s - lesson.begins_s, 1) if lesson else None
        sentences = self.network.describe()
        name = requested[0] if requested else None
        return {"name": name, "lasts_s": lasts_s, "sentences": sentences, "last": self._last}

    def take(self, picture: events.CameraFrame, filled: touch.Filled, sensor: Sensor) -> None:
        """Take in a frame, and what it shows."""
        touching, self._sensor = filled.touch.touching, sensor
        if filled.touch.now.rest is not self._rest:
            self._rest = filled.touch.now.rest
            self._at_rest.clear()
        if self._lesson is None and not touching:
            self._at_rest.append(picture.frame.image.copy())  # a camera's memory is used again
        if self._requested is None:
            return
        with self._forgetting_faults():
            if self._lesson is None and touching:
                if not self._at_rest:
                    raise InputError(
                        "expected frames at rest before it, found none; let go, and try again"
                    )
                files.remove(self._partial)
                self._partial.mkdir(parents=True)
                rates = self._fps_hz, self._sample_rate_hz
                self._lesson = _Lesson(self._partial, self._at_rest, picture.time_s, *rates)
            goes_on = self._lesson is None or self._lesson.add(picture, filled)
            if self._ending or not goes_on:
                self.end()

    def hear(self, time_s: float, samples: touch.Response) -> None:
        """Take in sound, (n, channel), the first sample taken at a time on the video's clock, s."""
        if self._lesson is not None:
            with self._forgetting_faults():
                self._lesson.hear(time_s, samples[:, -1:])

    def end(self) -> None:
        """End the lesson that runs, if any, and learn from it."""
        lesson = self._lesson
        with self._forgetting_faults():
            if lesson is not None:
                lesson.close()
                if len(lesson.runs) < LEAST:
                    raise InputError(
                        f"expected {LEAST} runs of frames in a touch, without {EDGE_S:g} s at "
                        f"each end, found {len(lesson.runs)}; slide for some seconds"
                    )
                self._keep(lesson)
            elif self._ending:
                raise InputError("expected a touch, found none; begin again, and slide")

    def _keep(self, lesson: _Lesson) -> None:
        """Let a lesson's files be a recording, and learn from it."""
        assert self._requested is not None
        name, speed_mm_s = self._requested
        listed, n = self._content["recordings"], 1
        while (self._folder / name / f"touch-{n}").exists():
            n += 1
        place = Path(name, f"touch-{n}")
        (self._folder / name).mkdir(exist_ok=True)
        self._partial.rename(self._folder / place)
        first, last, runs = zip(*lesson.runs, strict=True)
        zero_s = lesson.zero_s + lesson.period_s / 2  # frames lie between the edges
        video = (place / layouts.VIDEO).as_posix()
        entry: dict[str, Any] = {"video": video, "texture": name, "repetition": place.name}
        entry |= {"steady_s": [round(first[0] - zero_s, 6), round(last[-1] - zero_s, 6)]}
        entry |= {"audio": (place / layouts.AUDIO).as_posix()} if self._sample_rate_hz else {}
        entry |= {} if speed_mm_s is None else {"speed_mm_s": speed_mm_s}
        if not (self._folder / SENSOR).exists():
            files.write_text(self._folder / SENSOR, sensor_toml(self._sensor))
        content = self._content | {"recordings": [*listed, entry]}
        files.write_json(self._folder / session_file.SESSION_FILE, content)
        self._content = content
        labels = {dims.TEXTURE: name, "name": str(place), dims.SPEED: speed_mm_s or math.nan}
        of_sample, times = SOURCE.encoding.sample_dims, (np.array(first), np.array(last))
        self._samples.append(make_samples(np.stack(runs), of_sample, *times, labels))
        self._solve()
        again = f", the touch of number {n}" if n > 1 else ""
        self._stand_by(f"'{name}' was learnt from {last[-1] - first[0]:.1f} s{again}")

    @contextmanager
    def _forgetting_faults(self) -> Iterator[None]:
        """Let a lesson that can't be recorded or learnt from be none, and report why."""
        try:
            with files.naming(self._partial):
                yield
        except (InputError, OSError) as error:
            name = self._requested[0] if self._requested else ""
            files.remove(self._partial)
            self._stand_by(f"'{name}' was not learnt: {error}")

    def _stand_by(self, what: str) -> None:
        """Wait for the next lesson, and report what became of the last."""
        self._requested, self._lesson, self._ending, self._last = None, None, False, what
        if self.reporter is not None:
            self.reporter.note(what)
