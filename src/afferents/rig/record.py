"""Recording the rig: a run becomes a folder with its video, sound, logs and truth.

Videos are JPEGs in mp4, as cameras give them, with the times at which the frames were taken. A
frame is coded by itself. So no motion is held back, as by encoders that skip what hardly changed,
and the marker noise of the camera arrives as it was drawn.
"""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.files import holds_only, write_aside
from afferents.recordings.tactile_bench import LOGS
from afferents.rig import config, drive, microphone, run
from afferents.rig.camera import Renderer, RigCamera, project
from afferents.rig.surface import Surface
from afferents.store.drum_path import CONTACT_MM, DRIVE, MARK, Drum
from afferents.store.log import write_log
from afferents.store.recording import GreyImage

_TICKS_HZ = 90_000
_TIME_BASE = Fraction(1, _TICKS_HZ)
VIDEO, AUDIO, TRUTH, REFERENCE = "video.mp4", "audio.wav", "truth.npz", "throw_away.mp4"
TIME, ARM_LOGS = "timestamp", tuple(str(log["file"]) for log in LOGS)
"""Of the logs of an arm: pose and force."""
RECORDED = holds_only(VIDEO, AUDIO, TRUTH, DRIVE, REFERENCE, *ARM_LOGS)
"""Says which folder is an earlier recording, that may be replaced."""
_TIP = 361
"""There is one fingertip: how its markers look is drawn from this seed, and no other."""
REFERENCE_S = 0.5
"""Length of the reference clip of the skin at rest, s."""


