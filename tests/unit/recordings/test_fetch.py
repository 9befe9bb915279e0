"""Public data sets from a server that answers, breaks off, changes its mind, or is full of lies."""

import json
import re
import shutil
import stat
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.recordings import fetch as fetching, listing
from afferents.recordings.described import PACKAGED
from afferents.recordings.listing import format_manifest, read_manifest

from ...limits import files_no_larger_than
from .served_files import here

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
ON_GITHUB = ("ntp", "biotac-slide", "vibrotexturerecog")
ON_HUB = ("cluster-haptic-accel", "cluster-haptic-audio")


@pytest.fixture(autouse=True)
def listed(site):
    """Serve each file, in folders that list them."""
    site.files = {BASE + name: content for name, content in FILES.items()}


@pytest.fixture
def serve_as(site, monkeypatch):
    """Let a data set be at an address of that server."""

    def at(name, path):
        known = fetching.public_sets()
        moved = known[name].model_copy(update={"url": site.url + path})
        monkeypatch.setattr(fetching, "public_sets", lambda: {**known, name: moved})
        return moved

    return at


@pytest.fixture
def go(serve_as):
    """Fetch what stands for the recordings of the paper."""
    serve_as("pestell2022", BASE)

    def fetch(folder, **more):
        return afferents.fetch("pestell2022", folder, quiet=True, **more)

    return fetch


def test_from_a_folder_to_its_files(site, serve_as, tmp_path, capsys):
    public = serve_as("pestell2022", BASE)
    site.files |= {BASE + ".DS_Store": b"x", BASE + "0/10/._audio.wav": b"x"}  # left by systems
    found = afferents.fetch("pestell2022", tmp_path / "d", quiet=True)
    assert here(tmp_path / "d") == FILES
    assert (found.fetched, found.kept) == (len(FILES), 0)
    assert found.n_bytes == sum(map(len, FILES.values()))
    said = " ".join(capsys.readouterr().err.split())
    assert f"Licence: named by {public.page}; read it before" in said
    assert f"5 file(s), 335.0 kB, listed by {site.url}{BASE}." in said
    assert "not been tried against the real server" in said
    listed = read_manifest(tmp_path / "d" / fetching.CHECKSUMS, "http://x/")
    assert {f.path: f.sha256 for f in listed} == {
        name: sha256(content).hexdigest() for name, content in FILES.items()
    }
    (tmp_path / "usual").touch()
    usual = stat.S_IMODE((tmp_path / "usual").stat().st_mode)
    assert stat.S_IMODE((tmp_path / "d" / VIDEO).stat().st_mode) == usual


def test_a_second_time_all_is_checked_and_kept(site, go, tmp_path, capsys):
    go(tmp_path)
    site.asked.clear()
    found = go(tmp_path)
    assert (found.fetched, found.kept) == (0, len(FILES))
    assert "5 are here; 0 bytes to fetch." in capsys.readouterr().err
    assert not any(site.bytes_sent(BASE + name) for name in FILES)
    (tmp_path / VIDEO).write_bytes(FILES[VIDEO][:-1] + b"?")
    with pytest.raises(InputError, match=r"video\.mp4: expected the file that is listed, found an"):
        go(tmp_path)
    assert (tmp_path / VIDEO).read_bytes().endswith(b"?")  # nothing is overwritten


def test_a_file_that_was_there_with_another_size_is_refused(go, tmp_path):
    (tmp_path / VIDEO).parent.mkdir(parents=True)
    (tmp_path / VIDEO).write_bytes(FILES[VIDEO][:1000])
    with pytest.raises(InputError, match=r"video\.mp4: expected the file that is listed, found an"):
        go(tmp_path)


@pytest.mark.parametrize(
    "page",
    [
        "<A HREF='0/'>0</A> <a class=x href=0.5/>0.5</a> <a href='readme.txt'>r</a>",
        " ".join(f'<a href="{BASE}{name.replace(" ", "%20")}#top">x</a>' for name in FILES),
        '<a title="&amp;" href="0&#47;">0</a> <a href="../0.5/">up</a>'
        ' <a href="./0.5/">0.5</a> <a href="readme.txt?C=N">N</a> <a href="readme.txt">r</a>',
    ],
)
def test_pages_as_servers_write_them(site, go, tmp_path, page):
    site.pages = {BASE: page}
    go(tmp_path)
    assert here(tmp_path) == FILES


