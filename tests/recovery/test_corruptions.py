"""Files damaged at random: each is refused in one sentence, or still says what it may say.

Every kind of file that the package reads back is damaged in ways drawn from a seed: bits flipped,
cut off, emptied, a value replaced by one of another kind, a key taken out, brackets nested deep.
"""

import json
import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from afferents.errors import AfferentsError
from afferents.evaluation.data import join_recordings, open_data
from afferents.evaluation.results import load_results
from afferents.markers.sensor import load_sensor
from afferents.models.folder import load_model
from afferents.progress import Progress
from afferents.recordings.audio import WavFile
from afferents.recordings.data_sets import data_set_of, read_session
from afferents.recordings.video import open_video
from afferents.reproduction.status import status
from afferents.store.responses import read_whole

CASES_A_KIND = 20
QUIET = Progress(quiet=True)
STRANGE = (None, True, -1, 0, 1e308, float("nan"), float("inf"), "", "x", [], {}, [1], "9" * 5000)

pytestmark = pytest.mark.slow


def damaged(content, rng):
    """Return the bytes of a file with something wrong in them."""
    way = rng.randrange(5)
    if way == 0:
        return content[: rng.randrange(len(content))]
    if way == 1:
        return rng.randbytes(len(content) // 2)
    if way == 2:
        return b"[" * 100_000
    changed = bytearray(content)
    for _ in range(rng.choice((1, 8, 100))):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def strange(content, rng):
    """Return a JSON document with one value replaced, or one key taken out."""
    document = json.loads(content)
    place = document
    while True:
        keys = list(place) if isinstance(place, dict) else range(len(place))
        key = rng.choice(list(keys))
        inside = place[key]
        if isinstance(inside, dict | list) and inside and rng.random() < 0.7:
            place = inside
            continue
        if isinstance(place, dict) and rng.random() < 0.3:
            del place[key]
        else:
            place[key] = rng.choice(STRANGE)
        return json.dumps(document).encode()


def read_store(store):
    data = open_data([str(store)])
    for responses in join_recordings(data):
        for name in responses.data_vars:
            read_whole(responses, str(name))


def read_audio(path):
    for channel in (0, 1):
        WavFile(path, channel).read()


def read_video(path):
    for _ in open_video(path).frames():
        pass


def read_slides(path):
    for recording in data_set_of(f"fabricslide:{path.parent}").scan().recordings:
        recording.audio.read()


def slides(folder):
    """Write one slide of FabricSlide's form."""
    names = ["timestamp", "proximity1", "proximity2", *(f"channel{n}" for n in range(1, 17))]
    rng = np.random.default_rng(0)
    rows = [[28 * n, 1, 2, *rng.integers(900, 1100, 16)] for n in range(150)]
    lines = [",".join(names), *(",".join(map(str, row)) for row in rows)]
    path = folder / "Linen_F120_V20mmps_1.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def whole(session, sounds, tmp_path_factory):
    """One of everything that is read back, whole."""
    from afferents.cli import run

    root = tmp_path_factory.mktemp("whole")
    shutil.copytree(sounds, root / "session")
    shutil.copy(next(session.glob("*/*/video.mp4")), root / "v.mp4")
    shutil.copy(Path(load_sensor.__code__.co_filename).parent / "sensors/tip_b.toml", root)
    for command in (
        ("extract", root / "session", root / "s.zarr", "--quiet"),
        ("evaluate", root / "s.zarr", "--out", root / "r", "--models", "vib-te", "--quiet"),
        ("train", root / "s.zarr", root / "m", "--model", "vib-te", "--preset", "quick", "--quiet"),
    ):
        run(list(map(str, command)))
    slides(root)
    return root


FOLD = "r/folds/vib-te/nested/seed-0/30"
KINDS = {
    "session.json": ("session/session.json", lambda root: read_session(root / "session")),
    "sensor file": ("tip_b.toml", lambda root: load_sensor(str(root / "tip_b.toml"))),
    "wav": ("session/2/30/audio.wav", lambda root: read_audio(root / "session/2/30/audio.wav")),
    "video": ("v.mp4", lambda root: read_video(root / "v.mp4")),
    "slide": ("Linen_F120_V20mmps_1.csv", lambda root: read_slides(root / "x.csv")),
    "store": ("s.zarr/zarr.json", lambda root: read_store(root / "s.zarr")),
    "recording": ("s.zarr/2/30/zarr.json", lambda root: read_store(root / "s.zarr")),
    "array": ("s.zarr/2/30/ra2/zarr.json", lambda root: read_store(root / "s.zarr")),
    "chunk": ("s.zarr/2/30/ra2/c/0/0", lambda root: read_store(root / "s.zarr")),
    "summary": ("r/summary.json", lambda root: load_results(root / "r")),
    "configuration": ("r/config.json", lambda root: load_results(root / "r")),
    "predictions": ("r/predictions.parquet", lambda root: load_results(root / "r")),
    "plan": ("r/plan.json", lambda root: status(root / "r")),
    "fold": (f"{FOLD}/fold.json", lambda root: status(root / "r")),
    "card": ("m/model.json", lambda root: load_model(root / "m")),
    "weights": ("m/weights.safetensors", lambda root: load_model(root / "m")),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_refused_in_a_sentence_or_read(whole, tmp_path, kind):
    name, read = KINDS[kind]
    read(whole)  # whole, it is read
    root = shutil.copytree(whole, tmp_path / "root")
    content = (root / name).read_bytes()
    sentences = []
    for number in range(CASES_A_KIND):
        rng = random.Random(f"{kind} {number}")
        change = strange if name.endswith("json") and number % 2 else damaged
        (root / name).write_bytes(change(content, rng))
        try:
            read(root)
        except AfferentsError as error:
            sentences.append(str(error))
    assert not [said for said in sentences if "\n" in said or "expected" not in said]
    assert len(sentences) > CASES_A_KIND / 4
