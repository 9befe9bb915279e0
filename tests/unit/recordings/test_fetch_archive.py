"""A data set that a server offers as one archive only: brought, unpacked, and never believed."""

import io
import re
import shutil
import stat
import tarfile
import zipfile
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.recordings.fetch.archives import read_manifest
from afferents.recordings.fetch.fetch import CHECKSUMS

from ...limits import files_no_larger_than
from .served_files import go, here

KEY = "mine"
PACKED = f"/datasets/tar/{KEY}"
PIECE = 1 << 16
RNG = np.random.default_rng(0)
FILES = {
    "readme.txt": b"what it is",
    "0/10/video.mp4": RNG.bytes(150_000),
    "0/10/audio.wav": RNG.bytes(20_000),
    "0.5/10/a name.wav": RNG.bytes(10_000),
}
LEFT_BEHIND = {".DS_Store": b"x", "0/._a": b"x", f"__MACOSX/{KEY}/a": b"x"}
"""What systems write beside files: it is left out."""


def zipped(files, top=f"{KEY}/", **more):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", **more) as archive:
        for name, content in files.items():
            archive.writestr(name if isinstance(name, zipfile.ZipInfo) else top + name, content)
    return out.getvalue()


def tarred(files, top=f"./{KEY}/", mode="w", members=()):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode=mode) as archive:
        for name, content in files.items():
            info = tarfile.TarInfo(top + name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
        for info in members:
            archive.addfile(info)
    return out.getvalue()


NO_FILES = (tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE)


def link(name, target, kind):
    info = tarfile.TarInfo(name)
    info.type, info.linkname = kind, target
    return info


def offer(site, content, ending=".zip"):
    """Serve an archive, to be asked for by its address."""
    site.files = {PACKED + ending: content}
    site.offered = f"{site.url}{PACKED}{ending}"


@pytest.mark.parametrize(
    ("content", "ending"),
    [
        (zipped(FILES | LEFT_BEHIND), ".zip"),
        (zipped(FILES, top="", compression=zipfile.ZIP_DEFLATED), ".zip"),
        (tarred(FILES), ".tar"),
        (tarred(FILES, mode="w:gz"), ".tar.gz"),
    ],
    ids=["zip", "zip without a folder", "tar", "tar.gz"],
)
def test_from_an_archive_to_its_files(site, archive, tmp_path, content, ending):
    offer(site, content, ending)
    plan, found = go(archive, tmp_path, url=site.offered)
    assert here(tmp_path) == FILES  # the archive is gone
    assert (found.fetched, found.kept) == (len(FILES), 0)
    assert found.n_bytes == sum(map(len, FILES.values()))
    said = " ".join(plan.describe())
    assert "1 file(s), " in said
    assert f"It is one archive, unpacked in {tmp_path}, and is removed when all is whole." in said
    noted = read_manifest(tmp_path / CHECKSUMS, "http://x/")
    wanted = {name: sha256(data).hexdigest() for name, data in FILES.items()}
    assert {f.path: f.sha256 for f in noted} == wanted | {
        f"{KEY}{ending}": sha256(content).hexdigest()
    }


def test_what_was_lost_is_unpacked_again_beside_what_is_there(site, archive, tmp_path):
    offer(site, zipped(FILES))
    go(archive, tmp_path, url=site.offered)
    site.asked.clear()
    _, found = go(archive, tmp_path, url=site.offered)
    assert (found.fetched, found.kept) == (0, len(FILES))
    assert not site.bytes_sent(f"{PACKED}.zip")
    lost = tmp_path / "readme.txt"
    lost.unlink()
    offer(site, zipped(FILES, compression=zipfile.ZIP_DEFLATED))  # packed anew: other bytes
    _, found = go(archive, tmp_path, url=site.offered)
    assert (found.fetched, found.kept) == (1, len(FILES) - 1)
    assert here(tmp_path) == FILES
    lost.unlink()
    offer(site, zipped(FILES | {"readme.txt": b"changed"}))
    with pytest.raises(InputError, match=r"readme.txt: .*another noted .*has changed"):
        go(archive, tmp_path, url=site.offered)
    assert not lost.exists()
    lost.write_text("another")
    with pytest.raises(InputError, match=r"readme.txt: expected the file that is listed"):
        go(archive, tmp_path, url=site.offered)


def changed(content):
    """Return a zip with one byte of the video another."""
    at = content.index(FILES["0/10/video.mp4"][:64]) + 1000
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


@pytest.mark.parametrize(
    ("content", "ending"),
    [
        (zipped(FILES)[:-500], ".zip"),
        (changed(zipped(FILES)), ".zip"),
        (b"<html>an error</html>", ".zip"),
        (tarred(FILES)[:100_000], ".tar"),
        (tarred(dict(list(FILES.items())[:2]))[: 512 + 512 + 512 + 150_016], ".tar"),
        (tarred(FILES, mode="w:gz")[:-5000], ".tar.gz"),
    ],
    ids=["zip", "a bit", "no zip", "tar", "tar between files", "tar.gz"],
)
def test_of_a_damaged_archive_nothing_is_unpacked(site, archive, tmp_path, content, ending):
    offer(site, content, ending)
    expected = rf"{KEY}{ending}: expected a whole archive.*found damage \(.*remove it and run"
    with pytest.raises(InputError, match=expected) as caught:
        go(archive, tmp_path, url=site.offered)
    assert "\n" not in str(caught.value)
    assert here(tmp_path) == {f"{KEY}{ending}": content}


def of_zip(name, mode=0, content=b"x"):
    info = zipfile.ZipInfo(name)
    info.external_attr = mode << 16
    return zipped({info: content} | {"readme.txt": b"what it is"}, top="")


def locked():
    """Return a zip that says that its one file has a password."""
    content = bytearray(of_zip("a.wav"))
    for sign, at in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        content[content.index(sign) + at] |= 1
    return bytes(content)


@pytest.mark.parametrize(
    ("content", "ending"),
    [
        (of_zip("readme.txt/x"), ".zip"),
        (locked(), ".zip"),
        (zipped({}), ".zip"),
        (tarred({"../../outside": b"x"}), ".tar"),
        *((tarred({}, members=[link("a", "/etc/passwd", kind)]), ".tar") for kind in NO_FILES),
    ],
)
def test_what_is_no_ordinary_file_is_refused(site, archive, tmp_path, content, ending):
    offer(site, content, ending)
    with pytest.raises(InputError, match=rf"{KEY}.*: expected .*found"):
        go(archive, tmp_path / "d", url=site.offered)
    assert here(tmp_path) == {f"d/{KEY}{ending}": content}


@pytest.mark.parametrize(
    "content",
    [
        of_zip("../outside"),
        of_zip("/etc/outside"),
        of_zip("a/../../outside"),
        of_zip("a.wav", stat.S_IFLNK | 0o777, b"/etc/passwd"),
    ],
)
def test_nothing_of_an_archive_leaves_the_folder(site, archive, tmp_path, content):
    offer(site, content)
    go(archive, tmp_path / "d", url=site.offered)
    assert all(name.startswith("d/") for name in here(tmp_path))
    assert not any(path.is_symlink() for path in tmp_path.rglob("*"))


def test_a_file_that_is_there_is_never_overwritten(site, archive, tmp_path):
    packed = zipped(FILES)  # once: it holds the time when it was made
    offer(site, packed)
    (tmp_path / "readme.txt").write_text("mine")
    with pytest.raises(InputError, match=r"readme.txt: expected the file that the archive holds"):
        go(archive, tmp_path, url=site.offered)
    assert here(tmp_path) == {"readme.txt": b"mine", f"{KEY}.zip": packed}


@pytest.mark.parametrize(
    ("content", "room", "left"),
    [
        (zipped(FILES), "361.0 kB, the archive and what is in it, found", set()),
        (
            zipped({"zeros": bytes(1_000_000)}, compression=zipfile.ZIP_DEFLATED),
            "1.0 MB, what is in the archive, found 300.0 kB",
            {f"{KEY}.zip"},
        ),
    ],
)
def test_a_disk_that_is_too_small(site, archive, tmp_path, monkeypatch, content, room, left):
    offer(site, content)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=300_000))
    with pytest.raises(InputError, match=f"room for {re.escape(room)}"):
        go(archive, tmp_path, url=site.offered)
    assert set(here(tmp_path)) == left


def test_a_disk_that_fills_up_while_unpacking(site, archive, tmp_path):
    offer(site, zipped({"0/10/zeros": bytes(200_000)}, compression=zipfile.ZIP_DEFLATED))
    with files_no_larger_than(100_000), pytest.raises(InputError, match="room and permission"):
        go(archive, tmp_path, url=site.offered)
    assert set(here(tmp_path)) == {f"{KEY}.zip"}
    site.asked.clear()
    go(archive, tmp_path, url=site.offered)
    assert here(tmp_path) == {"0/10/zeros": bytes(200_000)}
    assert not site.bytes_sent(f"{PACKED}.zip")  # it was here already


def test_the_command(site, tmp_path, run):
    offer(site, zipped(FILES))
    given = ("fetch", "pestell2022", tmp_path / "d", "--url", f"{site.url}{PACKED}.zip")
    code, out, err = run(*given)
    assert code == 0, err
    assert out.startswith(f"{len(FILES)} files fetched, 0 were here")
    assert here(tmp_path / "d") == FILES
    assert f"Next: afferents inspect {tmp_path / 'd'}" in out
