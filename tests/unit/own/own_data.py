"""Data sets of somebody's own, written outside the package."""

import xarray as xr

from afferents import DataSet, Recording, Session, WavFile, dims
from afferents.store.responses import label


class Gloves(DataSet):
    """Runs of a microphone in a glove, ``{cloth}_{mm/s}.wav``."""

    name, title = "gloves", "gloves"
    encodings = {  # noqa: RUF012  as the guide shows it
        "spectral": {"window_s": 0.5, "remove_mean": True},
        "orders": {"window_s": 1.0},
    }

    def scan(self):
        return Session(self.path, tuple(map(self.run, sorted(self.path.glob("*.wav")))))

    def run(self, path):
        cloth, speed = path.stem.split("_")
        steady_s = (0.0, 3.0)
        sound = WavFile(path, channel=1)
        return Recording(path.stem, cloth, float(speed), path, audio=sound, steady_s=steady_s)


class Heard(Gloves):
    """The same, as responses that somebody else worked out."""

    name = "heard"

    def responses(self):
        return [
            label(xr.Dataset({dims.RA2: one.audio.read()}), one) for one in self.scan().recordings
        ]

    def config(self):
        return {"declared": {"simulated": True}}


class Twice(Gloves):
    name = "twice"

    def run(self, path):
        return Recording("run", "silk", float(path.stem.split("_")[1]), path, audio=WavFile(path))


class Strange(Gloves):
    name = "strange"
    encodings = {"spectral": {"window": 0.5}}  # noqa: RUF012


no_data_set = 3
