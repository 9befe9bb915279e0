"""Small recordings, stores, results and models that stand for the names in printed commands.

Each is made when a command first asks for it, by the command line where there is a command.
"""

import os
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from functools import partial

import cv2
import numpy as np
import pandas as pd

from afferents import cli
from afferents.lab.recorder.plan import EXAMPLE

from ...conftest import few_epochs
from ...kept import contents
from .printed import DOCS, ROOT, blocks

LARGE = ("--textures", "a,g,m", "--speeds", "20,40,50,100", "--seconds", "6")
"""Windows of 4 s fit into what is steady of it."""
SMALL = ("--textures", "g,4", "--speeds", "40,50,60", "--seconds", "2")
SHORT = ("--textures", "g", "--speeds", "50", "--seconds", "1.6")
ONE, SPEED = "3/50", "40"
"""A recording, and a speed that all recordings here have: the one that is held out."""
FABRICS = {"Linen": 3.0, "Wool": 5.0, "Silk": 8.0}
TAXELS = 16
FABRIC_ROWS = 200


class Things:
    """Makes what is asked for by its name, once.

    Parameters
    ----------
    folder
        Where all of it lies.
    """

    def __init__(self, folder):
        self.folder = folder
        self.begun = {}
        """Checksums of what is in folders, as it was made."""

    def __getitem__(self, name):
        path = self.folder / name
        if not path.exists():
            with few_epochs():
                MAKERS[name](self, path)
            self.begun[path] = contents(path)
        return path

    def lay(self, name, place):
        """Put a thing where a command looks for it; what is added to it is added there alone."""
        path = self[name]
        if path.is_dir():
            shutil.copytree(path, place, copy_function=os.link, dirs_exist_ok=True)
        elif not place.exists():
            shutil.copy(path, place)


def afferents(*words):
    cli.run([*map(str, words)])


def simulated(options, things, path):
    afferents("simulate", path, *options, "--workers", 1, "--quiet")


def extracted(session, things, path):
    afferents("extract", things[session], path, "--workers", 1, "--quiet")


def file_of(name, things, path):
    os.link(things["session"] / name, path)


def times(things, path):
    """The camera's, of a clip that is imported: 2 s at 90 frames/s."""
    pd.DataFrame({"time_s": np.arange(180) / 90, "sequence": range(180)}).to_csv(path, index=False)


def clips(things, path):
    path.mkdir()
    for name in ("lego", "concrete"):
        things.lay("clip", path / f"{name}.avi")
        things.lay("sound", path / f"{name}.wav")


def drafted(things, path):
    """Clips with a session file."""
    things.lay("clips", path)
    afferents("init", path)


def trials(things, path):
    """Sound of four trials, each with all textures."""
    session = things.folder / "of trials"
    session.mkdir()
    listed = "steady_s = [1.5, 6.0]\n"
    for number, wav in enumerate(sorted(things["large session"].glob("*/*/audio.wav"))):
        texture, speed = wav.parts[-3:-1]
        os.link(wav, session / f"{number}.wav")
        listed += f'[[recordings]]\naudio = "{number}.wav"\ntexture = "{texture}"\n'
        listed += f"speed_mm_s = {speed}\nconditions = {{ trial = {number % 4} }}\n"
    (session / "session.toml").write_text(listed)
    afferents("extract", session, path, "--workers", 1, "--quiet")


def sensor(things, path):
    afferents("calibrate", things["clip"], "--out", path)


def results(things, path):
    asked = ("--models", "sa-wave-vector", "--held-out", SPEED, "--workers", 1, "--quiet")
    afferents("evaluate", things["large store"], "--out", path, *asked)


def trained(name, things, path):
    afferents("train", things["large store"], path, "--model", name, "--quiet")


def exported(name, things, path):
    afferents("export", things[name], path)


def bag(things, path):
    bags = things.folder / "bags"
    afferents("export-mcap", things["session"], bags, "--recording", "4/60", "--quiet")
    (bags / "4_60").rename(path)


def percepts(things, path):
    """What is felt of a recording."""
    clip = things["session"] / "4/60/video.mp4"
    with path.open("w") as file, redirect_stdout(file):
        asked = ("--video", clip, "--json", "--speed", "max")
        afferents("live", "--model", things["model.onnx"], *asked)


def plan(things, path):
    """The example, of two short runs."""
    text = (
        EXAMPLE.read_text().replace('["0", "2", "4"]', '["0", "4"]').replace("[20, 40, 60]", "[60]")
    )
    text = text.replace("seconds = 5.0", "seconds = 1.5")
    path.write_text(text)


def fabrics(things, path):
    """Files as FabricSlide's: each fabric a wave of its own, which is felt faster if it is slid."""
    rng = np.random.default_rng(0)
    path.mkdir()
    names = ["timestamp", "proximity1", "proximity2", *(f"channel{n + 1}" for n in range(TAXELS))]
    time = 28 * np.arange(FABRIC_ROWS)
    for fabric, wave_mm in FABRICS.items():
        for pressure in ("F80", "F120", "F250"):
            for speed in (20, 40, 100):
                felt = 50 * np.sin(2 * np.pi * speed / wave_mm / 10 * time / 1000)
                counts = 500 + felt[:, None] + 10 * rng.normal(size=(FABRIC_ROWS, TAXELS))
                columns = [time, 0 * time, 0 * time + 65535, *counts.astype(int).T]
                table = pd.DataFrame(dict(zip(names, columns, strict=True)))
                file = path / f"{fabric}_{pressure}_V{speed}mmps_1.csv"
                file.write_text(", ".join(names) + "\n" + table.to_csv(index=False, header=False))


def taxels(things, path):
    script = ROOT / "scripts/simulated_taxels.py"
    subprocess.run([sys.executable, script, path], check=True)


def arms(things, path):
    subprocess.run([sys.executable, ROOT / "scripts/arm_folders.py", path], check=True)


def own_models(things, path):
    path.write_text(blocks(DOCS / "own-models.md", "python")[0])


def heights(things, path):
    picture = np.tile(np.arange(0, 240, 10, np.uint8), (24, 1))
    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


MAKERS = {
    "session": partial(simulated, SMALL),
    "large session": partial(simulated, LARGE),
    "short session": partial(simulated, SHORT),
    "hexagonal session": partial(simulated, (*SHORT, "--sensor", "hex127")),
    "store": partial(extracted, "session"),
    "large store": partial(extracted, "large session"),
    "trials": trials,
    "clip": partial(file_of, f"{ONE}/video.mp4"),
    "another clip": partial(file_of, "4/60/video.mp4"),
    "sound": partial(file_of, f"{ONE}/audio.wav"),
    "times": times,
    "clips": clips,
    "drafted clips": drafted,
    "sensor.toml": sensor,
    "results": results,
    "model": partial(trained, "sa-wave-vector"),
    "vibration model": partial(trained, "vib-te-aug"),
    "model.onnx": partial(exported, "model"),
    "vibration model.onnx": partial(exported, "vibration model"),
    "bag": bag,
    "percepts": percepts,
    "plan": plan,
    "fabrics": fabrics,
    "taxels": taxels,
    "arms": arms,
    "own models": own_models,
    "heights": heights,
}
