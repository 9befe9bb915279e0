"""Make folders in the two layouts in which an arm's fingertip is kept, for docs/your-data.md.

    python scripts/arm_folders.py FOLDER
    python scripts/arm_folders.py FOLDER --sweep

`FOLDER/streams/train` is one of tactile-bench, `FOLDER/runs` one of time series, and
`FOLDER/swept` one whose speed changes within each run. The pictures are
those of the simulated rig; pose and force have clocks of their own, so far off and drifting.
"""

import argparse
import csv
import shutil
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.rig import Rig, bumped_surface, project
from afferents.rig.camera import Renderer
from afferents.rig.drive import STEADY_S, Slide, Turning, draw_slides
from afferents.rig.run import draw, press, seen, simulate_run
from afferents.rig.skin import PHYSICS_RATE_HZ

FPS = 90
PRESS_S, DEPTH_MM, OFF_MM = 1.6, 1.2, 3.0
"""Of a press: how long it takes with the way there and back, how deep it goes, and from how far."""
ROBOT_HZ, FORCE_HZ = 125, 500
ROBOT_UPTIME_S, COMPUTER_UPTIME_S = 4000.0, 90000.0

Floats = NDArray[np.float64]


def write_images(folder: Path, position_px: Floats, rig: Rig, name: str, seed: int = 0) -> None:
    """Write a picture a frame, whose names `name` makes of their numbers."""
    folder.mkdir(parents=True)
    renderer = Renderer(rig.camera, seed)
    for n, place in enumerate(position_px):
        cv2.imwrite(str(folder / name.format(n)), renderer.draw(place))


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([columns, *rows])


def slide(rig: Rig, spacing: float, speed_mm_s: float, seconds: float) -> Floats:
    """Return where the camera sees the pins, (frame, pin, 2), px, while a drum of bumps turns."""
    surface = bumped_surface(spacing, rig.drum)
    run = simulate_run(rig, f"{spacing:g}", surface, speed_mm_s, seconds, seed=0)
    return project(run.position_mm, rig.camera)


def write_streams(part: Path, spacings: Sequence[float] = (2.0, 4.0), seconds: float = 0.5) -> None:
    """Write a part of tactile-bench: an image at rest, streams, and a still without one."""
    rig, rows = Rig(), [["0.png", "reference", 0.0, 0.0]]
    stills = part / "tactile_images"
    for number, spacing in enumerate(spacings, start=1):
        places = slide(rig, spacing, 50.0, STEADY_S + seconds)
        steady = places[round(STEADY_S * FPS) :]
        if number == 1:
            write_images(stills / "rest", places[3:4], rig, "{}.png")
            (stills / "rest/0.png").rename(stills / "0.png")
            (stills / "rest").rmdir()
        write_images(stills / f"{number}", steady, rig, "{:04}.png", number)
        times = [
            (f"{n:04}.png", 1.7e9 + number + n / FPS, n / FPS, n / FPS, 10 * n)
            for n in range(len(steady))
        ]
        columns = ("image", "real_time", "real_elapsed", "sim_elapsed", "sim_steps")
        write_csv(stills / f"{number}/timestamps.csv", columns, times)
        shutil.copy(stills / f"{number}/{len(steady) - 1:04}.png", stills / f"{number}.png")
        rows.append([f"{number}.png", f"bumps_{spacing:g}", 1.0 + number, 5.0])
    shutil.copy(stills / "1.png", stills / f"{len(rows)}.png")
    rows.append([f"{len(rows)}.png", "bumps_2", 9.0, 5.0])
    write_csv(part / "targets.csv", ("tactile_images", "class", "pose_z", "shear_x"), rows)


def pressed(rig: Rig, seconds: float) -> tuple[Floats, Floats, Floats]:
    """Press the tip on a smooth drum; return times (s), depth (mm) and pins (px) a frame."""
    drawn = draw(rig, "0", 10.0, 0)
    time_s = (np.arange(round((seconds + 0.2) * PHYSICS_RATE_HZ)) + 1) / PHYSICS_RATE_HZ
    share = np.sin(np.pi * np.clip((time_s - 0.6) / PRESS_S, 0, 1)) ** 2
    depth = share * (OFF_MM + DEPTH_MM) - OFF_MM
    still = np.zeros(len(time_s))
    turning = Turning(time_s, still + drawn.start_rad, still, depth - drawn.indentation_mm)
    frames_s = np.arange(round(seconds * FPS)) / FPS
    skin = press(rig, drawn, bumped_surface(0.0, rig.drum), turning, frames_s)
    return time_s, depth, project(seen(rig, skin), rig.camera)


