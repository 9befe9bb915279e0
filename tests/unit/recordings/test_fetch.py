"""Public data sets from a server that answers, breaks off, changes its mind, or is full of lies."""

import json
import re
import shutil
from dataclasses import replace
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.recordings.described import PACKAGED
from afferents.recordings.fetch import download as downloading
from afferents.recordings.fetch import fetch as fetching
from afferents.recordings.fetch.archives import ARCHIVES, format_manifest, read_manifest

from ...limits import files_no_larger_than
from .served_files import go, here

BASE = "/datasets/mine/"
RNG = np.random.default_rng(0)
FILES = {
    "readme.txt": b"what it is",
    "0/10/video.mp4": RNG.bytes(300_000),
    "0/10/audio.wav": RNG.bytes(20_000),
    "0/10/throw_away.mp4": RNG.bytes(5_000),
    "0.5/10/a name.wav": RNG.bytes(10_000),
}
VIDEO = "0/10/video.mp4"
PIECE = 1 << 16


@pytest.fixture(autouse=True)
def listed(site):
    """Serve each file, in folders that list them."""
    site.files = {BASE + name: content for name, content in FILES.items()}


def test_from_a_folder_to_its_files(site, archive, tmp_path):
    site.files |= {BASE + ".DS_Store": b"x", BASE + "0/10/._audio.wav": b"x"}  # left by systems
    plan, found = go(archive, tmp_path / "d")
    assert here(tmp_path / "d") == FILES
    assert (found.fetched, found.kept) == (len(FILES), 0)
    assert found.n_bytes == sum(map(len, FILES.values()))
    said = " ".join(plan.describe())
    assert f"Licence: named by {archive.page}; read it before" in said
    assert f"5 file(s), 335.0 kB, listed by {site.url}{BASE}." in said
    assert "not been tried against the real server" in said
    listed = read_manifest(tmp_path / "d" / fetching.CHECKSUMS, "http://x/")
    assert {f.path: f.sha256 for f in listed} == {
        name: sha256(content).hexdigest() for name, content in FILES.items()
    }


def test_a_second_time_all_is_checked_and_kept(site, archive, tmp_path):
    go(archive, tmp_path)
    site.asked.clear()
    plan, found = go(archive, tmp_path)
    assert (found.fetched, found.kept) == (0, len(FILES))
    assert "5 are here; 0 bytes to fetch." in plan.describe()
    assert not any(site.bytes_sent(BASE + name) for name in FILES)
    (tmp_path / VIDEO).write_bytes(FILES[VIDEO][:-1] + b"?")
    with pytest.raises(InputError, match=r"video\.mp4: expected the file that is listed, found an"):
        go(archive, tmp_path)
    assert (tmp_path / VIDEO).read_bytes().endswith(b"?")  # nothing is overwritten


@pytest.mark.parametrize(
    "page",
    [
        "<A HREF='0/'>0</A> <a class=x href=0.5/>0.5</a> <a href='readme.txt'>r</a>",
        " ".join(f'<a href="{BASE}{name.replace(" ", "%20")}#top">x</a>' for name in FILES),
        '<a title="&amp;" href="0&#47;">0</a> <a href="../0.5/">up</a>'
        ' <a href="./0.5/">0.5</a> <a href="readme.txt?C=N">N</a> <a href="readme.txt">r</a>',
    ],
)
def test_pages_as_servers_write_them(site, archive, tmp_path, page):
    site.pages = {BASE: page}
    go(archive, tmp_path)
    assert here(tmp_path) == FILES


def test_a_folder_of_another_server_and_a_manifest_as_a_way_round(site, archive, tmp_path):
    url = f"{site.url}{BASE}"
    plan, _ = go(archive, tmp_path / "c", url=f"{site.url}/old")  # which leads there
    assert here(tmp_path / "c") == FILES
    assert "real server" not in " ".join(plan.describe())
    lines = [f"{sha256(content).hexdigest()}  {name}\n" for name, content in FILES.items()]
    (tmp_path / "sums").write_text("".join(lines))
    with pytest.raises(InputError, match="--manifest: expected --url as well"):
        go(archive, tmp_path / "d", manifest=tmp_path / "sums")
    plan, _ = go(archive, tmp_path / "d", manifest=tmp_path / "sums", url=url)
    assert here(tmp_path / "d") == FILES
    assert "no checksum is known" not in " ".join(plan.describe())


