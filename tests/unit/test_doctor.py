"""`doctor` names what is missing; that is no reason for it to fail."""

import os
import sys
from importlib.metadata import PackageNotFoundError

import pytest

from afferents import doctor

INSTALLED = doctor.version


@pytest.fixture
def without(monkeypatch):
    """Let a package be one that is not installed."""

    def lack(package):
        def installed(name):
            if name == package:
                raise PackageNotFoundError(name)
            return INSTALLED(name)

        monkeypatch.setattr(doctor, "version", installed)

    return lack


def test_here_nothing_is_missing():
    rows, missing = doctor.diagnose()
    assert missing == []
    found = dict(rows)
    assert {"accelerator", "torch build", "bfloat16", "codec h264", "torch", "av"} <= set(found)
    named = {what.removeprefix("extra ") for what in found if "extra " in what}
    commands = {"live", "record", "cluster", "fetch", "mcap", "nwb", "view", "neural", "hdf5"}
    assert named >= commands
    assert not named & {"dev", "docs"}


@pytest.mark.parametrize(
    ("module", "lost"), [("torch", "torch build"), ("av", "codec h264"), ("cv2", None)]
)
def test_a_module_that_cannot_be_imported_is_named(monkeypatch, module, lost):
    monkeypatch.setitem(sys.modules, module, None)
    rows, missing = doctor.diagnose()
    assert [line.split(" (")[0] for line in missing] == [f"{module} cannot be imported"]
    assert lost not in dict(rows)
    assert "memory" in dict(rows)


def test_a_library_of_the_system_that_is_not_there_is_named(monkeypatch):
    def broken(name):
        raise OSError("sndfile library not found")

    monkeypatch.setattr(doctor, "NATIVE", ("soundfile",))
    monkeypatch.setattr(doctor, "import_module", broken)
    monkeypatch.setattr(doctor, "find_library", lambda name: None)
    monkeypatch.delattr(os, "sysconf")
    rows, missing = doctor.diagnose()
    assert "soundfile cannot be imported (sndfile library not found)" in missing
    assert "no PortAudio library" in dict(rows)["extra live"]
    assert dict(rows)["memory"] == "unknown"


def test_a_package_that_is_not_installed_is_named_with_its_remedy(without):
    without("torch")
    rows, missing = doctor.diagnose()
    assert dict(rows)["torch"] == "missing"
    assert len(missing) == 1
    assert "pip install -c constraints.txt 'torch" in missing[0]


def test_an_extra_that_is_not_there_is_said_but_not_missed(without):
    without("onnxruntime")
    rows, missing = doctor.diagnose()
    remedy = "not there (onnxruntime); pip install -c constraints.txt 'afferents["
    assert dict(rows)["extra live"].startswith(remedy)
    assert dict(rows)["extra cluster"] == "there"
    assert missing == []