def write_logs(
    folder: Path, began_s: float, z: tuple[Floats, Floats], offsets_s: tuple[float, float],
    drift: float, way: tuple[Floats, Floats],
) -> None:  # fmt: skip
    """Write pose and force of a run that began at a time of the images' clock.

    Parameters
    ----------
    z, way
        Times from there, s, and depth, and way along the surface, mm.
    offsets_s, drift
        How far the clocks of pose and force are ahead of the images' when that says
        `COMPUTER_UPTIME_S`, and by how much more each second.
    """
    rng = np.random.default_rng(round(began_s))
    length_s = z[0][-1]
    for name, rate_hz, offset_s in (
        ("robot_data", ROBOT_HZ, offsets_s[0] + ROBOT_UPTIME_S - COMPUTER_UPTIME_S),
        ("ft_sensor_data", FORCE_HZ, offsets_s[1]),
    ):
        at = np.arange(round(length_s * rate_hz)) / rate_hz
        own_s = began_s + at + offset_s + drift * (began_s + at - COMPUTER_UPTIME_S)
        depth = np.interp(at, *z)
        if name == "robot_data":
            columns = [f"actual_TCP_pose_{n}" for n in range(6)]
            place = [0.1 + np.interp(at, *way) / 1000, 0 * at, 0.2 - depth / 1000, *(0 * at,) * 3]
            values = np.stack(place, axis=1) + 1e-6 * rng.normal(size=(len(at), 6))
        else:
            columns = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"]
            values = 0.02 * rng.normal(size=(len(at), 6))
            values[:, 2] -= 2 * np.maximum(depth, 0) ** 1.5
        write_csv(folder / f"{name}.csv", ["timestamp", *columns], np.column_stack([own_s, values]))


def write_runs(
    root: Path, offsets_s: tuple[float, float] = (0.02, 0.005), drift: float = 50e-6,
    spacings: Sequence[float] = (2.0, 4.0), seconds: float = 0.4, apart_s: float = 60.0,
    sweep: Sequence[Slide] = (),
) -> None:  # fmt: skip
    """Write runs, with a press before them; of the last, the pictures in a zip file.

    With a `sweep` there is a run of each of its slides on each texture, whose speed changes.
    """
    rig, rows = Rig(), []
    runs = [(spacing, slide) for spacing in spacings for slide in sweep or (None,)]
    for number, (spacing, swept) in enumerate([(0.0, None), *runs]):
        folder, began_s = root / f"run_{number}", COMPUTER_UPTIME_S + 1 + number * apart_s
        if number == 0:
            time_s, depth, places = pressed(rig, 2.8)
            z, way, speed = (time_s, depth), (time_s, 0 * time_s), "0"
        else:
            length_s, speed = STEADY_S + seconds, "" if swept else "50"
            surface = bumped_surface(spacing, rig.drum)
            run = simulate_run(
                rig, f"{spacing:g}", surface, 50.0, length_s, 0, number if swept else 0, swept
            )
            places = project(run.position_mm, rig.camera)
            ends_s = len(places) / FPS
            z, way = (
                (np.array([0.0, ends_s]), np.full(2, 1.0)),
                (np.array([0.0, 9.0]), np.array([0.0, 450.0])),
            )
            if run.arm is not None:
                at_s, x_m, _, z_m = run.arm[0][:, :4].T
                z, way = (at_s, -1000 * z_m), (at_s, 1000 * x_m)
            events = [("start", 0.3), ("shear_start", STEADY_S), ("shear_end", ends_s - 0.05)]
            write_csv(
                folder / "control_data.csv", ("timestamp", "event"),
                [(began_s + at, name) for name, at in events],
            )  # fmt: skip
        images = folder / "time_series_images"
        write_images(images, places, rig, "image_{}.png", number)
        write_csv(
            folder / "image_data.csv", ("frame_id", "timestamp", "time_series_images"),
            [
                (n, began_s + n / FPS, f"run_{number}/time_series_images/image_{n}.png")
                for n in range(len(places))
            ],
        )  # fmt: skip
        write_logs(folder, began_s, z, offsets_s, drift, way)
        rows.append([f"run_{number}", f"bumps_{spacing:g}", speed, 0.0])
    with zipfile.ZipFile(images.with_suffix(".zip"), "w") as archive:
        for path in sorted(images.iterdir()):
            archive.write(path, f"time_series_images/{path.name}")
            path.unlink()
    images.rmdir()
    columns = ("tactile_images", "class", "linear_speed", "angular_speed")
    write_csv(root / "targets.csv", columns, rows)


def main() -> None:
    """Write the folders that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="where to make them")
    parser.add_argument(
        "--sweep", action="store_true",
        help="runs alone, three on each of three textures, at speeds between 20 and 80 mm/s",
    )  # fmt: skip
    given = parser.parse_args()
    if given.sweep:
        rng = np.random.default_rng(0)
        slides = [Slide(20.0, 80.0, False, *row) for row in draw_slides(3, 1.0, rng).tolist()]
        write_runs(given.folder / "swept", spacings=(2.0, 4.0, 6.0), seconds=6.0, sweep=slides)
    else:
        write_streams(given.folder / "streams/train")
        write_runs(given.folder / "runs")


if __name__ == "__main__":
    main()