@pytest.mark.parametrize("validators", [("ETag",), ("Last-Modified",)])
def test_a_broken_connection_is_gone_on_with(site, archive, tmp_path, validators):
    site.validators = validators
    site.breaks = {BASE + VIDEO: [2 * PIECE, PIECE]}
    go(archive, tmp_path)
    assert here(tmp_path) == FILES
    assert site.bytes_sent(BASE + VIDEO) == [None, f"bytes={2 * PIECE}-", f"bytes={3 * PIECE}-"]


@pytest.mark.parametrize(
    ("there", "then", "asked"),
    [
        (PIECE, FILES[VIDEO], [f"bytes={PIECE}-"]),
        (PIECE, bytes(310_000), [f"bytes={PIECE}-"]),  # which changed meanwhile: anew
        (len(FILES[VIDEO]), FILES[VIDEO], None),  # whole already
    ],
)
def test_another_run_goes_on_from_what_is_there(site, archive, tmp_path, there, then, asked):
    site.breaks = {BASE + VIDEO: [PIECE, *[0] * downloading.TRIES]}
    with pytest.raises(InputError, match=r"breaks after 65536 bytes; run the same command again"):
        go(archive, tmp_path)
    part = tmp_path / f"{VIDEO}.part"
    assert part.stat().st_size == PIECE
    part.write_bytes(FILES[VIDEO][:there])
    site.asked.clear(), site.breaks.clear()
    site.files[BASE + VIDEO] = then
    go(archive, tmp_path)
    assert (tmp_path / VIDEO).read_bytes() == then
    assert asked is None or site.bytes_sent(BASE + VIDEO) == asked


@pytest.mark.parametrize(("takes_ranges", "validators"), [(False, ("ETag",)), (True, ())])
def test_where_nothing_can_be_gone_on_with_it_begins_anew(
    site, archive, tmp_path, takes_ranges, validators
):
    site.takes_ranges, site.validators = takes_ranges, validators
    site.breaks = {BASE + VIDEO: [PIECE]}
    go(archive, tmp_path)
    assert here(tmp_path) == FILES


def test_a_wrong_checksum_leaves_nothing(site, archive, tmp_path):
    wrong = sha256(b"something else").hexdigest()
    (tmp_path / "list").write_text(f"{VIDEO} {wrong} -\n")
    more = {"manifest": tmp_path / "list", "url": f"{site.url}{BASE}"}
    expected = (
        rf"video\.mp4: expected the file with SHA-256 {wrong}, as it is listed, found another"
    )
    with pytest.raises(InputError, match=expected):
        go(archive, tmp_path / "d", **more)
    assert here(tmp_path / "d") == {}


def test_a_disk_that_fills_up_keeps_what_came(site, archive, tmp_path):
    with (
        files_no_larger_than(100_000),
        pytest.raises(InputError, match=r"room and permission .*goes on from what is there"),
    ):
        go(archive, tmp_path)
    assert not (tmp_path / VIDEO).exists()
    go(archive, tmp_path)
    assert here(tmp_path) == FILES


def test_a_disk_that_is_too_small(site, archive, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=300_000))
    with pytest.raises(InputError, match=r"room for 335\.0 kB, found 300\.0 kB on that disk"):
        go(archive, tmp_path)
    assert here(tmp_path) == {}


def test_an_archive_is_no_list(site, archive, tmp_path):
    site.files = {"/all.zip": RNG.bytes(1_000_000)}
    with pytest.raises(InputError, match=r"a folder that lists the .* files, found none in it"):
        go(archive, tmp_path, url=f"{site.url}/all.zip")


@pytest.mark.parametrize("name", ["../out", "/etc/passwd", "a/.ssh/x", "a\\b"])
def test_names_that_lead_elsewhere_are_refused(site, archive, tmp_path, name):
    (tmp_path / "list").write_text(f"{name} - 1\n")
    with pytest.raises(
        InputError, match=r"line 1 of .*expected paths of files within the data set"
    ):
        go(archive, tmp_path / "d", manifest=tmp_path / "list", url=site.url)


def test_what_is_no_list_is_refused(tmp_path):
    (tmp_path / "list").write_text("# nothing\nvideo.mp4\n")
    with pytest.raises(InputError, match=r"line 2 of .*: expected PATH SHA-256 BYTES.*'video.mp4'"):
        read_manifest(tmp_path / "list", "http://x")
    (tmp_path / "list").write_text("# nothing\n")
    with pytest.raises(InputError, match="a list of files, found none in it"):
        read_manifest(tmp_path / "list", "http://x")


