"""The two layouts in which the paper's group keeps optical fingertips on arms, since 2025.

*Streams* (tactile-bench, 2026): ``train/`` and ``val/``, each with ``targets.csv`` (a row an image:
`tactile_images`, `class`, poses, mm and degrees), ``tactile_images/0.png`` (the skin at rest),
``1.png`` (the last image of sample 1) and, where sample 1 was filmed, ``1/0000.png ...`` with
``1/timestamps.csv``. A stream begins when the skin is pressed already.

*Runs* (time series, 2025): ``targets.csv`` (a row a run, with `linear_speed`, mm/s), ``run_0/``, a
press by which clocks are set, and ``run_N/`` with ``time_series_images/`` (or a zip of that name),
``image_data.csv``, ``ft_sensor_data.csv``, ``robot_data.csv`` and ``control_data.csv``.

Written by their description; not tried on real folders.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
import pandas as pd

from afferents.errors import InputError, reading
from afferents.recordings.media import named
from afferents.recordings.pictures import TIME_COLUMNS, ImageFolder, times_beside
from afferents.recordings.session import PublishedSession
from afferents.recordings.session_file import SESSION_FILES, SessionFile, parse_declaration
from afferents.store.log import LoggedFile
from afferents.store.motion import differentiate

TARGETS, STILLS, PARTS = "targets.csv", "tactile_images", ("train", "val")
TEXTURE, AT_REST = "class", "reference"
IMAGES, IMAGE_TIMES, EVENTS = "time_series_images", "image_data.csv", "control_data.csv"
LOGS: Sequence[Mapping[str, Any]] = (
    {
        "name": "pose",
        "file": "robot_data.csv",
        "columns": [f"actual_TCP_pose_{n}" for n in range(6)],
        "units": "m, rad",
    },
    {
        "name": "force",
        "file": "ft_sensor_data.csv",
        "columns": ["force_x", "force_y", "force_z"],
        "units": "N",
    },
)
"""What is kept alongside; torque is not, whose unit is not known."""
MOVING = 0.5
"""Share of the fastest from which on an arm slides, where only its poses say how fast."""
UNEVEN = 0.2
"""Share of the usual speed by which the fastest and the slowest tenth may differ, to be one speed.
"""
_RUN = re.compile(r"run_(\d+)")


def _read_targets(root: Path, *needed: str) -> list[dict[str, str]]:
    """Return the rows of ``targets.csv``, without cells that are empty: none of those needed."""
    path = root / TARGETS
    with reading(path, "a readable CSV file"):
        table = pd.read_csv(path, dtype=str, skipinitialspace=True)
    rows = [{str(k): str(v) for k, v in r.items() if v == v} for r in table.to_dict("records")]
    for number, row in enumerate(rows, start=2):
        if lacking := [name for name in needed if name not in row]:
            raise InputError(
                f"{path}, line {number}: expected a cell in the column '{lacking[0]}', found "
                f"{', '.join(row) or 'none'}; rename the column that it is, or fill it in"
            )
    return rows


def _find_conditions(row: Mapping[str, str], *without: str) -> dict[str, float]:
    """Return what of a row are finite numbers, but for these columns."""
    numbers = pd.to_numeric(pd.Series(row, dtype=str), errors="coerce")
    return {str(k): float(v) for k, v in numbers.items() if np.isfinite(v) and k not in without}


def _has_targets(path: Path) -> bool:
    """Return whether targets are there, and no session file, which goes before."""
    return (path / TARGETS).is_file() and not any((path / name).is_file() for name in SESSION_FILES)


def _is_streams(path: Path) -> bool:
    return (path / STILLS).is_dir() and _has_targets(path)


def _find_runs(path: Path) -> dict[int, Path]:
    """Return the runs of a folder by number; of another none."""
    if not _has_targets(path):
        return {}
    found = {int(m[1]): one for one in path.iterdir() if (m := _RUN.fullmatch(one.name))}
    return dict(sorted(found.items()))


def _require_one_layout(path: Path) -> None:
    if _is_streams(path) and (runs := _find_runs(path)):
        raise InputError(
            f"{path}: expected streams ({STILLS}/) or runs (run_1/), found both ({STILLS}/ and "
            f"{named(path, list(runs.values()))}); move one kind into a folder of its own, each "
            f"with its {TARGETS}"
        )


def _declare(
    recordings: Sequence[Mapping[str, Any]], root: Path, notes: Sequence[str], **more: Any
) -> SessionFile:
    declared = parse_declaration({"recordings": recordings, **more}, root / TARGETS)
    declared._file, declared._notes = TARGETS, tuple(notes)
    return declared


class Streams(PublishedSession):
    """A folder of tactile-bench: a recording a stream, from the image at rest; see the module."""

    name, title, drafted = "tactile-bench", "streams of tactile-bench", False

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether there are targets and images, here or in a part."""
        return any(map(_is_streams, (path, *(path / part for part in PARTS))))

    def declared(self) -> SessionFile:
        """Name the streams, their classes and poses."""
        if not _is_streams(self.path):
            parts = [str(self.path / part) for part in PARTS if _is_streams(self.path / part)]
            raise InputError(
                f"{self.path}: expected one part, which has a {STILLS}/0.png of its own, found "
                f"{' and '.join(parts) or 'none'}; give such a part: several stores can be learnt "
                "from together"
            )
        _require_one_layout(self.path)
        stills, without, recordings, rests = self.path / STILLS, [], [], []
        for row in _read_targets(self.path, STILLS, TEXTURE):
            image = PureWindowsPath(row[STILLS])
            if row[TEXTURE] == AT_REST:
                rests.append(f"{STILLS}/{image.name}")
            elif (stream := stills / image.stem).is_dir():
                # All of a stream is steady, if a CSV says how long it is.
                times = times_beside(stream)
                steady = {"steady_s": (0.0, ImageFolder(stream).duration_s)} if times else {}
                recordings.append({
                    "id": image.stem,
                    "video": f"{STILLS}/{image.stem}",
                    "texture": row[TEXTURE],
                    "rest_frame": 0,
                    **steady,
                    "conditions": _find_conditions(row, TEXTURE, STILLS),
                })  # fmt: skip
            elif (stills / image.name).is_file():
                without.append(Path(image.name))
            else:
                raise InputError(
                    f"{self.path / TARGETS}: expected images that are there, found {image.name}, "
                    f"which is not in {STILLS}/; copy them again, or take its row out"
                )
        if len(rests) != 1:
            raise InputError(
                f"{self.path / TARGETS}: expected one row of the class '{AT_REST}', the skin at "
                f"rest, found {len(rests)}; a stream begins when the skin is pressed already"
            )
        if not recordings:
            raise InputError(
                f"{self.path}: expected streams ({STILLS}/1/0000.png), found stills alone "
                f"({named(Path(), without)}), which have no RA-I; record streams"
            )
        notes = [
            f"Of {len(without) + len(recordings)} samples {len(without)} are stills without a "
            f"stream ({named(Path(), without)}): they have no RA-I, and are left out."
        ] * bool(without)
        return _declare(recordings, self.path, notes, reference=rests[0], rest="reference")