def test_a_folder_of_another_server_and_a_manifest_as_a_way_round(site, go, tmp_path, capsys):
    url = f"{site.url}{BASE}"
    go(tmp_path / "c", url=f"{site.url}/old")  # which leads there
    assert here(tmp_path / "c") == FILES
    assert "real server" not in capsys.readouterr().err
    lines = [f"{sha256(content).hexdigest()}  {name}\n" for name, content in FILES.items()]
    (tmp_path / "sums").write_text("".join(lines))
    with pytest.raises(InputError, match="--manifest: expected --url as well"):
        go(tmp_path / "d", manifest=tmp_path / "sums")
    go(tmp_path / "d", manifest=tmp_path / "sums", url=url)
    assert here(tmp_path / "d") == FILES
    assert "no checksum is known" not in capsys.readouterr().err


@pytest.mark.parametrize("n_breaks", [1, fetching.RETRIES])
def test_a_file_whose_connection_breaks_is_asked_for_again(site, go, tmp_path, n_breaks):
    site.breaks = {BASE + VIDEO: [100_000] * n_breaks}
    go(tmp_path)
    assert here(tmp_path) == FILES
    assert len(site.bytes_sent(BASE + VIDEO)) == 1 + n_breaks


def test_another_run_goes_on_with_the_file_that_was_broken_off(site, go, tmp_path):
    site.breaks = {BASE + VIDEO: [100_000] * (1 + fetching.RETRIES)}
    with pytest.raises(InputError, match=r"a connection that breaks; run the same command again"):
        go(tmp_path)
    there = here(tmp_path)
    assert VIDEO not in there
    assert there.items() <= FILES.items()
    site.asked.clear()
    go(tmp_path)
    assert here(tmp_path) == FILES
    assert not any(site.bytes_sent(BASE + name) for name in there)


def test_a_wrong_checksum_leaves_nothing(site, go, tmp_path):
    wrong = sha256(b"something else").hexdigest()
    (tmp_path / "list").write_text(f"{VIDEO} {wrong} -\n")
    expected = (
        rf"video\.mp4: expected the file with SHA-256 {wrong}, as it is listed, found another"
    )
    with pytest.raises(InputError, match=expected):
        go(tmp_path / "d", manifest=tmp_path / "list", url=f"{site.url}{BASE}")
    assert here(tmp_path / "d") == {}


def test_a_disk_that_fills_up_keeps_what_came(go, tmp_path):
    with (
        files_no_larger_than(100_000),
        pytest.raises(InputError, match=r"room and permission .*goes on from what is there"),
    ):
        go(tmp_path)
    assert here(tmp_path).items() <= FILES.items()
    go(tmp_path)
    assert here(tmp_path) == FILES


def test_a_disk_that_is_too_small(go, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=300_000))
    with pytest.raises(InputError, match=r"room for 335\.0 kB, found 300\.0 kB on that disk"):
        go(tmp_path)
    assert here(tmp_path) == {}


OUTSIDE = r"line 1 of .*expected paths of files within the data set"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        *((f"{name} - 1\n", OUTSIDE) for name in ("../out", "/etc/passwd", "a/.ssh/x", "a\\b")),
        ("# nothing\nvideo.mp4\n", r"line 2 of .*: expected PATH SHA-256 BYTES.*'video.mp4'"),
        ("# nothing\n", "a list of files, found none in it"),
    ],
)
def test_a_list_that_leads_elsewhere_or_is_none_is_refused(go, tmp_path, text, sentence):
    (tmp_path / "list").write_text(text)
    with pytest.raises(InputError, match=sentence):
        go(tmp_path / "d", manifest=tmp_path / "list", url="http://x")


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("/all.zip", r"a folder that lists the .* files, found none in it"),
        ("/empty/", r"a folder that lists the .* files, found none in it; .*--manifest"),
        ("/nowhere", "expected an answer, found 404 Not Found"),
        ("http://127.0.0.1:9/", "expected an answer, found no connection"),
    ],
)
def test_an_address_without_a_list_is_refused(site, go, tmp_path, address, sentence):
    site.files = {"/all.zip": RNG.bytes(1_000_000)}
    with pytest.raises(InputError, match=sentence):
        go(tmp_path, url=address if address.startswith("http") else site.url + address)


@pytest.fixture
def hub(site, serve_as):
    """The files of a data set as the Hugging Face hub lists and serves it, on two pages."""
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
    serve_as("cluster-haptic-accel", url)
    return files