def write_film(path: Path, frames: Iterable[tuple[float, GreyImage]], camera: RigCamera) -> None:
    """Write a video.

    Parameters
    ----------
    frames
        Time in s (kept to 1/90000 s, ascending) and grey image (height, width) of each frame.

    Raises
    ------
    OSError
        If the disk is full.
    """
    options = dict.fromkeys(("video_track_timescale", "movie_timescale"), str(_TICKS_HZ))
    quality = [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg_quality]
    with av.open(f"file:{path}", "w", format="mp4", options=options) as container:
        # an encoder that has nothing to do: PyAV has streams without one only since 17
        stream = container.add_stream("mjpeg", round(camera.fps_hz), options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = camera.width, camera.height, "yuvj420p"
        stream.time_base = _TIME_BASE
        for time_s, image in frames:
            _, data = cv2.imencode(".jpg", image, quality)
            packet = av.Packet(data.tobytes())
            packet.stream, packet.time_base = stream, _TIME_BASE
            packet.pts = packet.dts = round(time_s * _TICKS_HZ)
            packet.is_keyframe = True
            container.mux(packet)


def record(
    rig: config.Rig,
    folder: Path,
    texture: str,
    surface: Surface,
    speed_mm_s: float,
    seconds: float,
    seed: int,
    reference: bool = False,
    again: int = 0,
    slide: drive.Slide | None = None,
) -> None:
    """Run a drum at a speed and write the recording, whole or not at all.

    Of a sweep it holds the logs of an arm in place of the drive's.

    Parameters
    ----------
    folder
        `<texture>/<speed>` of a session.
    reference
        Whether the clip of the skin at rest is written next to it, as in the published session's
        first folder.
    again, slide
        As of `simulate_run`.

    Raises
    ------
    InputError
        As `simulate`; if a pin leaves the picture; if the sound is louder than full scale.
    OSError
        If the disk is full.
    """
    made = run.simulate_run(rig, texture, surface, speed_mm_s, seconds, seed, again, slide)
    position_px = project(made.position_mm, rig.camera)
    radius = rig.camera.marker_diameter_mm * rig.camera.px_per_mm / 2
    size = np.array([rig.camera.width, rig.camera.height])
    outside = ((position_px < radius) | (position_px > size - 1 - radius)).any(axis=(0, 2))
    if outside.any():
        raise InputError(
            f"{folder}: expected pins that stay in the picture, found {int(outside.sum())} that "
            "leave it; press less deep, or lower px_per_mm"
        )
    filmed_px = filmed_positions(rig, made.position_mm, texture, speed_mm_s, seed, again)
    with write_aside(folder, RECORDED) as partial:
        partial.mkdir()
        films = [(VIDEO, texture, speed_mm_s, len(made.time_s))]
        if reference:
            films.append((REFERENCE, "rest", 1, round(REFERENCE_S * rig.camera.fps_hz)))
        others = run.distinguish_run(rig, seed, again)
        for name, shown, speed, n in films:
            rng = run.make_generator(seed, shown, speed, run.CAMERA, others)
            renderer = Renderer(rig.camera, int(rng.integers(2**31)))
            frames = zip(made.time_s[:n].tolist(), map(renderer.draw, filmed_px[:n]), strict=True)
            write_film(partial / name, frames, rig.camera)
        microphone.write_wav(partial / AUDIO, made.room, made.sensor)
        if made.arm is None:
            write_way(partial / DRIVE, made, rig.drum.diameter_mm)
        else:
            write_arm(partial, *made.arm)
        write_truth(partial / TRUTH, made, position_px)


def filmed_positions(
    rig: config.Rig,
    position_mm: NDArray[np.float64],
    texture: str,
    speed_mm_s: float,
    seed: int,
    again: int = 0,
) -> NDArray[np.float64]:
    """Return where the pins appear in the picture, (n_frames, n_nodes, 2), px: with the noise."""
    camera = rig.camera
    true_px = project(position_mm, camera)
    unequal = np.random.default_rng(_TIP).standard_normal(true_px.shape[1])
    size = camera.marker_noise_px * np.exp(camera.marker_unequal * unequal)
    others = run.distinguish_run(rig, seed, again)
    rng = run.make_generator(seed, texture, speed_mm_s, run.MARKERS, others)
    return np.asarray(true_px + rng.standard_normal(true_px.shape) * size[:, None])


def write_truth(path: Path, made: run.Simulated, position_px: NDArray[np.float64]) -> None:
    """Write the ground truth of a run.

    `time` (frame) in s on the video's clock, `position` (frame, marker, 2) in px as the camera
    sees it, markers row by row, `drum_angle_rad` (frame), `speed_mm_s` (frame) and `pressure`
    (frame, marker) in mN; positions and pressures to 1/1024.
    """
    truth: dict[str, NDArray[np.floating]] = {
        "time": made.time_s,
        "position": _rounded(position_px),
        "drum_angle_rad": made.angle_rad,
        "speed_mm_s": made.speed_mm_s,
        "pressure": _rounded(made.pressure_mn),
    }
    # As np.savez_compressed, but quick: its level takes four times as long for files 2% smaller.
    with ZipFile(path, "w", ZIP_DEFLATED, compresslevel=1) as archive:
        for name, values in truth.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, values, allow_pickle=False)


def write_way(path: Path, made: run.Simulated, diameter_mm: float) -> None:
    """Write the drum's way as a recorder logs it: of an encoder without error, read every frame."""
    position_mm = made.angle_rad * diameter_mm / 2
    rows = zip(made.time_s, position_mm, made.speed_mm_s, strict=True)
    drum = Drum(circumference_mm=np.pi * diameter_mm, contact_mm=CONTACT_MM, zero=MARK)
    write_log(path, ("time_s", "position_mm", "speed_mm_s"), rows, 0.0, drum)


def write_arm(folder: Path, *logs: NDArray[np.float64]) -> None:
    """Write an arm's pose and force as the group that made the fingertip does (`tactile_bench`)."""
    wrench = [f"{what}_{axis}" for what in ("force", "torque") for axis in "xyz"]
    for file, columns, rows in zip(ARM_LOGS, (LOGS[0]["columns"], wrench), logs, strict=True):
        head = ",".join([TIME, *columns])
        np.savetxt(folder / file, rows, "%.7f", ",", header=head, comments="")


def _rounded(value: NDArray[np.floating]) -> NDArray[np.float32]:
    """Keep thousandths (1/1024): what no camera sees only costs disk."""
    return np.asarray(np.rint(value * 1024) / 1024, np.float32)
