"""Write the checksums of the packaged tasks' folds, from the names of all their recordings.

    python scripts/seal_tasks.py

Needs no data: FabricSlide's names are those of the list that `fetch` checks, those of the other
sets follow from what their authors recorded.
"""

import hashlib
import json
import tempfile
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import xarray as xr

from afferents.benchmark.tasks import TASKS, Task, all_tasks, data_infos, seal_text
from afferents.files import write_text
from afferents.recordings.described import PACKAGED, Described
from afferents.recordings.fetch import public_sets
from afferents.store.recording import LETTERS, name_folder
from afferents.store.responses import Responses, labels_of


def named_by_files(data: str, paths: list[str]) -> list[Responses]:
    """Return what the names of a described set's files say; the files are empty."""
    with tempfile.TemporaryDirectory() as folder:
        for path in paths:
            (Path(folder) / path).parent.mkdir(parents=True, exist_ok=True)
            (Path(folder) / path).touch()
        found = Described(folder, PACKAGED[data]).scan().recordings
    return [xr.Dataset(attrs={"name": one.name, **labels_of(one)}) for one in found]


def drums(letters: str, speeds: list[int]) -> list[Responses]:
    """Return drums at some speeds, as stores name them."""
    return [
        xr.Dataset(attrs={"name": f"{drum}/{speed}", "texture": drum, "speed_mm_s": float(speed),
                          "conditions": json.dumps({})})
        for drum, speed in product(map(name_folder, letters), speeds)
    ]  # fmt: skip


def recordings_of(data: str) -> list[Responses] | None:
    """Return all recordings of a data set without their content; None where no list is known."""
    if data == "fabricslide":
        listed = public_sets()[data].manifest.read_text().splitlines()
        return named_by_files(data, [line.split()[0] for line in listed if "data/fabric/" in line])
    if data == "ntp":
        return named_by_files(data, list(_ntp()))
    if data == "pestell2022":
        return drums("".join(LETTERS), list(range(10, 101, 10)))
    if data == "rig":
        made = data_infos()[data].made
        return drums("".join(made["textures"]), made["speeds_mm_s"])
    return None


def _ntp() -> Iterator[str]:
    """Yield the names of NTP's files: 21 textures, 5 speeds in mm/min, 4 forces."""
    kinds = [f"{family}{number}" for family in ("00", "01", "02", "03") for number in range(1, 6)]
    for texture, speed, force in product(
        ["000", *kinds], (1200, 2400, 3600, 4800, 6000), ("0.0", "0.5", "1.0", "1.5")
    ):
        yield (
            f"data/processed/Texture{texture}/Data[Texture({texture})][Speed({speed})]"
            f"[Force({force})][Trial(1)].csv"
        )


def sealed(task: Task) -> tuple[str, str]:
    """Return the checksums of a task's folds and data; empty where these are not known by name."""
    recordings = recordings_of(task.data)
    if recordings is None:
        return "", ""
    return task.checksum_of(recordings), fingerprint_of(task.data)


def fingerprint_of(data: str) -> str:
    """Return the fingerprint of a described set whose files' checksums are listed; else nothing."""
    manifest = public_sets()[data].manifest if data in public_sets() else None
    if manifest is None:
        return ""
    listed = [line.split() for line in manifest.read_text().splitlines() if "data/fabric/" in line]
    digest = hashlib.sha256()  # as `RecordingSet.checksum` has it
    for path, sha256, _ in sorted(listed):
        digest.update(f"{Path(path).stem}:{sha256}\n".encode())
    return digest.hexdigest()


if __name__ == "__main__":
    for name, task in all_tasks().items():
        path = TASKS / f"{name}.toml"
        write_text(path, seal_text(path.read_text(), *sealed(task)))
        print(name, *(found[:8] or "not known" for found in sealed(task)))