def test_a_folder_of_the_hub(site, hub, tmp_path, capsys):
    found = afferents.fetch("cluster-haptic-accel", tmp_path / "d", quiet=True)
    assert here(tmp_path / "d") == hub
    assert (found.fetched, found.n_bytes) == (2, 18_000)
    said = capsys.readouterr().err
    assert "Licence: CC BY 4.0." in said
    assert "2 file(s), 18.0 kB, listed by" in said
    assert "Of 1 no checksum is known" in said
    path = next(iter(site.files))
    site.files[path] = bytes(9_000)
    with pytest.raises(InputError, match=r"a\.parquet: expected the file with SHA-256"):
        afferents.fetch("cluster-haptic-accel", tmp_path / "again", quiet=True)


NO_LIST = "the hub's list of files, found another answer; see"
WITHIN = "expected paths of files within the data set"


@pytest.mark.usefixtures("hub")
@pytest.mark.parametrize(
    ("answer", "sentence"),
    [
        *(
            (answer, NO_LIST)
            for answer in ("<html>", '{"error": "gone"}', '[{"type": "file"}]', "[7]")
        ),
        ('[{"type": "file", "path": "/etc/x", "size": 1}]', WITHIN),
        (r'[{"type": "file", "path": "a\\b", "size": 1}]', WITHIN),
    ],
)
def test_what_is_no_list_of_the_hub_is_refused(site, tmp_path, answer, sentence):
    site.next, site.pages = {}, dict.fromkeys(site.pages, answer)
    with pytest.raises(InputError, match=sentence):
        afferents.fetch("cluster-haptic-accel", tmp_path / "d", quiet=True)
    assert not (tmp_path / "d").exists()


TREE = "/repos/LIMB-UCF/NTP/git/trees/HEAD"


@pytest.fixture
def github(site, serve_as, monkeypatch):
    """The files of a repository as GitHub lists and serves them."""
    monkeypatch.setattr(listing, "RAW", site.url + "/raw")
    files = {"data/processed/T0/Data[T(0)].csv": bytes(9_000), "data/raw/T0/x.csv": b"x"}
    rows = [{"type": "blob", "path": path, "size": len(files[path])} for path in files]
    rows += [{"type": "tree", "path": "data"}, {"type": "blob", "path": ".gitignore", "size": 1}]
    site.files = {f"/raw/LIMB-UCF/NTP/HEAD/{path}": content for path, content in files.items()}
    site.pages = {TREE: json.dumps({"tree": rows, "truncated": False})}
    serve_as("ntp", TREE)
    return files


def test_a_repository_of_github(github, tmp_path, capsys):
    found = afferents.fetch("ntp", tmp_path / "d", quiet=True)
    assert here(tmp_path / "d") == {path: github[path] for path in github if "raw" not in path}
    assert (found.fetched, found.n_bytes) == (1, 9_000)
    said = capsys.readouterr().err
    assert "Licence: none named: ask its authors" in said
    assert "1 file(s), 9.0 kB, listed by" in said


@pytest.mark.usefixtures("github")
@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        ("<html>", "GitHub's list of files, found another answer"),
        ('{"message": "Not Found"}', "GitHub's list of files, found another answer"),
        ('{"tree": [], "truncated": true}', "a list of all files, found one that was cut off"),
    ],
)
def test_what_is_no_list_of_github_is_refused(site, tmp_path, answer, expected):
    site.pages = {TREE: answer}
    with pytest.raises(InputError, match=expected):
        afferents.fetch("ntp", tmp_path, quiet=True)


@pytest.mark.parametrize(
    ("name", "address"),
    [
        *((n, r"api\.github\.com/repos/[^/]+/[^/]+/git/trees/HEAD") for n in ON_GITHUB),
        *((n, rf"[^/]+/api/datasets/[^/]+/[^/]+/tree/main/sensor_data/{n[15:]}") for n in ON_HUB),
    ],
)
def test_sets_that_are_listed_by_a_program_are_described(name, address):
    """The list's form is what tells it from a landing page."""
    public = fetching.public_sets()[name]
    assert re.fullmatch(f"https://{address}", public.url)
    assert name in PACKAGED
    assert name in public.next_step
    assert public.only or name in ON_HUB


def test_the_list_of_fabricslide_is_whole():
    public = fetching.public_sets()["fabricslide"]
    files = read_manifest(public.manifest, public.url)
    assert len(files) == 990
    assert {f.path.split("/")[1] for f in files} == {"board", "fabric"}
    assert all(f.sha256 and f.n_bytes for f in files)
    assert files[0].url == public.url + files[0].path
    assert format_manifest(files) == "".join(
        line for line in public.manifest.read_text().splitlines(True) if line[0] != "#"
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
    assert (
        code,
        "one of pestell2022, fabricslide, cluster-haptic-accel, cluster-haptic-audio, ntp" in err,
    ) == (2, True)
