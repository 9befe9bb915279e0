"""Our numbers beside the authors': arrays made as their notebooks make them, differences known."""

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.store import trimming

h5py = pytest.importorskip("h5py")

ROOT = Path(__file__).parents[3]
KERAS = ROOT / "tests/unit/models/keras"
TEXTURES, SPEED = ("1", "2"), "20"
REST, FIRST, LAST, AUDIO_S = 10, 20, 120, 1.5


@pytest.fixture(scope="module")
def store(tmp_path_factory, make_session):
    """Two recordings of 1.5 s, tracked as the authors did."""
    root = tmp_path_factory.mktemp("authors")
    session = make_session(root / "session", (1, 2), (int(SPEED),), seconds=AUDIO_S)
    afferents.extract(session, root / "s.zarr", method="published", workers=1, quiet=True)
    return root / "s.zarr"


@pytest.fixture(autouse=True)
def short_cut(monkeypatch):
    """The published cut of a recording of 1.5 s instead of 65 s."""
    monkeypatch.setattr(trimming, "FIRST_FRAME", FIRST)
    monkeypatch.setattr(trimming, "LAST_FRAME", LAST)
    monkeypatch.setattr(trimming, "AUDIO_S", AUDIO_S)


def their_images(firing, rest):
    """As process_static.ipynb: turned by -6.2 deg, sorted by x, then each column by y."""
    angle = np.deg2rad(-6.2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = rest @ turn.T
    by_x = np.argsort(turned[:, 0]).reshape(19, 19)
    order = np.stack([column[np.argsort(turned[column, 1])] for column in by_x])
    return firing[FIRST - REST : LAST - REST][:, order]


def their_spectra(sound):
    """As process_vibration.ipynb: windows of 1 s, half a second apart, 4000 bins."""
    rate = 8000
    starts = range(0, len(sound) - rate + 1, rate // 2)
    windows = np.stack([sound[start : start + rate] for start in starts])
    return 2 / rate * np.abs(np.fft.fft(windows))[:, :4000]


def in_turn(per_texture):
    """Samples (texture, time, ...) as (time * texture, ...), with the labels' one-hot code."""
    turned = np.stack(per_texture, axis=1)
    n = len(turned)
    return turned.reshape(-1, *turned.shape[2:]), np.tile(np.eye(len(TEXTURES)), (n, 1))


@pytest.fixture(scope="module")
def converted(store, tmp_path_factory):
    """What the script makes of pickles as the authors' notebooks leave them."""
    root = tmp_path_factory.mktemp("data")
    recordings = afferents.open_responses(store)
    order = np.random.default_rng(0).permutation(361)  # they name the markers otherwise
    nests = {name: [[np.zeros((1, 1))] * 10 for _ in range(13)] for name in ("pins", "SA", "RA")}
    images, spectra = [], []
    for recording, texture in zip(recordings, TEXTURES, strict=True):
        rest = recording.rest_position.values[order].astype(np.float64)
        sa1 = recording.sa1.values[REST:, order].astype(np.float64)
        ra1 = np.abs(np.diff(sa1, axis=0, prepend=0 * sa1[:1]))
        for name, values in (("pins", rest), ("SA", sa1), ("RA", ra1)):
            nests[name][2 * int(texture)][1] = values.copy()
        images.append(their_images(sa1, rest)[1::2])
        sound = recording.ra2.values[:, 0]
        spectra.append(their_spectra(sound[len(sound) - round(AUDIO_S * 8000) :]))
    nests["SA"][4][1][30, 7] += 0.25
    nests["pins"][2][1][0, 0] -= 0.125
    spectra = np.array(spectra) / np.max(spectra)
    spectra[1, 0, 50] += 0.5
    dump(root / "processed/pins.pkl", nests["pins"])
    dump(root / "processed/firing_SA.pkl", nests["SA"])
    dump(root / "firing_RA.pkl", nests["RA"])
    static, labels = in_turn(images)
    dump(root / "static/1/X_test_SA.pkl", static[..., None])
    dump(root / "static/1/y_test_SA.pkl", [np.zeros((len(labels), 1)), labels])
    vibration, labels = in_turn(spectra[:, ::-1, :200])
    dump(root / "processed/vibration/1/X_test.pkl", vibration[..., None])
    dump(root / "processed/vibration/1/y_test.pkl", labels)
    for folder, name in (("static_SA", "se"), ("vibration_augmented", "te")):
        network(root / "models" / folder / "1" / "model_07_0.51.hdf5", KERAS / f"{name}.hdf5")
    out = tmp_path_factory.mktemp("converted") / "c"
    script = ROOT / "scripts/convert_authors_arrays.py"
    subprocess.run([sys.executable, script, root, out], check=True, capture_output=True)
    return out


def dump(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(content))


def network(path, source):
    """A network that Keras saved, of which two textures are left."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(source.read_bytes())
    with h5py.File(path, "r+") as file:
        weights = file["model_weights"]
        last = weights[weights.attrs["layer_names"][-1]]
        for name in last.attrs["weight_names"]:
            values = last[name][..., : len(TEXTURES)]
            del last[name]
            last[name] = values


def test_the_largest_difference_of_each_stage_is_found(store, converted, run):
    code, out, err = run("compare", store, "--authors", converted, "--json")
    assert code == 0, err
    found = json.loads(out)
    stages = {one["stage"]: one for one in found["differences"]}
    largest = {name: (round(one["largest"], 4), one["where"]) for name, one in stages.items()}
    assert largest["tracks: rest positions"] == (0.125, "1/20")
    assert largest["SA-I"] == (0.25, "2/20")
    assert largest["RA-I"][0] < 1e-5
    assert largest["SA-SE: images of SA-I"] == (0.0, "20 mm/s")
    assert largest["vib-TE: spectra"] == (0.5, "20 mm/s")
    assert stages["SA-I"]["compared"] == 2 * (135 - REST) * 361
    # What a network says of the same images is the same; a line in a spectrum is noticed.
    assert largest["SA-SE: network, of our samples"][0] < 1e-4
    assert largest["vib-TE augmented: network, of our samples"][0] > 1e-3
    assert [one["model"] for one in found["networks"]] == ["sa-se", "vib-te-aug"]
    order = [note for note in found["notes"] if "stand in another order" in note]
    assert len(order) == 2
    assert "RA-SE: images of RA-I" in found["notes"][-1]


def test_pickles_are_not_opened(store, tmp_path, fails):
    class Harm:
        def __reduce__(self):
            return Path.write_text, (tmp_path / "harm", "done")

    dump(tmp_path / "firing_SA.pkl", Harm())
    sentence = fails("compare", store, "--authors", tmp_path)
    assert "the pickle firing_SA.pkl, which is not opened here" in sentence
    assert "scripts/convert_authors_arrays.py" in sentence
    folder = tmp_path / "responses/1"
    folder.mkdir(parents=True)
    hidden = np.array([Harm()], dtype=object)
    np.savez(folder / "20.npz", rest_position=hidden, sa1=hidden, ra1=hidden)
    assert "as numbers, found Object arrays cannot be loaded" in fails(
        "compare", store, "--authors", tmp_path
    )
    assert not (tmp_path / "harm").exists()


def test_what_does_not_fit_is_said(store, converted, tmp_path):
    with pytest.raises(InputError, match="some of the folders responses, samples, networks"):
        afferents.compare(store, tmp_path)
    with np.load(converted / "samples/sa-se/20.npz") as arrays:
        samples, labels = arrays["samples"], arrays["labels"]
    path = tmp_path / "samples/sa-se/20.npz"
    path.parent.mkdir(parents=True)
    for n, order, said in (
        (20, 1, "50 samples of each texture of sa-se, as here, found 10"),
        (None, -1, "2 textures of the store in turn"),
    ):
        np.savez(path, samples=samples[:n], labels=labels[:n][::order])
        with pytest.raises(InputError, match=said):
            afferents.compare(store, tmp_path, quiet=True)
