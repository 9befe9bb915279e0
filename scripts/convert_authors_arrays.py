"""Turn the authors' processed arrays (pickles) into plain arrays that `afferents compare` reads.

A pickle is a program: whoever opens one runs whatever its writer, or whoever changed it on the way,
put into it. `afferents` therefore never opens one. This script does. Run it only on files that you
trust, whose checksums you have compared with the publisher's, and where they can do no harm: in an
environment of its own, best in a container without network, as a user who owns nothing else.

It needs numpy alone, and no afferents:

    python -m venv authors && authors/bin/pip install numpy
    authors/bin/python scripts/convert_authors_arrays.py DATA CONVERTED

DATA is the root that the authors' notebooks use (`open/afferents-tactile-textures-jrsi2022`). What
is there is converted, what is missing is said:

    firing_SA.pkl, firing_RA.pkl, pins.pkl            -> responses/TEXTURE/SPEED.npz
    static/I/X_test_SA.pkl, y_test_SA.pkl, and so on  -> samples/MODEL/SPEED.npz
    models/static_SA/I/*.hdf5, and so on              -> networks/MODEL/SPEED.hdf5

Pickles are looked for in DATA/processed, then in DATA.
Of several .hdf5 files the last by name is taken, as the authors' notebook does. With --keras the
networks are also asked about the test sets, which needs Keras (TensorFlow) in that environment;
their outputs then stand beside the samples. The firings of a session are read at once: this takes
as much memory as the pickles are large, and half of it again on disk.
"""

import argparse
import pickle
import shutil
from pathlib import Path
from typing import Any

import numpy as np

TEXTURES = [f"{spacing / 2:g}" for spacing in range(13)]
SPEEDS = [f"{speed}" for speed in range(10, 110, 10)]

MODELS = {
    "sa-se": ("static_SA", "static", "_SA"),
    "ra-se": ("static_RA", "static", "_RA"),
    "sa-ste": ("dynamic_SA", "dynamic", "_SA"),
    "ra-ste": ("dynamic_RA", "dynamic", "_RA"),
    "vib-te": ("vibration", "vibration", ""),
    "vib-te-aug": ("vibration_augmented", "vibration", ""),
}
"""By our name: folder of the networks, folder of the test sets, end of the test sets' names."""


def unpickled(root: Path, name: str) -> Any:
    """Return what a pickle holds, in DATA or its folder `processed`; None if there is none."""
    for path in (root / "processed" / name, root / name):
        if path.is_file():
            with path.open("rb") as file:
                return pickle.load(file)
    print(f"not there: {name}")
    return None


def save(path: Path, **arrays: Any) -> None:
    """Write arrays as float32, under another name until they are whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f"{path.name}.aside.npz")
    np.savez(aside, **{name: np.asarray(values, np.float32) for name, values in arrays.items()})
    aside.replace(path)


def convert_responses(root: Path, out: Path) -> None:
    """Write rest positions, SA-I and RA-I of every recording."""
    names = ("pins.pkl", "firing_SA.pkl", "firing_RA.pkl")
    found = [unpickled(root, name) for name in names]
    if any(one is None for one in found):
        return
    for j, texture in enumerate(TEXTURES):
        for i, speed in enumerate(SPEEDS):
            rest, sa1, ra1 = (one[j][i] for one in found)
            path = out / "responses" / texture / f"{speed}.npz"
            save(path, rest_position=rest, sa1=sa1, ra1=ra1)


def convert_samples(root: Path, out: Path) -> None:
    """Write the test set of every model and held-out speed."""
    for model, (_, folder, end) in MODELS.items():
        for i, speed in enumerate(SPEEDS):
            samples = unpickled(root, f"{folder}/{i}/X_test{end}.pkl")
            labels = unpickled(root, f"{folder}/{i}/y_test{end}.pkl")
            if samples is None or labels is None:
                continue
            textures = labels[-1] if isinstance(labels, list | tuple) else labels
            path = out / "samples" / model / f"{speed}.npz"
            save(path, samples=samples, labels=np.argmax(textures, axis=1))


def copy_networks(root: Path, out: Path) -> None:
    """Copy the network of every model and held-out speed."""
    for model, (folder, _, _) in MODELS.items():
        for i, speed in enumerate(SPEEDS):
            saved = sorted((root / "models" / folder / f"{i}").glob("*.hdf5"))
            if not saved:
                print(f"not there: models/{folder}/{i}/*.hdf5")
                continue
            target = out / "networks" / model / f"{speed}.hdf5"
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(saved[-1], target)


def ask_keras(out: Path) -> None:
    """Write beside every test set what its network says of it, as Keras computes it."""
    from tensorflow.keras.models import load_model  # type: ignore[import-not-found]

    for path in sorted(out.glob("networks/*/*.hdf5")):
        test_set = out / "samples" / path.parent.name / f"{path.stem}.npz"
        if not test_set.is_file():
            continue
        with np.load(test_set, allow_pickle=False) as arrays:
            held = dict(arrays)
        network = load_model(path, compile=False)
        samples = held["samples"].reshape(-1, *network.input_shape[1:])
        save(test_set, **{**held, "outputs": network.predict(samples)})


def main() -> None:
    """Convert what there is."""
    parser = argparse.ArgumentParser(description="Convert the authors' pickles; see the source.")
    parser.add_argument("data", type=Path, help="root of the authors' notebooks")
    parser.add_argument("out", type=Path, help="folder to write")
    parser.add_argument("--keras", action="store_true", help="ask the networks about the test sets")
    given = parser.parse_args()
    convert_responses(given.data, given.out)
    convert_samples(given.data, given.out)
    copy_networks(given.data, given.out)
    if given.keras:
        ask_keras(given.out)


if __name__ == "__main__":
    main()