class Runs(PublishedSession):
    """A folder of runs: pictures, force and pose, whose clocks the press of run_0 sets."""

    name, title, drafted = "tactip-runs", "runs of a fingertip on an arm", False

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether there are targets and runs."""
        return bool(_find_runs(path))

    def declared(self) -> SessionFile:
        """Name the runs, their speeds, and what was logged alongside."""
        _require_one_layout(self.path)
        runs = _find_runs(self.path)
        press = self._files_of(runs.pop(0), list(LOGS)) if 0 in runs else None
        logs = [log for log in LOGS if press and (self.path / "run_0" / log["file"]).is_file()]
        recordings, without = [], []
        for number, row in self._row_of_each(list(runs), press is not None):
            folder = runs[number]
            files = self._files_of(folder, logs)
            without += [folder] if len(files["beside"]) < len(LOGS) else []
            speed = _find_conditions(row).get("linear_speed") or self._speed_mm_s(folder)
            recordings.append({
                **files,
                "id": folder.name,
                "texture": row[TEXTURE],
                **({"speed_mm_s": abs(speed)} if speed else {}),
                **self._steady(folder, files),
                "conditions": _find_conditions(row, TEXTURE, "linear_speed"),
            })  # fmt: skip
        if not recordings:
            raise InputError(
                f"{self.path}: expected run_1 and others next to the press, found none; copy them"
            )
        more: dict[str, Any] = {}
        if press:
            more = {"press": {**press, "texture": "press", "id": "run_0"}}
            first = next(iter(ImageFolder(self.path / press["video"], 1.0).numbered.values()))
            if isinstance(first, Path):  # it shows the skin at rest; one in a zip is no file
                more["reference"] = first.relative_to(self.path).as_posix()
        notes = [
            f"Pose or force of {len(without)} of {len(recordings)} runs is not kept "
            f"({named(self.path, without)}): it is not there, or not in run_0, whose press sets "
            "its clock."
        ] * bool(without)
        return _declare(recordings, self.path, notes, **more)

    def _files_of(self, folder: Path, logs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Return what a session file would say of a run's files, of these logs those it has."""
        images = folder / IMAGES
        video = images if images.is_dir() else images.with_suffix(".zip")
        for path, what in ((video, "a folder or zip of images"), (folder / IMAGE_TIMES, "a CSV")):
            if not path.exists():
                raise InputError(
                    f"{path}: expected {what}, found none; copy the run again, or take it away "
                    f"with its row in {TARGETS}"
                )
        logged = [
            {**log, "file": f"{folder.name}/{log['file']}", "time": "timestamp"}
            for log in logs
            if (folder / log["file"]).is_file()
        ]
        return {
            "video": f"{folder.name}/{video.name}",
            "times": f"{folder.name}/{IMAGE_TIMES}",
            "beside": logged,
        }

    def _row_of_each(
        self, runs: Sequence[int], has_press: bool
    ) -> Iterator[tuple[int, dict[str, str]]]:
        """Yield each run but the press and its row: the one that names it, else in order."""
        rows = _read_targets(self.path, TEXTURE)
        found = [next(filter(None, map(_RUN.search, row.values())), None) for row in rows]
        if all(found):
            by_number = {int(m[1]): row for m, row in zip(found, rows, strict=True) if m}
        else:
            own = rows[1:] if has_press and len(rows) == len(runs) + 1 else rows
            if len(own) != len(runs):
                raise InputError(
                    f"{self.path / TARGETS}: expected a row for each of {len(runs)} runs, found "
                    f"{len(own)}; name the run in each row, or take away what has no other"
                )
            by_number = dict(zip(runs, own, strict=True))
        by_number.pop(0, None)
        if odd := sorted(by_number.keys() ^ set(runs)):
            raise InputError(
                f"{self.path / TARGETS}: expected a row for each run and a run for each row, found "
                f"run_{odd[0]} without the other; take it out, or bring the other back"
            )
        yield from sorted(by_number.items())

    def _speed_mm_s(self, folder: Path) -> float | None:
        """Return how fast the arm slid, mm/s, to two digits, by its poses.

        None without any, and where the speed changed: then the store keeps it as a series.
        """
        path = folder / LOGS[0]["file"]
        if not path.is_file():
            return None
        log = LoggedFile("pose", path, "timestamp", tuple(LOGS[0]["columns"][:3]), "m")
        time_s, place_m = log.read()
        speed = 1000 * differentiate(time_s, place_m, path).values
        sliding = speed[speed >= MOVING * np.percentile(speed, 95)]
        slow, usual, fast = map(float, np.percentile(sliding, (10, 50, 90)))
        is_steady = usual > 0 and fast - slow <= UNEVEN * usual
        return float(f"{usual:.2g}") if is_steady else None

    def _steady(self, folder: Path, files: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
        """Return the steady part by the control's events, on the clock of the images; else none."""
        path = folder / EVENTS
        if not path.is_file():
            return {}
        with reading(path, "a readable CSV file"):
            table = pd.read_csv(path, skipinitialspace=True)
        clock = next((name for name in TIME_COLUMNS if name in table), None)
        at: dict[str, float] = {}
        for row in table.to_dict("records") if clock else ():
            at |= {v: float(row[clock]) for v in row.values() if isinstance(v, str)}
        names = ("shear_start", "shear_end") if "shear_start" in at else ("start", "end")
        if not all(name in at for name in names):
            raise InputError(
                f"{path}: expected a column of times ({', '.join(TIME_COLUMNS)}) and events "
                "'start' and 'end', or 'shear_start' and 'shear_end', found "
                f"{', '.join(map(str, table))} with {', '.join(at) or 'none'}; rename them, or "
                "take the file away"
            )
        images = ImageFolder(self.path / files["video"], None, self.path / files["times"])
        start_s, stop_s = (at[name] - images.began_s for name in names)
        if not 0 <= start_s < stop_s <= images.duration_s:
            raise InputError(
                f"{path}: expected events within the {images.duration_s:.2f} s of the images, by "
                f"their clock, found {start_s:.2f} to {stop_s:.2f} s; mend them, or take the file "
                "away"
            )
        return {"steady_s": (start_s, stop_s)}
