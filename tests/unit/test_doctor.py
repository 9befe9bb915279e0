"""`doctor` names what is missing; that is no reason for it to fail."""

import os
import sys
from importlib.metadata import PackageNotFoundError

import pytest

from afferents import doctor

from ..extras import ABSENT


def diagnose():
    groups, missing = doctor.diagnose()
    return {what: found for rows in groups.values() for what, found in rows.items()}, missing


NEEDS_TRAIN = pytest.mark.skipif("skops" in ABSENT, reason="needs the extra train")


def test_here_nothing_is_missing():
    pytest.importorskip("torch")
    found, missing = diagnose()
    assert missing == []
    assert {"accelerator", "torch build", "bfloat16", "codec h264", "zarr", "av"} <= set(found)
    named = {what.removeprefix("extra ") for what in found if "extra " in what}
    commands = {"train", "lab", "cluster", "fetch", "mcap", "nwb", "view", "neural", "hdf5"}
    assert named >= commands
    assert not named & {"dev", "docs"}


@pytest.mark.parametrize("package", ["zarr", pytest.param("skops", marks=NEEDS_TRAIN)])
def test_what_is_not_installed_is_said_with_its_remedy(monkeypatch, package):
    """What only an extra needs is not missed."""
    installed = doctor.version

    def lacking(name):
        if name == package:
            raise PackageNotFoundError(name)
        return installed(name)

    monkeypatch.setattr(doctor, "version", lacking)
    found, missing = diagnose()
    said = found["zarr" if package == "zarr" else "extra train"]
    if package == "zarr":
        assert (said, len(missing)) == ("missing", 1)
        assert "pip install 'zarr" in missing[0]
    else:
        assert missing == []
        remedy = "not there (skops); pip install 'afferents["
        assert said.startswith(remedy)
        assert found["extra cluster"] == "there"


@pytest.mark.parametrize(
    ("module", "lost"),
    [pytest.param("torch", "torch build", marks=NEEDS_TRAIN), ("av", "codec h264"), ("cv2", None)],
)
def test_a_module_that_cannot_be_imported_is_named(monkeypatch, module, lost):
    monkeypatch.setitem(sys.modules, module, None)
    found, missing = diagnose()
    assert [line.split(" (")[0] for line in missing] == [f"{module} cannot be imported"]
    assert lost not in found
    assert "memory" in found


def test_a_library_of_the_system_that_is_not_there_is_named(monkeypatch):
    pytest.importorskip("sounddevice")  # else the extra's own package is what is missing

    def broken(name):
        raise OSError("sndfile library not found")

    monkeypatch.setattr(doctor, "NATIVE", ("soundfile",))
    monkeypatch.setattr(doctor, "import_module", broken)
    monkeypatch.setattr(doctor, "find_library", lambda name: None)
    monkeypatch.delattr(os, "sysconf")
    found, missing = diagnose()
    assert "soundfile cannot be imported (sndfile library not found)" in missing
    assert "no PortAudio library" in found["extra lab"]
    assert found["memory"] == "unknown"