def test_a_server_that_has_nothing(site, archive, tmp_path):
    site.files = {}
    with pytest.raises(
        InputError, match=r"a folder that lists the .* files, found none in it; .*--manifest"
    ):
        go(archive, tmp_path)
    with pytest.raises(InputError, match="expected an answer, found 404 Not Found"):
        go(archive, tmp_path, url=f"{site.url}/nowhere")
    with pytest.raises(InputError, match="expected an answer, found no connection"):
        go(archive, tmp_path, url="http://127.0.0.1:9/")


@pytest.fixture
def hub(site):
    """A data set as the Hugging Face hub lists and serves it, on two pages."""
    tree, raw = "/api/datasets/touch/set/tree/main", "/datasets/touch/set/resolve/main"
    files = {f"sensor_data/accel/{name}": RNG.bytes(9_000) for name in ("0/a.parquet", "1/b c.x")}
    site.files = {f"{raw}/{path}": content for path, content in files.items()}
    listed = [{"type": "file", "path": path, "size": 9_000} for path in files]
    listed.append({"type": "file", "path": "sensor_data/accel/.DS_Store", "size": 1})
    listed[0]["lfs"] = {"oid": sha256(files["sensor_data/accel/0/a.parquet"]).hexdigest()}
    folder = {"type": "directory", "path": "sensor_data/accel/0", "size": 0}
    url = f"{tree}/sensor_data/accel"
    site.pages = {url: json.dumps([folder, listed[0]]), "/goes-on": json.dumps(listed[1:])}
    site.next = {url: "/goes-on"}
    return replace(ARCHIVES["cluster-haptic-accel"], url=site.url + url), files


def test_a_folder_of_the_hub(site, hub, tmp_path):
    archive, files = hub
    plan, found = go(archive, tmp_path / "d")
    assert here(tmp_path / "d") == files
    assert (found.fetched, found.n_bytes) == (2, 18_000)
    said = " ".join(plan.describe())
    assert "Licence: CC BY 4.0." in said
    assert "2 file(s), 18.0 kB, listed by" in said
    assert "Of 1 no checksum is known" in said
    path = next(iter(site.files))
    site.files[path] = bytes(9_000)
    with pytest.raises(InputError, match=r"a\.parquet: expected the file with SHA-256"):
        go(archive, tmp_path / "again")


@pytest.mark.parametrize("answer", ["<html>", '{"error": "gone"}', '[{"type": "file"}]', "[7]"])
def test_what_is_no_list_of_the_hub_is_refused(site, hub, tmp_path, answer):
    archive, _ = hub
    site.pages = dict.fromkeys(site.pages, answer)
    with pytest.raises(InputError, match="the hub's list of files, found another answer; see"):
        go(archive, tmp_path)


def test_where_the_hub_is_asked():
    """The list's form is what tells it from a landing page."""
    for name in ("cluster-haptic-accel", "cluster-haptic-audio"):
        url = ARCHIVES[name].url
        assert re.fullmatch(
            r"https://[^/]+/api/datasets/[^/]+/[^/]+/tree/main/sensor_data/\w+", url
        )
        assert url.endswith(name.rpartition("-")[2])
        assert name in PACKAGED
        assert name in ARCHIVES[name].next_step


def test_the_list_of_fabricslide_is_whole():
    archive = ARCHIVES["fabricslide"]
    files = read_manifest(archive.manifest, archive.url)
    assert len(files) == 990
    assert {f.path.split("/")[1] for f in files} == {"board", "fabric"}
    assert all(f.sha256 and f.n_bytes for f in files)
    assert files[0].url == archive.url + files[0].path
    assert format_manifest(files) == "".join(
        line for line in archive.manifest.read_text().splitlines(True) if line[0] != "#"
    )


def test_the_command(site, tmp_path, run):
    manifest, folder = tmp_path / "list", tmp_path / "d"
    manifest.write_text(f"readme.txt {sha256(FILES['readme.txt']).hexdigest()} 10\n")
    given = ("fetch", "fabricslide", folder, "--url", site.url + BASE, "--manifest", manifest)
    code, out, err = run(*given, "--json")
    assert code == 0, err
    assert json.loads(out) == {"folder": str(folder), "fetched": 1, "kept": 0, "n_bytes": 10}
    assert "Licence: MIT." in err
    code, out, _ = run(*given, "--quiet")
    assert out.splitlines()[1] == f"Next: afferents inspect fabricslide:{folder}"
    code, _, err = run("fetch", "nothing", tmp_path)
    assert (code, "one of pestell2022, fabricslide, cluster-haptic-acc" in err) == (2, True)
