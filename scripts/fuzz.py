"""Give every command bad input, bad surroundings and bad luck: ``python scripts/fuzz.py``.

To be run with the Python that the package is installed in. Everything is made in a folder (by
default ``out/fuzz``) from ``--seed``; what all cases need is made there once. ``--only REGEX`` and
``--share 0.1`` choose cases, ``--list`` prints their names, ``--keep`` keeps every case's folder. All
cases take hours.

A line for each case that falls short, and a last line: N cases, M refused well, fell short: K. A
case falls short if the exit code is not the promised one, a traceback is printed, stderr is longer
than 12 lines, it takes more than 60 s or 4 GB, anything is left at the output path or as
``.partial-*``, an input changes, or what is clearly wrong is taken without a word.
"""

# mypy: disable-error-code="func-returns-value"

import argparse
import hashlib
import json
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import tomllib
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import soundfile
import xarray as xr
import zarr

import afferents

LIMIT_S, LIMIT_LINES, LIMIT_BYTES = 60, 12, 4 << 30
REFUSE, ACCEPT, EITHER = frozenset({2}), frozenset({0}), frozenset({0, 2})
PARTIAL = frozenset({3})
WITHOUT_POWERS = [
    "setpriv",
    "--bounding-set=-dac_override,-dac_read_search",
    "--inh-caps=-dac_override,-dac_read_search",
]
"""Before a command: root, but permissions count."""


def _arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scratch", type=Path, nargs="?", default=Path("out/fuzz"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="regular expression for the names of cases")
    parser.add_argument(
        "--share", type=float, default=1.0, help="share of the cases, drawn by the seed"
    )
    parser.add_argument("--list", action="store_true", help="print the names of the cases")
    parser.add_argument("--keep", action="store_true", help="keep every case's folder")
    return parser.parse_args()


ARGS = _arguments()
EXE = str(Path(sys.executable).with_name("afferents"))
ROOT = ARGS.scratch.absolute()
BASE, WORK = ROOT / "base", ROOT / "cases"


# Fixtures.


def run(*args, cwd=BASE, check=True):
    done = subprocess.run([EXE, *map(str, args)], cwd=cwd, capture_output=True, text=True)
    if check and done.returncode:
        sys.exit(f"fixture: afferents {' '.join(map(str, args))}: {done.stderr}")
    return done


def fixtures():
    """A session of 2 textures x 3 speeds, and all that the product makes of it."""
    BASE.mkdir(parents=True, exist_ok=True)
    steps = {
        "S": ("simulate", "S", "--textures", "a,g", "--speeds", "40,50,60", "--seconds", "3.5"),
        "Z": ("extract", "S", "Z"),
        "R": ("evaluate", "Z", "--out", "R", "--models", "ra-wave-vector,vib-te"),
        "M": ("train", "Z", "M", "--model", "ra-wave-vector"),
        "N": ("train", "Z", "N", "--model", "vib-te", "--preset", "quick"),
        "m.onnx": ("export", "M", "m.onnx"),
        "n.onnx": ("export", "N", "n.onnx"),
        "L": ("simulate", "L", "--textures", "g", "--speeds", "40", "--seconds", "12"),
    }
    for made, command in steps.items():
        if not (BASE / made).exists():
            run(*command, *(["--quiet"] if command[0] != "export" else []))
    if not (BASE / "F").exists():
        fabric(BASE / "F")
    shutil.copy(BASE / "S/3/50/video.mp4", BASE / "V.mp4")
    shutil.copy(BASE / "S/3/50/audio.wav", BASE / "A.wav")
    if not (BASE / "J.zarr").exists():
        write_jpegs(BASE / "J.avi", decoded(BASE / "V.mp4"))
        run("track", "J.avi", "J.zarr", "--sensor", "tip_b", "--quiet")


def fabric(folder, rows=420):
    folder.mkdir()
    rng = np.random.default_rng(ARGS.seed)
    header = "timestamp,proximity1,proximity2," + ",".join(f"channel{n}" for n in range(1, 17))
    for k, name in enumerate(("Linen", "Wool")):
        for speed in (20, 30, 40):
            t = np.arange(rows) * 28
            wave = np.sin(2 * np.pi * (0.02 + 0.01 * k) * speed * t / 1000)[:, None]
            taxels = (1000 + 50 * wave + rng.normal(0, 5, (rows, 16))).astype(int)
            lines = [
                ",".join(map(str, (ti, 1, 2, *row))) for ti, row in zip(t, taxels, strict=True)
            ]
            (folder / f"{name}_F120_V{speed}mmps_1.csv").write_text(
                "\n".join([header, *lines]) + "\n"
            )


# Cases.


@dataclass
class Case:
    name: str
    args: list
    want: frozenset = REFUSE
    make: object = None  # called with the case's folder
    out: list = field(default_factory=list)  # must not be there after a refusal
    keep: list = field(default_factory=list)  # must be unchanged, whatever comes
    env: dict = field(default_factory=dict)
    how: dict = field(default_factory=dict)
    after: object = None  # called with folder and process; returns what is wrong, or nothing


CASES = []


def case(name, *args, **options):
    CASES.append(Case(name, list(args), **options))


def link(source, target):
    """Copy a tree by hard links: cheap, and safe as long as files are replaced, not written."""
    if source.is_dir():
        shutil.copytree(source, target, copy_function=os.link)
    else:
        target.parent.mkdir(parents=True, exist_ok=True)
        os.link(source, target)


def put(path, content):
    """Replace a file (never write through a hard link)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_symlink() or path.exists():
        path.unlink()
    path.write_bytes(
        content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    )


def session(change=None, name="S"):
    def make(folder):
        link(BASE / "S", folder / name)
        if change:
            change(folder / name)

    return make


def unsealed(folder, name, content):
    """Replace a file of a session, and take out the checksums, which would refuse any other."""
    put(folder / name, content)
    declared = json.loads((folder / "session.json").read_text())
    del declared["checksums"]
    put(folder / "session.json", json.dumps(declared))


def given(**files):
    """Files of the case's folder: bytes, text, or a path of a fixture (`dot` stands for '.')."""

    def make(folder):
        for name, content in files.items():
            path = folder / name.replace("_dot_", ".")
            if isinstance(content, Path):
                link(content, path)
            else:
                put(path, content)

    return make


# fmt: off
# Video and wav: from here on a table of cases, some in a line.


def flipped(data, rng, n, low=0.0, high=1.0):
    out = bytearray(data)
    for _ in range(n):
        at = int((low + (high - low) * rng.random()) * (len(out) - 1))
        out[at] ^= 1 << rng.randrange(8)
    return bytes(out)


def boxes(data):
    at, found = 0, {}
    while at + 8 <= len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        found[kind.decode("latin1")] = (at, size)
        if size < 8:
            break
        at += size
    return found


def encoded(path, frames, fps=90, codec="libx264", size=(640, 480), pts=None, pixels="yuv420p", **options):
    if path.exists():
        return path.read_bytes()
    with av.open(str(path), "w", **options) as container:
        stream = container.add_stream(codec, rate=fps)
        stream.width, stream.height, stream.pix_fmt = *size, pixels
        for i, image in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(image, "gray")
            if pts is not None:
                frame.pts = pts[i]
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path.read_bytes()


def decoded(path, n=1000):
    with av.open(str(path)) as container:
        return [f.to_ndarray(format="gray") for _, f in zip(range(n), container.decode(video=0), strict=False)]


def audio_only(path):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=44100)
        for k in range(40):
            frame = av.AudioFrame.from_ndarray(np.zeros((2, 1024), np.float32), "fltp", "stereo")
            frame.sample_rate, frame.pts = 44100, 1024 * k
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path.read_bytes()


def videos(rng):
    """Name, content, and whether a track of it may succeed."""
    whole = (BASE / "V.mp4").read_bytes()
    tmp = ROOT / "tmp"
    tmp.mkdir(exist_ok=True)
    found = boxes(whole)
    moov, mdat = found["moov"], found["mdat"]
    yield "empty", b"", REFUSE
    yield "one-byte", b"\0", REFUSE
    yield "text", b"this is a video\n" * 100, REFUSE
    yield "zeros", bytes(100_000), REFUSE
    yield "noise", rng.randbytes(100_000), REFUSE
    yield "png", b"\x89PNG\r\n\x1a\n" + rng.randbytes(200), REFUSE
    for share in (0.001, 0.1, 0.5, 0.9, 0.999):
        yield f"cut-{share}", whole[: int(share * len(whole))], frozenset({2, 3})
    for k in range(4):
        low, high = moov[0] / len(whole), (moov[0] + moov[1]) / len(whole)
        yield f"moov-flips-{k}", flipped(whole, rng, 3 + 8 * k, low, high), frozenset({0, 2, 3})
    for k in range(4):
        low, high = mdat[0] / len(whole), (mdat[0] + mdat[1]) / len(whole)
        yield f"mdat-flips-{k}", flipped(whole, rng, 1 + 10 * k, low, high), frozenset({0, 2, 3})
    huge = bytearray(whole)
    huge[moov[0] : moov[0] + 4] = b"\x7f\xff\xff\xff"
    yield "huge-moov", bytes(huge), frozenset({0, 2, 3})
    huge = bytearray(whole)
    huge[mdat[0] : mdat[0] + 4] = b"\xff\xff\xff\xff"
    yield "huge-mdat", bytes(huge), frozenset({0, 2, 3})
    stts = whole.find(b"stsz")
    if stts > 0:
        huge = bytearray(whole)
        huge[stts + 12 : stts + 16] = b"\x7f\xff\xff\xff"
        yield "huge-sample-count", bytes(huge), frozenset({0, 2, 3})
    images = decoded(BASE / "V.mp4")
    yield "audio-only", audio_only(tmp / "a.mp4"), REFUSE
    yield "one-frame", encoded(tmp / "1.mp4", images[:1]), REFUSE
    yield "ten-frames", encoded(tmp / "10.mp4", images[:10]), REFUSE
    yield "tiny-frames", encoded(tmp / "t.mp4", [i[:16, :16] for i in images[:30]], size=(16, 16)), REFUSE
    yield "black", encoded(tmp / "b.mp4", [np.zeros_like(images[0])] * 60), REFUSE
    yield "white", encoded(tmp / "w.mp4", [np.full_like(images[0], 255)] * 60), REFUSE
    yield "noise-frames", encoded(tmp / "n.mp4", [
        np.frombuffer(rng.randbytes(640 * 480), np.uint8).reshape(480, 640) for _ in range(20)]), REFUSE
    yield "turned", encoded(tmp / "r.mp4", [np.ascontiguousarray(i.T) for i in images[:30]], size=(480, 640)), REFUSE
    yield "mjpeg", encoded(tmp / "m.avi", images[:60], codec="mjpeg", pixels="yuvj420p"), ACCEPT


def audio(rng):
    """Name, content, and what `extract` should do with it."""
    whole = (BASE / "A.wav").read_bytes()
    samples, rate = soundfile.read(str(BASE / "A.wav"), dtype="float32", always_2d=True)
    tmp = ROOT / "tmp"
    tmp.mkdir(exist_ok=True)

    def wav(name, values, rate=rate, subtype="PCM_16", form="WAV"):
        path = tmp / f"{name}.wav"
        soundfile.write(str(path), values, rate, subtype=subtype, format=form)
        return path.read_bytes()

    def patched(at, packed):
        return whole[:at] + packed + whole[at + len(packed) :]

    yield "empty", b"", REFUSE
    yield "text", b"RIFF but no", REFUSE
    yield "noise", rng.randbytes(50_000), REFUSE
    yield "header-only", whole[:44], REFUSE
    yield "cut-20", whole[:20], REFUSE
    yield "cut-half", whole[: len(whole) // 2], REFUSE
    yield "cut-a-bit", whole[:-10_000], REFUSE
    yield "riff-size-0", patched(4, bytes(4)), EITHER
    yield "data-size-huge", patched(40, b"\xf0\xff\xff\x7f"), REFUSE
    yield "data-size-0", patched(40, bytes(4)), EITHER
    yield "rate-0", patched(24, bytes(4)), REFUSE
    yield "rate-1", patched(24, b"\1\0\0\0"), REFUSE
    yield "rate-4e9", patched(24, b"\xff\xff\xff\xff"), REFUSE
    yield "channels-0", patched(22, b"\0\0"), REFUSE
    yield "channels-65535", patched(22, b"\xff\xff"), REFUSE
    yield "bits-0", patched(34, b"\0\0"), REFUSE
    yield "format-unknown", patched(20, b"\x99\x99"), REFUSE
    for k in range(3):
        yield f"header-flips-{k}", flipped(whole[:44], rng, 2) + whole[44:], EITHER
    yield "mono", wav("mono", samples[:, :1]), REFUSE
    yield "three-channels", wav("three", np.repeat(samples[:, :1], 3, 1)), REFUSE
    yield "rate-8000", wav("8k", samples, 8000), REFUSE
    yield "rate-192000", wav("192k", samples, 192000), REFUSE
    yield "8-bit", wav("u8", samples, subtype="PCM_U8"), ACCEPT
    yield "24-bit", wav("24", samples, subtype="PCM_24"), ACCEPT
    yield "float", wav("f", samples, subtype="FLOAT"), ACCEPT
    yield "double", wav("d", samples, subtype="DOUBLE"), ACCEPT
    floats = wav("f2", samples, subtype="FLOAT")
    yield "float-cut", floats[: int(0.9 * len(floats))], REFUSE
    deep = wav("x24", samples, subtype="PCM_24", form="WAVEX")
    yield "24-bit-extensible-cut", deep[: int(0.9 * len(deep))], REFUSE
    for name, value in (("nan", np.nan), ("inf", np.inf), ("1e30", 1e30)):
        bad = samples.copy()
        bad[len(bad) // 2 :: 100, 1] = value
        yield f"float-{name}", wav(f"f{name}", bad, subtype="FLOAT"), REFUSE
    yield "much-shorter", wav("short", samples[: int(0.5 * rate)]), REFUSE
    yield "ogg", wav("ogg", samples, subtype="VORBIS", form="OGG"), EITHER
    yield "flac", wav("flac", samples, form="FLAC"), EITHER


def media(rng):
    films = list(videos(rng))
    for name, content, want in films:
        case(f"video {name}: track", "track", "v.mp4", "o.zarr", "--sensor", "tip_b", "--quiet",
             make=given(v_dot_mp4=content), want=want, out=["o.zarr"], keep=["v.mp4"])
        strict = REFUSE if want != ACCEPT else EITHER
        if "flips" in name or "huge" in name:
            strict = EITHER
        case(f"video {name}: extract", "extract", "S", "Z", "--workers", "1", "--quiet",
             make=session(lambda s, c=content: unsealed(s, "0/40/video.mp4", c)), want=strict)
    for name in ("cut-0.5", "audio-only", "black", "noise", "empty"):
        content = next(c for n, c, _ in films if n == name)
        case(f"video {name}: inspect", "inspect", "v.mp4", "--out", "p", "--overlay", "o.mp4", "--quiet",
             make=given(v_dot_mp4=content), out=["o.mp4"])
        case(f"video {name}: calibrate", "calibrate", "v.mp4", "--out", "s.toml",
             make=given(v_dot_mp4=content), out=["s.toml"])
        case(f"video {name}: live", "live", "--model", "m.onnx", "--video", "replay:v.mp4",
             "--speed", "max", "--json", make=given(v_dot_mp4=content, m_dot_onnx=BASE / "m.onnx"),
             want=EITHER if name == "black" else REFUSE)

    for name, content, want in audio(rng):
        case(f"wav {name}: inspect", "inspect", "a.wav", "--out", "p", "--quiet",
             make=given(a_dot_wav=content), want=EITHER, keep=["a.wav"])
        case(f"wav {name}: extract", "extract", "S", "Z", "--workers", "1", "--quiet",
             make=session(lambda s, c=content: unsealed(s, "0/40/audio.wav", c)), want=want,
             after=None if want != REFUSE else nothing_of("0/40"))
    case("keep-going: one bad recording", "extract", "S", "Z", "--keep-going", "--quiet",
         make=session(lambda s: put(s / "3/50/video.mp4", b"")), want=PARTIAL)
    case("keep-going: all bad", "extract", "S", "Z", "--keep-going", "--quiet", "--workers", "1",
         make=session(lambda s: [put(v, b"") for v in s.glob("*/*/video.mp4")]), want=PARTIAL)


def nothing_of(name):
    def after(folder, done):
        return f"Z/{name} was written" if (folder / "Z" / name / "zarr.json").exists() else ""
    return after


# Wrong, plausible.


def swap(session, one, other):
    a, b, c = session / one, session / other, session / "tmp"
    a.rename(c), b.rename(a), c.rename(b)


def plausible():
    """Data that decode well and are wrong."""
    extract = ("extract", "S", "Z", "--workers", "2", "--quiet")
    case("plausible: one recording copied under a further speed", *extract,
         make=session(lambda s: [(shutil.rmtree(s / t / "50"), link(s / t / "40", s / t / "50")) for t in ("0", "3")]))
    case("plausible: two drums swapped in a session with checksums", *extract,
         make=session(lambda s: swap(s, "0/50", "3/50")))
    case("plausible: speed twice, 40 and 40.0", *extract,
         make=session(lambda s: [link(s / t / "50", s / t / "40.0") for t in ("0", "3")]))
    case("plausible: texture twice, 3 and 3.0", *extract,
         make=session(lambda s: link(s / "3", s / "3.0")))
    case("plausible: audio of another recording", *extract,
         make=session(lambda s: put(s / "0/50/audio.wav", (BASE / "S/3/60/audio.wav").read_bytes())))
    images = []

    def film(change, **options):
        def make(folder):
            images[:] = images or decoded(BASE / "S/0/40/video.mp4")
            link(BASE / "S", folder / "S")
            path = folder / "x.mp4"
            content = encoded(path, change(images), **options)
            path.unlink()
            put(folder / "S/0/40/video.mp4", content)
        return make

    one = (*extract[:3], "--workers", "1", "--quiet")
    case("plausible: 30 frames a second", *one, make=film(lambda i: i[::3], fps=30))
    case("plausible: 96 frames a second for 90", *one, make=film(lambda i: i, fps=96), want=EITHER)
    case("plausible: every frame four times", *one, make=film(lambda i: [f for f in i[::4] for _ in range(4)]))
    case("plausible: frozen picture", *one, make=film(lambda i: i[:20] + [i[20]] * (len(i) - 20)))
    case("plausible: video of half the length", *one, make=film(lambda i: i[: len(i) // 2]))
    case("plausible: skin covered after a second", *one,
         make=film(lambda i: i[:90] + [np.zeros_like(i[0])] * (len(i) - 90)))
    for name, text in {
        "steady_s beyond the end": '{"steady_s": [1.5, 1e9]}',
        "steady_s after the end": '{"steady_s": [100, 200]}',
        "direction against the grain": '{"direction": "-y"}',
    }.items():
        case(f"plausible: {name}", *extract, want=EITHER,
             make=session(lambda s, t=text: put(s / "session.json", json.dumps(
                 {**json.loads((s / "session.json").read_text()), **json.loads(t)}))))
    case("plausible: height map called models", "simulate", "S", "--textures", "a", "--speeds", "40,50",
         "--seconds", "2", "--height-map", "models=h.npy,20,0.5", "--quiet",
         make=lambda f: np.save(f / "h.npy", np.random.default_rng(0).random((64, 64))), want=ACCEPT)
    case("plausible: speeds that print alike", "simulate", "S", "--textures", "a", "--speeds",
         "40,40.0000001", "--seconds", "2", "--quiet")


# Paths.


def paths():
    odd = {
        "spaces": "my session  two", "unicode": "Sitzung-é-日本-🙂", "newline": "a\nb", "tab": "a\tb",
        "quote": "a'b\"c", "percent": "a%sb{x}", "markup": "[red]x[/red]", "colon": "a:b",
        "not-utf8": os.fsdecode(b"S\xff\xfe"), "long": "x" * 200,
    }
    for name, text in odd.items():
        case(f"path {name}: simulate", "simulate", text, "--textures", "a", "--speeds", "40", "--seconds", "1.6",
             "--workers", "1", "--quiet", want=EITHER)
        case(f"path {name}: inspect session", "inspect", text, "--out", "p", "--quiet", make=session(name=text),
             want=EITHER)
    case("path not-utf8: extract", "extract", odd["not-utf8"], "Z", "--quiet", "--workers", "2",
         make=session(name=odd["not-utf8"]), want=EITHER)
    case("path newline: missing file named in one line", "inspect", "no\nsuch\nfile", "--out", "p")
    case("path dash", "inspect", "--", "-v.mp4", "--out", "p")
    case("path dash 2", "inspect", "--out", "p", "--", "-v.mp4")
    for word in ("", ".", "..", "/", "/dev/null", "/dev/zero", "/proc/self/mem", "no/such", "x" * 300, "a\0b"[:1]):
        case(f"path {word[:20]!r}: inspect", "inspect", word, "--out", "p")
        case(f"path {word[:20]!r}: extract", "extract", word, "Z", out=["Z"])
    for word in ("", ".", "device", "f/under-a-file", "x" * 300, "loop", "dangling"):
        def make(folder, word=word):
            link(BASE / "V.mp4", folder / "v.mp4")
            put(folder / "f", "file")
            (folder / "loop").symlink_to("loop")
            os.mkfifo(folder / "device")  # stands for /dev/null, which is not for a test to lose
            (folder / "dangling").symlink_to("nowhere/at-all")
        case(f"out {word[:20]!r}: track", "track", "v.mp4", word, "--sensor", "tip_b", "--quiet", make=make,
             keep=["v.mp4", "f"])
        case(f"out {word[:20]!r}: calibrate", "calibrate", "v.mp4", "--out", word, make=make, keep=["v.mp4", "f"])
        case(f"out {word[:20]!r}: drum", "drum", "g", word, make=make, keep=["f"],
             want=EITHER if word in ("dangling", "loop") else REFUSE, after=is_device_still)
    case("symlink loop in a session", "extract", "S", "Z", "--quiet",
         make=session(lambda s: ((s / "0/40/video.mp4").unlink(), (s / "0/40/video.mp4").symlink_to("video.mp4"))))
    case("folder where video.mp4 should be", "extract", "S", "Z", "--quiet",
         make=session(lambda s: ((s / "0/40/video.mp4").unlink(), (s / "0/40/video.mp4").mkdir())))
    case("fifo where video.mp4 should be", "extract", "S", "Z", "--quiet",
         make=session(lambda s: ((s / "0/40/video.mp4").unlink(), os.mkfifo(s / "0/40/video.mp4"))))
    case("fifo for a wav: inspect", "inspect", "a.wav", "--out", "p", make=lambda f: os.mkfifo(f / "a.wav"))
    case("fifo for session.json", "inspect", "S", "--out", "p", want=EITHER,
         make=session(lambda s: ((s / "session.json").unlink(), os.mkfifo(s / "session.json"))))
    case("session.json is a folder", "inspect", "S", "--out", "p", want=EITHER,
         make=session(lambda s: ((s / "session.json").unlink(), (s / "session.json").mkdir())))
    case("hole in the grid", "extract", "S", "Z", make=session(lambda s: shutil.rmtree(s / "3/50")), out=["Z"])
    case("speed folder 'fast'", "extract", "S", "Z", make=session(lambda s: (s / "3/50").rename(s / "3/fast")), out=["Z"])
    case("speed folder '0'", "extract", "S", "Z", make=session(lambda s: (s / "3/50").rename(s / "3/0")), out=["Z"])
    case("speed folder '-50'", "extract", "S", "Z", make=session(lambda s: (s / "3/50").rename(s / "3/-50")), out=["Z"])
    case("speed folder of 400 digits", "extract", "S", "Z", out=["Z"],
         make=session(lambda s: (s / "3/50").rename(s / ("3/" + "9" * 250))))
    case("some without audio", "extract", "S", "Z", make=session(lambda s: (s / "3/50/audio.wav").unlink()), out=["Z"])
    # output that is there
    def there(folder):
        link(BASE / "S", folder / "S"), link(BASE / "V.mp4", folder / "v.mp4"), link(BASE / "Z", folder / "Z")
        link(BASE / "M", folder / "M")
        put(folder / "d/precious.txt", "precious"), put(folder / "f", "precious")
    precious = ["d/precious.txt", "f", "v.mp4", "S/session.json", "M/model.json"]
    for name, args in {
        "track onto a folder": ("track", "v.mp4", "d", "--sensor", "tip_b"),
        "track onto itself": ("track", "v.mp4", "v.mp4", "--sensor", "tip_b"),
        "extract onto a folder": ("extract", "S", "d"),
        "extract onto its session": ("extract", "S", "S"),
        "simulate onto a folder": ("simulate", "d"),
        "simulate onto another session": ("simulate", "S", "--seconds", "2"),
        "evaluate onto a folder": ("evaluate", "Z", "--out", "d", "--models", "ra-wave-vector"),
        "evaluate onto its store": ("evaluate", "Z", "--out", "Z", "--models", "ra-wave-vector"),
        "train onto a folder": ("train", "Z", "d", "--model", "ra-wave-vector"),
        "train onto a file": ("train", "Z", "f", "--model", "ra-wave-vector"),
        "export onto a folder": ("export", "M", "d"),
        "export onto its card": ("export", "M", "M/model.json"),
        "calibrate onto the clip": ("calibrate", "v.mp4", "--out", "v.mp4"),
        "inspect's overlay onto the clip": ("inspect", "v.mp4", "--out", "p", "--overlay", "v.mp4"),
        "inspect's pictures onto a file": ("inspect", "v.mp4", "--out", "f"),
        "explain onto a file": ("explain", "M", "Z", "--out", "f"),
        "drum onto a video": ("drum", "g", "v.mp4"),
        "drum onto a folder": ("drum", "g", "d"),
        "inspect's overlay onto another file": ("inspect", "v.mp4", "--out", "p", "--overlay", "f"),
        "inspect's overlay onto a folder": ("inspect", "v.mp4", "--out", "p", "--overlay", "d"),
        "explain onto a folder with files": ("explain", "M", "Z", "--out", "d"),
        "reproduce onto a file": ("reproduce", "f"),
        "report of a folder": ("report", "d"),
        "status of a folder": ("status", "d"),
    }.items():
        case(f"there: {name}", *args, make=there, keep=precious)


def is_device_still(folder, done):
    return "" if (folder / "device").is_fifo() else "device replaced by a file"


def permissions():
    """Where this runs as root, without its power to pass over permissions."""
    def shut(*names):
        def make(folder):
            link_all(folder)
            for name in names:
                path = folder / name
                if path.is_file():  # its own inode, so that the fixture keeps its mode
                    put(path, path.read_bytes())
                path.chmod(0)
        return make

    def link_all(folder):
        for name in ("S", "Z", "R", "M"):
            shutil.copytree(BASE / name, folder / name)
        shutil.copy(BASE / "V.mp4", folder / "v.mp4"), shutil.copy(BASE / "m.onnx", folder / "m.onnx")
        (folder / "w").mkdir()
        (folder / "w").chmod(0o777)

    def sealed(folder):
        link_all(folder)
        for path in [folder, *folder.rglob("*")]:
            if path.name != "w":
                path.chmod(path.stat().st_mode & ~0o222)

    how = {"mortal": True}
    case("shut: video", "track", "v.mp4", "w/o", "--sensor", "tip_b", make=shut("v.mp4"), how=how, out=["w/o"])
    case("shut: session", "extract", "S", "w/Z", make=shut("S"), how=how, out=["w/Z"])
    case("shut: session.json", "extract", "S", "w/Z", make=shut("S/session.json"), how=how, out=["w/Z"])
    case("shut: texture folder", "extract", "S", "w/Z", make=shut("S/3"), how=how, out=["w/Z"])
    case("shut: wav", "extract", "S", "w/Z", "--workers", "1", make=shut("S/0/40/audio.wav"), how=how)
    case("shut: store", "evaluate", "Z", "--out", "w/R", "--models", "ra-wave-vector", make=shut("Z"), how=how, out=["w/R"])
    case("shut: store's chunk", "evaluate", "Z", "--out", "w/R", "--models", "ra-wave-vector",
         make=shut("Z/0/40/position/c"), how=how)
    case("shut: results", "report", "R", make=shut("R/summary.json"), how=how)
    case("shut: card", "export", "M", "w/m.onnx", make=shut("M/model.json"), how=how, out=["w/m.onnx"])
    case("shut: weights", "export", "M", "w/m.onnx", make=shut("M/weights.safetensors"), how=how, out=["w/m.onnx"])
    case("shut: onnx", "live", "--model", "m.onnx", "--video", "replay:v.mp4", "--speed", "max", "--json",
         make=shut("m.onnx"), how=how)
    for name, args in {
        "track": ("track", "v.mp4", "o", "--sensor", "tip_b"), "extract": ("extract", "S", "o", "--workers", "1"),
        "simulate": ("simulate", "o", "--textures", "a", "--speeds", "40", "--seconds", "2"),
        "evaluate": ("evaluate", "Z", "--out", "o", "--models", "ra-wave-vector", "--workers", "1"),
        "evaluate on": ("evaluate", "Z", "--out", "R", "--models", "sa-wave", "--workers", "1"),
        "report": ("report", "R"), "train": ("train", "Z", "o", "--model", "ra-wave-vector"),
        "export": ("export", "M", "o"), "explain": ("explain", "M", "Z", "--out", "o"),
        "calibrate": ("calibrate", "v.mp4", "--out", "o.toml"), "inspect": ("inspect", "v.mp4"),
        "drum": ("drum", "g", "o"), "reproduce": ("reproduce", "o"),
    }.items():
        case(f"read-only: {name}", *args, make=sealed, how=how)


# Documents.


def session_files():
    texts = {
        "empty": "", "null": "null", "a list": "[]", "a number": "1", "text": "hello", "cut": '{"fps_hz": 9',
        "bytes": b"\xff\xfe\x00", "bom": b"\xef\xbb\xbf{}", "deep": "[" * 100_000, "deep objects": '{"a":' * 50_000,
        "huge number": '{"fps_hz": ' + "9" * 5000 + "}", "1e999": '{"fps_hz": 1e999}', "NaN": '{"fps_hz": NaN}',
        "Infinity": '{"fps_hz": Infinity}', "-1": '{"fps_hz": -1}', "0": '{"fps_hz": 0}', "text for fps": '{"fps_hz": "fast"}',
        "rate NaN": '{"sample_rate_hz": NaN}', "rate inf": '{"sample_rate_hz": Infinity}',
        "rate list": '{"sample_rate_hz": [44100]}', "channels 0": '{"audio_channels": 0}',
        "sensor channel 2": '{"sensor_channel": 2}', "sensor channel -1": '{"sensor_channel": -1}',
        "width huge": '{"frame_width": 1e18}', "steady NaN": '{"steady_s": [NaN, NaN]}',
        "steady reversed": '{"steady_s": [3, 1]}', "steady one": '{"steady_s": [1]}', "steady text": '{"steady_s": "x"}',
        "direction": '{"direction": "../../x"}', "holes number": '{"holes": 5}', "holes traversal": '{"holes": [["../../x", 5, 6]]}',
        "simulated text": '{"simulated": "perhaps"}',
    }
    for name, text in texts.items():
        case(f"session.json {name}", "extract", "S", "Z", "--workers", "1", "--quiet", out=["Z"],
             make=session(lambda s, t=text: put(s / "session.json", t)),
             want=EITHER if name == "bom" else REFUSE)
    for name in ("deep", "NaN", "Infinity", "text"):
        case(f"session.json {name}: inspect", "inspect", "S", "--out", "p", "--quiet",
             make=session(lambda s, t=texts[name]: put(s / "session.json", t)))
        case(f"session.json {name}: simulate goes on", "simulate", "S", "--textures", "a,g", "--speeds", "40,50,60",
             "--seconds", "3.5", "--quiet", make=session(lambda s, t=texts[name]: put(s / "session.json", t)))
    many = json.dumps({"holes": [["x", i] for i in range(300_000)]})
    case("session.json 300,000 holes", "inspect", "S", "--out", "p", "--quiet", want=EITHER,
         make=session(lambda s: put(s / "session.json", many)))


def sensors(rng):
    text = (Path(afferents.__file__).parent / "markers/sensors/tip_b.toml").read_text()
    track = ("track", "v.mp4", "o.zarr", "--sensor", "s.toml", "--quiet")

    def toml(name, content, want=REFUSE):
        case(f"sensor {name}", *track, make=given(s_dot_toml=content, v_dot_mp4=BASE / "V.mp4"), want=want, out=["o.zarr"])

    for name, content in {
        "empty": "", "text": "hello", "bytes": b"\xff\xfe", "json": "{}", "deep list": "a = " + "[" * 100_000,
        "deep table": "[" + ".".join("a" * 50_000) + "]", "deep dotted": ".".join("a" * 100_000) + " = 1",
        "huge integer": "rows = " + "9" * 5000, "unknown key": text + "\nspeed = 3\n",
        "twice": text + "\n[detector]\n", "no detector": text.split("[detector]")[0],
        "nul": text.replace("tip_b", "ti\0p"), "name traversal": text.replace('"tip_b"', '"../../x"'),
    }.items():
        toml(name, content, EITHER if name == "name traversal" else REFUSE)
    for key in re.findall(r"^(\w+) =", text, re.M):
        for value in ("nan", "inf", "-1", "1e308", '"x"', "[1]", "true"):
            bad = re.sub(rf"^{key} = \S+", f"{key} = {value}", text, count=1, flags=re.M)
            if key in ("name", "layout") and value == '"x"':
                continue
            if rng.random() < (1.0 if value in ("nan", "inf") else 0.35):
                toml(f"{key} = {value}", bad, EITHER if value in ("1e308", "inf") else REFUSE)
        gone = re.sub(rf"^{key} = .*$", "", text, count=1, flags=re.M)
        toml(f"without {key}", gone, REFUSE if key in ("rows", "layout", "min_area_px2", "name") else EITHER)
    toml("rest_frame beyond", re.sub(r"rest_frame = \d+", "rest_frame = 100000", text))
    toml("grid of another size", text.replace("rows = 19", "rows = 9").replace("= 361", "= 171"))
    case("sensor twice a folder", "track", "v.mp4", "o", "--sensor", ".", make=given(v_dot_mp4=BASE / "V.mp4"), out=["o"])
    case("sensor ../../etc/passwd", "track", "v.mp4", "o", "--sensor", "../../../../../../etc/passwd",
         make=given(v_dot_mp4=BASE / "V.mp4"), out=["o"])


def edited(path, change):
    content = json.loads(path.read_text())
    changed = change(content)
    put(path, json.dumps(content if changed is None else changed))


def stores(rng):
    def copied(change):
        def make(folder):
            link(BASE / "Z", folder / "Z")
            change(folder / "Z")
        return make

    def array(name, change):
        """Rewrite an array's values, with its own codecs."""
        def edit(store):
            path = store / "0/40" / name
            shutil.rmtree(path), shutil.copytree(BASE / "Z/0/40" / name, path)
            values = zarr.open_array(path, mode="r+", config={"write_empty_chunks": True})
            values[...] = change(values[...])
        return edit

    def meta(name, change):
        return lambda s: edited(s / "0/40" / name / "zarr.json" if name else s / "0/40/zarr.json", change)

    def attr(**changed):
        return meta("", lambda c: c["attributes"].update(changed))

    def without(name):
        return meta("", lambda c: c["attributes"].pop(name) and None)

    def of(name, **changed):
        return meta(name, lambda c: c.update(changed))

    chunk = "0/40/position/c/0/0/0"
    whole = (BASE / "Z" / chunk).read_bytes()
    root = lambda change: lambda s: edited(s / "zarr.json", change)  # noqa: E731
    changes = {
        "root gone": lambda s: (s / "zarr.json").unlink(), "root empty": lambda s: put(s / "zarr.json", ""),
        "root a list": lambda s: put(s / "zarr.json", "[]"), "root deep": lambda s: put(s / "zarr.json", "[" * 100_000),
        "root bytes": lambda s: put(s / "zarr.json", b"\xff\xfe"),
        "foreign": root(lambda c: c.update(attributes={})), "attributes a list": root(lambda c: c.update(attributes=[1])),
        "from the future": root(lambda c: c["attributes"].update(schema=99)),
        "no config": root(lambda c: c["attributes"].pop("config") and None),
        "config a list": root(lambda c: c["attributes"].update(config=[1])),
        "recordings a number": root(lambda c: c["attributes"]["config"].update(recordings=5)),
        "sensor gone": root(lambda c: c["attributes"]["config"].pop("sensor") and None),
        "declared gone": root(lambda c: c["attributes"]["config"].pop("declared") and None),
        "group gone": lambda s: shutil.rmtree(s / "0/40"), "group's json empty": lambda s: put(s / "0/40/zarr.json", ""),
        "group's json deep": lambda s: put(s / "0/40/zarr.json", "[" * 100_000),
        "array's json gone": lambda s: (s / "0/40/position/zarr.json").unlink(),
        "array's json cut": lambda s: put(s / "0/40/position/zarr.json", '{"shape": ['),
        "array gone": lambda s: shutil.rmtree(s / "0/40/position"),
        "chunk gone": lambda s: (s / chunk).unlink(), "chunk empty": lambda s: put(s / chunk, b""),
        "chunk cut": lambda s: put(s / chunk, whole[: len(whole) // 2]),
        "chunk noise": lambda s: put(s / chunk, rng.randbytes(len(whole))),
        "chunk flipped": lambda s: put(s / chunk, flipped(whole, rng, 3, 0.3, 0.9)),
        "chunk of another recording": lambda s: put(s / chunk, (BASE / "Z/3/60/position/c/0/0/0").read_bytes()),
        "no name": without("name"), "no texture": without("texture"), "no speed": without("speed_mm_s"),
        "texture a number": attr(texture=5), "texture empty": attr(texture=""), "texture ..": attr(texture="../../x"),
        "speed text": attr(speed_mm_s="fast"), "speed 0": attr(speed_mm_s=0), "speed negative": attr(speed_mm_s=-40),
        "speed NaN": attr(speed_mm_s=float("nan")), "speed inf": attr(speed_mm_s=float("inf")),
        "speed null": attr(speed_mm_s=None), "speed of another": attr(speed_mm_s=60.0),
        "name of another": attr(name="3/60"), "steady garbage": attr(steady_s="x"), "steady one": attr(steady_s="[1]"),
        "steady a number": attr(steady_s=5), "steady reversed": attr(steady_s="[3, 1]"),
        "steady NaN": attr(steady_s="[NaN, NaN]"), "conditions garbage": attr(conditions="x"),
        "conditions a list": attr(conditions="[1]"), "rest_frame negative": attr(rest_frame=-5),
        "rest_frame text": attr(rest_frame="x"), "dims renamed": of("position", dimension_names=["a", "b", "c"]),
        "shape doubled": meta("position", lambda c: c["shape"].__setitem__(0, 2 * c["shape"][0])),
        "shape huge": meta("position", lambda c: c["shape"].__setitem__(0, 10**15)),
        "shape negative": meta("position", lambda c: c["shape"].__setitem__(0, -1)),
        "dtype int32": of("position", data_type="int32"), "dtype unknown": of("position", data_type="qubit"),
        "dtype float64": of("position", data_type="float64"), "codec unknown": of("position", codecs=[{"name": "evil"}]),
        "format 9": of("position", zarr_format=9), "chunk grid 0": of("position", chunk_grid={
            "name": "regular", "configuration": {"chunk_shape": [0, 361, 2]}}),
        "positions NaN": array("position", lambda v: np.full_like(v, np.nan)),
        "positions inf": array("position", lambda v: np.full_like(v, np.inf)),
        "positions 1e30": array("position", lambda v: v * np.float32(1e30)),
        "positions 0": array("position", lambda v: v * 0), "rest NaN": array("rest_position", lambda v: v * np.nan),
        "row twice": array("row", lambda v: v * 0), "row huge": array("row", lambda v: v + 10**6),
        "row negative": array("row", lambda v: v - 5),
        "time NaN": array("time", lambda v: v * np.nan), "time backwards": array("time", lambda v: v[::-1]),
        "time 0": array("time", lambda v: v * 0), "time in ms": array("time", lambda v: v * 1000),
    }
    fine = {"sensor gone", "declared gone", "texture ..", "texture a number"}
    for name, change in changes.items():
        case(f"store {name}: evaluate", "evaluate", "Z", "--out", "R", "--models", "ra-wave-vector", "--workers", "1",
             "--quiet", make=copied(change), want=EITHER if name in fine else REFUSE)
    for name in ("root deep", "no config", "attributes a list", "speed text", "steady garbage", "row huge", "shape huge",
                 "chunk gone", "chunk noise", "positions NaN", "dtype unknown"):
        case(f"store {name}: inspect", "inspect", "Z", "--out", "p", make=copied(changes[name]),
             want=REFUSE if name in ("root deep", "no config", "speed text", "chunk gone") else EITHER)
        case(f"store {name}: train", "train", "Z", "M", "--model", "ra-wave-vector", "--quiet", make=copied(changes[name]),
             out=["M"])
        case(f"store {name}: explain", "explain", "M", "Z", "--out", "p", "--quiet",
             make=lambda f, c=changes[name]: (copied(c)(f), link(BASE / "M", f / "M")),
             want=REFUSE if name in ("root deep", "no config", "attributes a list", "speed text") else EITHER)
    for name, change in {
        "ra2 NaN": array("ra2", lambda v: v * np.nan), "ra2 some NaN": array("ra2", lambda v: np.where(
            np.arange(len(v))[:, None] % 1000 == 0, np.nan, v)),
        "ra2 inf": array("ra2", lambda v: v + np.inf), "ra2 0": array("ra2", lambda v: v * 0),
        "ra2 1e30": array("ra2", lambda v: v * 0 + np.float32(1e30)),
        "rate 0": of("ra2", attributes={"sample_rate_hz": 0}), "rate negative": of("ra2", attributes={"sample_rate_hz": -1}),
        "rate NaN": of("ra2", attributes={"sample_rate_hz": float("nan")}),
        "rate text": of("ra2", attributes={"sample_rate_hz": "x"}), "rate gone": of("ra2", attributes={}),
        "rate 1e9": of("ra2", attributes={"sample_rate_hz": 1e9}),
        "rate 22050": of("ra2", attributes={"sample_rate_hz": 22050}),
    }.items():
        for model in ("vib-te", "ridge-te"):
            case(f"store {name}: evaluate {model}", "evaluate", "Z", "--out", "R", "--models", model, "--workers", "1",
                 "--quiet", make=copied(change), want=EITHER if name == "ra2 0" else REFUSE)
    case("store twice", "evaluate", "Z", "Z", "--out", "R", make=copied(lambda s: None), out=["R"])
    case("store copied and given twice", "evaluate", "Z", "Z2", "--out", "R",
         make=lambda f: (link(BASE / "Z", f / "Z"), link(BASE / "Z", f / "Z2")), out=["R"])
    case("store and fabricslide", "evaluate", "Z", "fabricslide:F", "--out", "R",
         make=lambda f: (link(BASE / "Z", f / "Z"), link(BASE / "F", f / "F")), out=["R"])
    case("store: a recording copied as another", "evaluate", "Z", "--out", "R", "--models", "ra-wave-vector", "--quiet",
         make=copied(lambda s: shutil.copytree(s / "0/40", s / "0/45")))


def results(rng):
    def copied(change):
        def make(folder):
            for name in ("Z", "R"):
                link(BASE / name, folder / name)
            change(folder / "R")
        return make

    fold = "folds/ra-wave-vector/nested/seed-0/50"
    files = ("config.json", "summary.json", "predictions.parquet", "plan.json", f"{fold}/fold.json",
             f"{fold}/predictions.parquet", f"{fold}/weights.safetensors")
    again = ("evaluate", "Z", "--out", "R", "--models", "ra-wave-vector,vib-te", "--workers", "1", "--quiet")
    for name in files:
        whole = (BASE / "R" / name).read_bytes()
        damages = {"cut": whole[: len(whole) // 2], "empty": b"", "noise": rng.randbytes(500)}
        if name.endswith("json"):
            damages |= {"list": b"[]", "object": b"{}", "deep": b"[" * 100_000}
        for kind, content in damages.items():
            damage = lambda r, n=name, c=content: put(r / n, c)  # noqa: E731
            read_by_report = name in files[:3]
            case(f"results {name} {kind}: report", "report", "R", "--quiet", make=copied(damage),
                 want=REFUSE if read_by_report and (kind != "object" or name != "config.json") else EITHER)
            if "fold.json" in name or "plan" in name:
                case(f"results {name} {kind}: status", "status", "R", make=copied(damage))
            if "plan" not in name and kind in ("cut", "object", "deep"):
                case(f"results {name} {kind}: evaluate again", *again, make=copied(damage),
                     want=EITHER if "weights" in name or name in files[1:3] else REFUSE)
    summary = json.loads((BASE / "R/summary.json").read_text())
    for key in summary:
        case(f"summary.json without {key}", "report", "R", "--quiet", want=EITHER,
             make=copied(lambda r, k=key: edited(r / "summary.json", lambda c: c.pop(k) and None)))
        case(f"summary.json {key} of another kind", "report", "R", "--quiet", want=EITHER,
             make=copied(lambda r, k=key: edited(r / "summary.json", lambda c: c.update({k: 12345}))))
    case("summary.json accuracy 5", "report", "R", "--quiet", make=copied(lambda r: edited(
        r / "summary.json", lambda c: c["models"]["vib-te"]["nested"].update(mean_accuracy=5))))
    case("summary.json another accuracy than predictions say", "report", "R", "--quiet", want=EITHER, make=copied(
        lambda r: edited(r / "summary.json", lambda c: c["models"]["vib-te"]["nested"].update(mean_accuracy=0.999))))
    case("summary.json script in a texture", "report", "R", "--quiet", want=EITHER, make=copied(lambda r: put(
        r / "summary.json", (r / "summary.json").read_text().replace('"3"', '"<script>alert(1)</script>"'))),
        after=no_script("R/report.html"))
    case("config.json source elsewhere", "report", "R", "--quiet", want=EITHER, make=copied(lambda r: edited(
        r / "config.json", lambda c: c["data"][0].update(source="/etc/passwd"))))
    case("report twice the same", "report", "R", "R", "--quiet", make=copied(lambda r: None))
    case("train with results of other data", "train", "Z", "M", "--model", "sa-wave", "--results", "R", "--quiet",
         make=copied(lambda r: None), out=["M"])


def no_script(page):
    def after(folder, done):
        path = folder / page
        return "script in the page" if path.exists() and "<script>alert(1)" in path.read_text() else ""
    return after


def models(rng):
    def copied(change, name="M"):
        def make(folder):
            for which in ("M", "N", "Z"):
                link(BASE / which, folder / which)
            link(BASE / "V.mp4", folder / "v.mp4")
            change(folder / name)
        return make

    card = json.loads((BASE / "M/model.json").read_text())
    weights = (BASE / "M/weights.safetensors").read_bytes()
    export = ("export", "M", "o.onnx")
    for key in card:
        if key in ("scores", "frames", "temperature", "evidence_per_s", "schema_version", "format"):
            continue
        case(f"card without {key}", *export, out=["o.onnx"], want=EITHER if card[key] is None else REFUSE,
             make=copied(lambda m, k=key: edited(m / "model.json", lambda c: c.pop(k) and None)))
    for name, changed in {
        "scale 0": {"scale": 0}, "scale NaN": {"scale": float("nan")}, "scale inf": {"scale": float("inf")},
        "temperature -1": {"temperature": -1}, "temperature NaN": {"temperature": float("nan")},
        "schema 99": {"schema_version": 99}, "family foreign": {"family": "resnet"}, "family another": {"family": "ra-se"},
        "vib family": {"family": "vib-te"}, "one texture": {"textures": ["0"]}, "three textures": {"textures": ["0", "3", "6"]},
        "textures twice": {"textures": ["0", "0"]}, "shape empty": {"shape": []}, "shape negative": {"shape": [-2, 19, 19]},
        "shape huge": {"shape": [2, 10**6, 10**6]}, "shape other": {"shape": [2, 9, 9]}, "frames 0": {"frames": 0},
        "frames 10**9": {"frames": 10**9}, "fps NaN": {"fps_hz": float("nan")}, "sensor text": {"sensor": "tip_b"},
        "sensor empty": {"sensor": {}}, "waves empty": {"waves": {}}, "waves frames 10**9": {"waves": {**(card["waves"] or {}), "frames": 10**9}},
        "unknown key": {"evil": 1},
    }.items():
        loose = name in ("sensor empty", "waves empty", "textures twice", "temperature NaN")
        case(f"card {name}: export", *export, out=["o.onnx"], want=EITHER if loose else REFUSE,
             make=copied(lambda m, c=changed: edited(m / "model.json", lambda x: x.update(c))))
    case("card deep", *export, make=copied(lambda m: put(m / "model.json", '{"sensor":' * 100_000)), out=["o.onnx"])
    case("card bytes", *export, make=copied(lambda m: put(m / "model.json", b"\xff\xfe")), out=["o.onnx"])
    header = lambda text: struct.pack("<Q", len(text)) + text  # noqa: E731
    for name, content in {
        "empty": b"", "cut": weights[: len(weights) // 2], "noise": rng.randbytes(1000), "pickle": b"\x80\x04cos\nsystem\n",
        "header huge": struct.pack("<Q", 2**60) + b"{}", "none inside": header(b"{}"),
        "another model's": (BASE / "N/weights.safetensors").read_bytes(), "flipped": flipped(weights, rng, 8, 0.9, 1.0),
    }.items():
        case(f"weights {name}: export", *export, out=["o.onnx"], want=EITHER if name == "flipped" else REFUSE,
             make=copied(lambda m, c=content: put(m / "weights.safetensors", c)))
    case("weights gone: explain", "explain", "M", "Z", "--out", "p", make=copied(lambda m: (m / "weights.safetensors").unlink()),
         out=["p"])
    whole = (BASE / "m.onnx").read_bytes()

    def onnx(name, change, want=REFUSE, video="replay:v.mp4"):
        case(f"onnx {name}: live", "live", "--model", "m.onnx", "--video", video, "--speed", "max", "--json", want=want,
             make=lambda f: (copied(lambda m: None)(f), change(f / "m.onnx")))

    for name, content in {"empty": b"", "text": b"hello", "cut": whole[: len(whole) // 2], "noise": rng.randbytes(5000),
                          "pickle": b"\x80\x04cos\nsystem\n(S'touch pwned'\ntR."}.items():
        onnx(name, lambda p, c=content: put(p, c))

    def rebuilt(change):
        def make(path):
            import onnx as library
            model = library.load(str(BASE / "m.onnx"))
            change(library, model)
            put(path, model.SerializeToString())
        return make

    def recarded(**changed):
        def change(library, model):
            for prop in model.metadata_props:
                if prop.key == "afferents":
                    prop.value = json.dumps({**json.loads(prop.value), **changed})
        return rebuilt(change)

    onnx("without a card", rebuilt(lambda lib, m: m.ClearField("metadata_props")))
    onnx("card of another shape", recarded(shape=[2, 9, 9]))
    onnx("card with more textures", recarded(textures=["0", "3", "6"]))
    onnx("card with fewer markers' sensor", recarded(sensor={"name": "x"}))
    onnx("card of vibration", recarded(family="vib-te"))
    onnx("card with waves of 10**9 frames", recarded(waves={"frames": 10**9}))
    onnx("card with waves of other frames", recarded(waves={**(card["waves"] or {}), "frames": 20}), EITHER)
    onnx("card at 30 frames/s", recarded(fps_hz=30))
    onnx("input renamed", rebuilt(lambda lib, m: setattr(m.graph.input[0], "name", "x")))

    def outside(where):
        def change(library, model):
            tensor = max(model.graph.initializer, key=lambda t: len(t.raw_data))
            size = len(tensor.raw_data)
            tensor.ClearField("raw_data")
            tensor.data_location = library.TensorProto.EXTERNAL
            for key, value in (("location", where), ("offset", "0"), ("length", str(size))):
                tensor.external_data.add(key=key, value=value)
        return rebuilt(change)

    onnx("weights in /etc/passwd", outside("/etc/passwd"))
    onnx("weights in ../secret", lambda p: (put(p.parent.parent / "secret", bytes(10_000_000)), outside("../secret")(p)))
    onnx("of a folder", lambda p: (p.unlink() if p.exists() else None, p.mkdir()))


def fabricslides():
    def copied(change):
        def make(folder):
            link(BASE / "F", folder / "F")
            change(folder / "F/Linen_F120_V20mmps_1.csv")
        return make

    def lines(change):
        def edit(path):
            rows = path.read_text().split("\n")
            changed = change(rows)
            put(path, "\n".join(rows if changed is None else changed))
        return edit

    cell = lambda value: lines(lambda r: r.__setitem__(50, r[50].rsplit(",", 1)[0] + f",{value}"))  # noqa: E731
    for name, change in {
        "empty": lambda p: put(p, ""), "header only": lines(lambda r: r[:1]), "no header": lines(lambda r: r[1:]),
        "text": cell("abc"), "nan": cell("nan"), "inf": cell("inf"), "float": cell("1.5"), "1e5": cell("1e5"),
        "huge": cell("9" * 18), "huger": cell("9" * 40), "negative": cell("-5"), "blank": cell(""),
        "arabic digits": cell("٣"), "field short": lines(lambda r: r.__setitem__(50, r[50].rsplit(",", 1)[0])),
        "field long": lines(lambda r: r.__setitem__(50, r[50] + ",1")), "row gone": lines(lambda r: r.pop(50) and None),
        "ten rows gone": lines(lambda r: r[:50] + r[60:]), "row twice": lines(lambda r: r.insert(50, r[50])),
        "blank line": lines(lambda r: r.insert(50, "")), "rows reversed": lines(lambda r: [r[0], *r[:0:-1]]),
        "columns swapped": lines(lambda r: r.__setitem__(0, r[0].replace("channel1,", "channelX,"))),
        "binary": lambda p: put(p, bytes(range(256)) * 50), "cut mid-line": lambda p: put(p, p.read_bytes()[:-30]),
        "utf-16": lambda p: put(p, p.read_text().encode("utf-16")), "crlf": lambda p: put(p, p.read_bytes().replace(b"\n", b"\r\n")),
        "bom": lambda p: put(p, b"\xef\xbb\xbf" + p.read_bytes()), "semicolons": lambda p: put(p, p.read_bytes().replace(b",", b";")),
        "two rows": lines(lambda r: r[:3]), "speed 0": lambda p: p.rename(p.with_name("Linen_F120_V0mmps_1.csv")),
    }.items():
        fine = EITHER if name in ("row twice", "crlf", "negative", "bom", "huge", "float", "1e5", "utf-16") else REFUSE
        case(f"fabricslide {name}", "evaluate", "fabricslide:F", "--out", "R", "--models", "ridge-te", "--workers", "1", "--quiet",
             make=copied(change), want=fine)
    case("fabricslide keep-going", "evaluate", "fabricslide:F", "--out", "R", "--models", "ridge-te", "--workers", "1", "--quiet",
         "--keep-going", make=copied(cell("abc")), want=frozenset({2, 3}))
    for word in ("fabricslide:", "fabricslide:nowhere", "fabricslide:/dev/null", "foo:bar", "fabricslide:F:F"):
        case(f"fabricslide {word}", "evaluate", word, "--out", "R", out=["R"])


# Pictures damaged one by one, and such that change their size.


TAXELS = ["taxel0", "taxel1", "taxel2"]
FLIPPED, OFF_PX = range(100, 200, 10), 5


def jpeg(image):
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()


def write_jpegs(path, images, damage=None):
    """Write a clip of JPEGs; `damage` is given the number and the bytes of each."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=90)
        stream.height, stream.width = images[0].shape
        stream.pix_fmt = "yuvj420p"
        for number, image in enumerate(images):
            whole = jpeg(image)
            packet = av.Packet(damage(number, whole) if damage else whole)
            packet.stream, packet.time_base = stream, Fraction(1, 90)
            packet.pts = packet.dts = number
            container.mux(packet)
    return path.read_bytes()


def flip_of(rng):
    """Return what flips one bit of some pictures, behind their headers."""
    return lambda n, whole: flipped(whole, rng, 1, 0.1, 0.99) if n in FLIPPED else whole


def halved(n, whole):
    return whole[: len(whole) // 2] if n in FLIPPED else whole


def markers_hold(folder, done):
    """Return what is wrong if many markers of damaged pictures count as detected far off."""
    if done.rc:
        return ""
    (whole,), (found,) = (
        [xr.open_zarr(path, consolidated=False).load()] for path in (BASE / "J.zarr", folder / "o.zarr")
    )
    truth = whole.sel(time=found.time, method="nearest", tolerance=1e-3)
    off = np.linalg.norm(found.position.values - truth.position.values, axis=2)
    near = np.isin(np.round(found.time.values * 90).astype(int), [n + d for n in FLIPPED for d in (0, 1)])
    wrong = float((off[near] >= OFF_PX).mean())
    return f"{wrong:.1%} of the markers detected {OFF_PX} px off" if wrong > 0.02 else ""


def damaged_pictures(rng):
    images, tmp = decoded(BASE / "V.mp4"), ROOT / "tmp"
    tmp.mkdir(exist_ok=True)
    track = ("track", "v.avi", "o.zarr", "--sensor", "tip_b", "--quiet")
    for k in range(4):
        content = write_jpegs(tmp / "d.avi", images, flip_of(rng))
        case(f"pictures with one bit flipped {k}", *track, make=given(v_dot_avi=content), want=EITHER, keep=["v.avi"],
             after=markers_hold)
    content = write_jpegs(tmp / "d.avi", images, halved)
    case("pictures cut at half", *track, make=given(v_dot_avi=content), want=EITHER, keep=["v.avi"], after=markers_hold)
    case("pictures with one bit flipped: inspect", "inspect", "v.avi", "--out", "p", "--quiet", make=given(v_dot_avi=content),
         want=EITHER)
    for name, change in {
        "half the size": lambda i: cv2.resize(i, (320, 240)), "turned": lambda i: np.ascontiguousarray(i.T),
        "a border more": lambda i: cv2.copyMakeBorder(i, 0, 16, 0, 16, cv2.BORDER_CONSTANT),
    }.items():
        mixed = [change(i) if 150 <= n < 250 else i for n, i in enumerate(images)]
        content = write_jpegs(tmp / "d.avi", mixed)
        case(f"size changes to {name}: track", *track, make=given(v_dot_avi=content), want=PARTIAL, keep=["v.avi"])
        case(f"size changes to {name}: inspect", "inspect", "v.avi", "--out", "p", "--quiet", make=given(v_dot_avi=content))
        case(f"size changes to {name}: live", "live", "--model", "m.onnx", "--video", "replay:v.avi", "--speed", "max", "--json",
             make=given(v_dot_avi=content, m_dot_onnx=BASE / "m.onnx"))

        def make(folder, mixed=mixed):
            for n, image in enumerate(mixed[120:180]):
                put(folder / f"v/{n:04d}.jpg", jpeg(image))
        case(f"size changes to {name}: images", "track", "v", "o.zarr", "--sensor", "tip_b", "--fps", "90", "--quiet", make=make,
             want=PARTIAL)


# Files that people write, with a key or two less.


SESSION_TEXT = """sensor = "tip_b"
fps_hz = 90
fps_overrules = true
sample_rate_hz = 44100
audio_channels = 2
sensor_channel = 1
frame_width = 640
frame_height = 480
direction = "+x"
simulated = true
steady_s = [0.5, 3.0]
conditions = { rig = "one" }
[[recordings]]
video = "0/40/video.mp4"
audio = "0/40/audio.wav"
texture = "0"
speed_mm_s = 40
repetition = 1
id = "one"
[[recordings]]
video = "3/50/video.mp4"
audio = "3/50/audio.wav"
texture = "3"
speed_mm_s = 50
rest_frame = 12
"""
DATA_SET_TEXT = """title = "Fabrics"
simulated = true
[files]
pattern = "{texture}_F120_V{speed}mmps_{trial}.csv"
speed_unit = "mm/s"
folders = ["."]
[signal]
time = "timestamp"
time_unit = "ms"
channels = ["channel*"]
steady_s = [1, 10]
units = "counts"
separator = ","
[encodings.spectral]
window_s = 1.0
"""
RECIPE_TEXT = """max_epochs = 1
learning_rate = 1e-4
batch_size = 16
patience = 3
"""


def missing_keys(rng):
    def without(text):
        """Yield a name, and the text without one line; some with two less."""
        rows = text.splitlines()
        lacking = [{n} for n in range(len(rows))] + [set(rng.sample(range(len(rows)), 2)) for _ in range(5)]
        for gone in lacking:
            name = " and ".join(f"{rows[n].partition(' =')[0]} of line {n + 1}" for n in sorted(gone))
            yield name, "\n".join(row for n, row in enumerate(rows) if n not in gone) + "\n"

    for name, text in without(SESSION_TEXT):
        case(f"session.toml without {name}", "inspect", "S", "--out", "p", "--quiet", want=EITHER, make=session(
            lambda s, t=text: ((s / "session.json").unlink(), put(s / "session.toml", t))))
    for name, text in without(DATA_SET_TEXT):
        def make(folder, text=text):
            link(BASE / "F", folder / "F")
            put(folder / "F/dataset.toml", text)
        case(f"dataset.toml without {name}", "evaluate", "F/dataset.toml", "--out", "R", "--models", "ridge-te", "--workers", "1",
             "--quiet", want=EITHER, make=make)
    for name, text in without(RECIPE_TEXT):
        case(f"recipe without {name}", "train", "Z", "o", "--model", "sa-se", "--recipe", "r.toml", "--preset", "quick", "--quiet",
             make=given(Z=BASE / "Z", r_dot_toml=text), want=EITHER)
    for key in ("title", "data", "[options]", "split"):
        rows = ['title = "Mine"', 'data = "F/dataset.toml"', "[options]", 'split = "speed"']
        text = "\n".join(row for row in rows if not row.startswith(key)) + "\n"
        make = given(F=BASE / "F", **{"F/dataset_dot_toml": DATA_SET_TEXT}, t_dot_toml=text)
        case(f"task without {key}", "benchmark", "run", "t.toml", "--models", "chance", "--out", "o", "--quiet", make=make,
             want=EITHER)


# Names in other forms: one texture must not be two.


def names():
    composed, decomposed = "J\u00fcte", "Ju\u0308te"

    def textures(one, other, described=True):
        """Call a texture `one` at some speeds and `other` at the last."""
        def make(folder):
            for texture, speed, name in (("0", 40, one), ("0", 50, one), ("0", 60, other)):
                link(BASE / f"S/{texture}/{speed}/audio.wav", folder / f"S/{name}/{speed}.wav")
            for speed in (40, 50, 60):
                link(BASE / f"S/3/{speed}/audio.wav", folder / f"S/wool/{speed}.wav")
            if described:
                put(folder / "S/session.toml", 'pattern = "{texture}/{speed}.wav"\nsteady_s = [0.5, 3.0]\n')
        return make

    def fabrics(one, other):
        def make(folder):
            for path in sorted((BASE / "F").glob("*.csv")):
                name = path.name.replace("Linen", other if "V40" in path.name else one)
                link(path, folder / "F" / name)
            put(folder / "F/dataset.toml", DATA_SET_TEXT)
        return make

    def two(folder, done):
        """Return what is wrong if a texture counts twice, and nothing says so."""
        if done.rc or "2 textures" in done.out:
            return ""
        return f"not 2 textures: {done.out[:80]!r}"

    for kind, (one, other, want) in {
        "composed and decomposed": (composed, decomposed, ACCEPT), "a blank at the end": (composed, f"{composed} ", ACCEPT),
        "a no-break space": ("grey felt", "grey\u00a0felt", ACCEPT), "two blanks": ("grey felt", "grey  felt", ACCEPT),
        "another case": ("Felt", "felt", REFUSE),
    }.items():
        case(f"names, {kind}: inspect", "inspect", "S", "--out", "p", "--quiet", make=textures(one, other), want=want, after=two)
        case(f"names, {kind}: init", "init", "S", "--force", want=EITHER, make=textures(one, other, described=False))
        case(f"names, {kind}: extract", "extract", "S", "Z", "--workers", "1", "--quiet", make=textures(one, other), want=want)
        case(f"names, {kind}: tables", "inspect", "F/dataset.toml", "--out", "p", "--quiet", make=fabrics(one, other), want=want,
             after=two)
        case(f"names, {kind}: evaluate tables", "evaluate", "F/dataset.toml", "--out", "R", "--models", "ridge-te", "--workers", "1",
             "--quiet", make=fabrics(one, other), want=want)


# Tables with columns that merely count.


def counting(rng):
    def columns(n, texture, speed):
        """Return columns that are no signals: row (name, values)."""
        rows, start = np.arange(n), rng.randrange(1000)
        return {
            "pandas' index": ("", rows), "index": ("index", rows), "sample number": ("sample", rows + start),
            "backwards": ("remaining", n - rows), "frame, twice each": ("frame", rows // 2),
            "counter of 8 bits": ("counter", (rows + start) % 256), "seconds": ("seconds", np.round(rows / 200, 4)),
            "milliseconds": ("ms", 5 * rows), "unix time": ("stamp", 1.7e9 + rows / 200), "label": ("label", np.full(n, texture)),
            "label in words": ("class", np.full(n, f"fabric{texture}")), "speed": ("speed", np.full(n, speed)),
            "nothing": ("empty", np.full(n, "")),
        }

    def tables(folder, kinds, declared=None):
        noise = np.random.default_rng(rng.randrange(1 << 30))
        for texture, name in enumerate(("Linen", "Wool")):
            for speed in (20, 30, 40):
                n = 1200
                wave = np.sin(2 * np.pi * (0.4 + 0.2 * texture) * speed * np.arange(n) / 200)[:, None]
                taxels = np.round(50 * wave + noise.normal(0, 3, (n, 3)), 2)
                added = [columns(n, texture, speed)[kind] for kind in kinds]
                header = ",".join([*(head for head, _ in added), "taxel0", "taxel1", "taxel2", "dead"])
                cells = [[str(v) for v in values] for _, values in added]
                body = (
                    ",".join([*row, *map(str, taxels[n]), "7"]) for n, row in enumerate(zip(*cells, strict=True))
                )
                put(folder / f"D/{name}_{speed}_1.csv", "\n".join([header, *body]) + "\n")
        if declared:
            put(folder / "D/dataset.toml", declared)

    def only_taxels(folder, done):
        path = folder / "D/dataset.toml"
        if done.rc or not path.exists():
            return ""
        channels = tomllib.loads(path.read_text())["signal"].get("channels")
        return "" if channels in (TAXELS, [*TAXELS, "dead"]) else f"channels are {channels}"

    def named(head):
        """Without channels, a sentence must name the column that looks like no signal."""
        def after(folder, done):
            return "" if done.rc or (head or "0") in done.out + done.err else f"{head!r} is read without a word"
        return after

    signal = '[files]\npattern = "{texture}_{speed}_{trial}.csv"\n[signal]\nsample_rate_hz = 200\nsteady_s = [1, 5]\n'
    for kind, (head, _) in columns(1, 0, 0).items():
        case(f"counting, {kind}: init", "init", "D", want=ACCEPT, make=lambda f, k=kind: tables(f, [k]), after=only_taxels)
        case(f"counting, {kind}: no channels declared", "inspect", "D/dataset.toml", "--out", "p", "--quiet", want=EITHER,
             make=lambda f, k=kind: tables(f, [k], signal), after=named(head))
    for k in range(4):
        some = rng.sample(sorted(columns(1, 0, 0)), 3)
        case(f"counting, {', '.join(some)} {k}: init", "init", "D", want=ACCEPT, make=lambda f, s=some: tables(f, s),
             after=only_taxels)


# Options.


def options():
    quick = ("simulate", "S", "--textures", "a", "--speeds", "40", "--quiet", "--workers", "1")
    for flag, values in {
        "--seconds": ("-1", "0", "nan", "inf", "1e309", "1.5", "x", ""),
        "--speeds": ("0", "-5", "nan", "inf", "1e309", "x", ",", "40,,50", "501"),
        "--textures": ("", ",", "z", "..", "../../x", "-1", "nan", "inf", "1e309", "0.1", "21", "A"),
        "--seed": ("-1", "x", "1e3"), "--workers": ("0", "-1", "x"), "--preset": ("slow",),
        "--nuisances": ("x", "tilt=", "tilt=x", "tilt=nan", "tilt=inf", "tilt=-1", "=1", ""),
        "--height-map": ("x", "x=no.npy,1,1", "x=/etc/passwd,1,1", "../x=a.npy,1,1", "x=.,1,1", "x=h.npy,0,1", "x=h.npy,nan,1"),
    }.items():
        for value in values:
            fine = (flag, value) in {("--nuisances", ""), ("--nuisances", "tilt="), ("--textures", "A")}
            empty = value == "" and flag in ("--seconds", "--speeds")
            case(f"simulate {flag} {value!r}", *quick, flag, value, out=["S"], want=EITHER if fine or empty else REFUSE,
                 make=lambda f: np.save(f / "h.npy", np.ones((8, 8))))
    for name, content in {
        "pickle": b"\x93NUMPY\x01\x00v\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,), }" + b" " * 60 + b"\n\x80\x04N.",
        "huge": b"\x93NUMPY\x01\x00v\x00" + b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }".ljust(117) + b"\n",
        "nan": None, "empty": b"",
    }.items():
        case(f"height map {name}", *quick[:2], "--textures", "a", "--speeds", "40", "--seconds", "1.6", "--quiet",
             "--height-map", "x=h.npy,5,1", out=["S"], make=(lambda f: np.save(f / "h.npy", np.full((8, 8), np.nan)))
             if content is None else given(h_dot_npy=content))
    bomb = b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + struct.pack(">II", 60_000, 60_000) + b"\x08\0\0\0\0" + b"\0\0\0\0"
    case("height map bomb", "drum", "x=h.png,5,1", "o.stl", make=given(h_dot_png=bomb), out=["o.stl"])
    for value in ("z", "", "..", "nan", "1e309", "0.2", "x=no.png,1,1", "x=/dev/zero,1,1"):
        case(f"drum {value!r}", "drum", value, "o.stl", out=["o.stl"])
    for value in ("-1", "nan", "inf", "1e309", "81", "x"):
        case(f"drum --bore {value}", "drum", "g", "o.stl", "--bore", value, out=["o.stl"])
    store = given(Z=BASE / "Z")
    evaluate = ("evaluate", "Z", "--out", "R", "--workers", "1", "--quiet")
    for model, table in {
        "ra-wave-vector": {
            "--speeds": ("0", "nan", "x", "10..", "50..40:1", "40..60:0", "40,99", "1..1e9:1"),
            "--held-out": ("0", "99", "x"), "--markers": ("0", "-1", "nan", "2", "0.5"), "--train-speeds": ("0", "-1", "99"),
            "--test-only": ("x", "x=1", "=", "direction=+x"), "--without": ("x", "x=1", "direction=+x"),
            "--textures": ("", ",", "z", "0", "0,0"), "--protocol": ("x", ""), "--preset": ("x",),
            "--seed": ("-1",), "--seeds": ("0", "-1"), "--frames": ("0", "-1", "100000", "1000000000000"),
            "--every": ("0", "-1", "100000"), "--cluster": ("x", "tcp://127.0.0.1:1", "http://127.0.0.1"), "--cut": ("published", "x"),
        },
        "vib-te": {
            "--window-s": ("0", "-1", "nan", "inf", "1e309", "1e9", "1e-9"), "--stride-s": ("0", "-1", "nan", "inf", "1e-9"),
            "--fft-points": ("0", "-1", "1", "1000000000000"), "--bins": ("0", "-1", "1", "1000000000"),
            "--mask": ("x", "50", "50Hz,", "nanHz", "-50Hz", "0Hz", "1e309Hz"), "--device": ("cuda", "x"), "--precision": ("x",),
        },
        "ridge-te": {"--mask": ("0Hz", "1e-9Hz", "nanHz", "0/mm"), "--window-s": ("nan", "0", "1e-9"), "--stride-s": ("1e-9", "nan", "0")},
    }.items():
        for flag, values in table.items():
            for value in values:
                loose = (flag, value) in {
                    ("--textures", ""), ("--textures", "0,0"), ("--every", "100000"), ("--bins", "1"), ("--mask", "50Hz,"),
                    ("--mask", "50"), ("--device", "cuda"), ("--bins", "1000000000")}
                tiny = value == "1" and flag == "--fft-points"
                alone = model == "vib-te" and flag == "--mask"
                case(f"evaluate {model} {flag} {value!r}", *evaluate, "--models", model, flag, value, make=store,
                     want=EITHER if loose or tiny or alone else REFUSE)
    for value in ("", ",", "x", "ra-se,x", "fusion"):
        case(f"evaluate --models {value!r}", *evaluate, "--models", value, make=store, out=["R"])
    for flag, values in {"--model": ("", "x", "all", "fusion", "ra-se,sa-se"), "--frames": ("0", "100000"),
                         "--seed": ("-1", "99999999999999999999999"), "--results": ("no", "Z")}.items():
        for value in values:
            case(f"train {flag} {value!r}", "train", "Z", "M", "--quiet", flag, value, make=store, out=["M"])
    both = given(m_dot_onnx=BASE / "m.onnx", n_dot_onnx=BASE / "n.onnx", S=BASE / "S")
    live = ("live", "--model", "m.onnx", "--json")
    replay = ("--video", "replay:S/3/50")
    for name, args in {
        "no source": live, "no model": ("live", "--video", "replay:S/3/50"), "video x": (*live, "--video", "x"),
        "video replay:": (*live, "--video", "replay:"), "video replay:nowhere": (*live, "--video", "replay:nowhere"),
        "camera 99": (*live, "--video", "camera:99"), "camera path": (*live, "--video", "camera:/etc/passwd"),
        "camera url": (*live, "--video", "camera:http://127.0.0.1:1/x"), "rig z": (*live, "--video", "rig:z"),
        "rig ..": (*live, "--video", "rig:../../x/50"), "rig nan": (*live, "--video", "rig:g/nan"), "rig -1": (*live, "--video", "rig:g/-1"),
        "rig inf": (*live, "--video", "rig:g/inf"), "speed 0": (*live, *replay, "--speed", "0"), "speed nan": (*live, *replay, "--speed", "nan"),
        "speed -1": (*live, *replay, "--speed", "-1"), "speed x": (*live, *replay, "--speed", "x"),
        "offset nan": (*live, *replay, "--speed", "max", "--audio-offset-ms", "nan"),
        "offset inf": (*live, *replay, "--speed", "max", "--audio-offset-ms", "inf"),
        "exposure nan": (*live, "--video", "camera:0", "--exposure-ms", "nan"), "port 99999": (*live, *replay, "--web", "--port", "99999"),
        "port -1": (*live, *replay, "--web", "--port", "-1"), "host open": (*live, *replay, "--web", "--host", "0.0.0.0", "--port", "0"),
        "host ::": (*live, *replay, "--web", "--host", "::", "--port", "0"), "host name": (*live, *replay, "--web", "--host", "no.such.host.invalid", "--token", "12345678"),
        "host empty": (*live, *replay, "--web", "--host", "", "--port", "0"), "token short": (*live, *replay, "--web", "--token", "1234567"),
        "host 127.0.0.1.evil": (*live, *replay, "--web", "--host", "127.0.0.1.evil.invalid", "--port", "0"),
        "host 0": (*live, *replay, "--web", "--host", "0", "--port", "0"),
        "model twice": (*live, "--model", "m.onnx", *replay, "--speed", "max"), "model of vibration, video only": ("live", "--model", "n.onnx", *replay, "--json"),
        "mic none": ("live", "--model", "n.onnx", "--audio", "mic:nosuch", "--json"), "audio mono": ("live", "--model", "n.onnx", "--audio", "replay:mono.wav", "--json"),
        "audio cut": ("live", "--model", "n.onnx", "--audio", "replay:cut.wav", "--speed", "max", "--json"),
        "audio NaN": ("live", "--model", "n.onnx", "--audio", "replay:nan.wav", "--speed", "max", "--json"),
    }.items():
        def make(folder):
            both(folder)
            values, rate = soundfile.read(str(BASE / "A.wav"), dtype="float32", always_2d=True)
            soundfile.write(str(folder / "mono.wav"), values[:, :1], rate)
            put(folder / "cut.wav", (BASE / "A.wav").read_bytes()[:200_000])
            values[50_000::100] = np.nan
            soundfile.write(str(folder / "nan.wav"), values, rate, subtype="FLOAT")
        fine = name in ("model twice", "no model", "audio mono")
        case(f"live {name}", *args, make=make, want=EITHER if fine else REFUSE)
    for args in (("calibrate", "v.mp4", "--out", "s.toml", "--pitch-mm", "nan"), ("calibrate", "v.mp4", "--out", "s.toml", "--pitch-mm", "-1"),
                 ("calibrate", "v.mp4", "--out", "s.toml", "--pitch-mm", "inf"), ("calibrate", "v.mp4", "--out", "s.json")):
        case(f"calibrate {args[-2]} {args[-1]}", *args, make=given(v_dot_mp4=BASE / "V.mp4"), out=["s.toml"])
    case("align of nothing", "align", "nowhere")
    case("align of a folder without audio", "align", "d", make=given(**{"d/video_dot_mp4": BASE / "V.mp4"}))
    case("align NaN audio", "align", "d", make=lambda f: (link(BASE / "V.mp4", f / "d/video.mp4"), soundfile.write(
        str(f / "d/audio.wav"), np.full((150_000, 2), np.nan), 44100, subtype="FLOAT")))
    case("no command", want=frozenset({0, 2}))
    case("unknown command", "feel")
    case("unknown option", "inspect", "x", "--nope")
    case("debug alone", "--debug", want=frozenset({0, 2}))
    for command in ("inspect", "calibrate", "track", "simulate", "drum", "extract", "evaluate", "report", "status", "train",
                    "explain", "export", "align", "live", "reproduce", "doctor"):
        case(f"{command} --help", command, "--help", want=ACCEPT)


# Surroundings.


def surroundings():
    look = ("inspect", "S", "--out", "p")
    evaluate = ("evaluate", "Z", "--out", "R", "--models", "ra-wave-vector", "--workers", "1")
    both = lambda f: (link(BASE / "S", f / "S"), link(BASE / "Z", f / "Z"), link(BASE / "R", f / "R0"), link(BASE / "V.mp4", f / "v.mp4"))  # noqa: E731
    ascii_only = {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    for name, env in {
        "LANG=C": {"LANG": "C", "LC_ALL": "C"}, "ascii": ascii_only, "stdout ascii": {"PYTHONIOENCODING": "ascii"},
        "latin1": {"PYTHONIOENCODING": "latin-1"}, "no HOME": {"HOME": None, "XDG_CACHE_HOME": None}, "HOME gone": {"HOME": "/nonexistent"},
        "TZ odd": {"TZ": ":/nonexistent"}, "TZ empty": {"TZ": ""}, "optimised": {"PYTHONOPTIMIZE": "2"}, "COLUMNS=1": {"COLUMNS": "1"},
        "COLUMNS=0": {"COLUMNS": "0"}, "TERM=dumb": {"TERM": "dumb"}, "no PATH": {"PATH": ""}, "warnings are errors": {"PYTHONWARNINGS": "default"},
        "TMPDIR gone": {"TMPDIR": "/nonexistent"}, "OMP 0": {"OMP_NUM_THREADS": "0"}, "MPLBACKEND odd": {"MPLBACKEND": "qtagg"},
    }.items():
        case(f"env {name}: inspect", *look, make=both, env=env, want=ACCEPT)
        case(f"env {name}: evaluate", *evaluate, make=both, env=env, want=ACCEPT)
        case(f"env {name}: report", "report", "R0", make=both, env=env, want=ACCEPT)
    case("env ascii: doctor", "doctor", env=ascii_only, want=frozenset({0, 2}))
    case("env ascii: status", "status", "R0", make=both, env=ascii_only, want=ACCEPT)
    case("env ascii: train", "train", "Z", "M", "--model", "ra-wave-vector", make=both, env=ascii_only, want=ACCEPT)
    case("env ascii: inspect video", "inspect", "v.mp4", "--out", "p", make=both, env=ascii_only, want=ACCEPT)
    case("env optimised: help", "extract", "--help", env={"PYTHONOPTIMIZE": "2"}, want=ACCEPT)
    case("env workers, TMPDIR gone", "extract", "S", "O", "--workers", "2", "--quiet", make=both, env={"TMPDIR": "/nonexistent"}, want=EITHER)
    for name, how in {"stdin closed": {"stdin": "closed"}, "stdout closed": {"stdout": "closed"}, "stderr closed": {"stderr": "closed"},
                      "stdout full": {"stdout": "full"}, "pipe broken": {"stdout": "broken"}}.items():
        fine = EITHER | {1} if name == "pipe broken" else EITHER
        case(f"{name}: inspect", *look, make=both, how=how, want=fine)
        case(f"{name}: evaluate", *evaluate, make=both, how=how, want=fine)
    case("few descriptors", *evaluate, make=both, how={"nofile": 40}, want=EITHER)
    # disk full: files may not grow beyond a size, and a small file system where that can be had
    for name, args in {
        "simulate": ("simulate", "o", "--textures", "a,g", "--speeds", "40,50", "--seconds", "3", "--workers", "1", "--quiet"),
        "extract": ("extract", "S", "o", "--workers", "1", "--quiet"), "track": ("track", "v.mp4", "o", "--sensor", "tip_b", "--quiet"),
        "evaluate": ("evaluate", "Z", "--out", "o", "--models", "ra-wave-vector,vib-te", "--workers", "1", "--quiet"),
        "train": ("train", "Z", "o", "--model", "ra-wave-vector", "--quiet"), "export": ("export", "M", "o"),
        "report": ("report", "R", "--quiet"), "inspect": ("inspect", "v.mp4", "--out", "o", "--quiet"),
        "inspect wav": ("inspect", "a.wav", "--out", "o", "--quiet"), "overlay": ("inspect", "v.mp4", "--out", "p", "--overlay", "o.mp4", "--quiet"),
        "explain": ("explain", "M", "Z", "--out", "o", "--quiet"), "calibrate": ("calibrate", "v.mp4", "--out", "o.toml"), "drum": ("drum", "g", "o"),
    }.items():
        def make(folder):
            for which in ("S", "Z", "R", "M"):
                link(BASE / which, folder / which)
            link(BASE / "V.mp4", folder / "v.mp4"), link(BASE / "A.wav", folder / "a.wav")
        small = {"simulate": 300_000, "extract": 200_000, "track": 100_000}.get(name, 3000)
        gone = [] if name in ("simulate", "extract", "evaluate", "report", "inspect", "explain") else ["o", "o.mp4", "o.toml"]
        case(f"files limited to {small}: {name}", *args, make=make, how={"fsize": small}, want=EITHER if name == "calibrate" else REFUSE, out=gone)
        inside = [a if a not in ("o", "o.mp4", "o.toml", "R") else f"small/{a}" for a in args]
        room = {"simulate": 700, "extract": 400, "track": 100, "evaluate": 40, "drum": 500, "train": 6}.get(name, 12)
        if name == "report":
            room = 900
        if name != "calibrate":
            case(f"disk full: {name}", *inside, how={"tmpfs": room, "into": "R" if name == "report" else ""}, make=make, want=REFUSE,
                 out=[f"small/{g}" for g in gone])
    for name, args in {
        "simulate": ("simulate", "o", "--textures", "a,g", "--speeds", "40,50,60", "--seconds", "6"),
        "extract": ("extract", "S", "o"), "evaluate": ("evaluate", "Z", "--out", "o", "--models", "ra-se,vib-te"),
        "report": ("report", "R"), "track": ("track", "L/3/40/video.mp4", "o", "--sensor", "tip_b"),
        "train": ("train", "Z", "o", "--model", "ra-se"), "inspect": ("inspect", "L/3/40/video.mp4", "--out", "o"),
        "live": ("live", "--model", "m.onnx", "--video", "rig", "--json"), "live web": ("live", "--model", "m.onnx", "--video", "rig", "--web", "--port", "0"),
    }.items():
        def make(folder):
            for which in ("S", "Z", "R", "L", "M"):
                link(BASE / which, folder / which)
            link(BASE / "m.onnx", folder / "m.onnx")
        for which in ("INT", "TERM", "HUP"):
            for wait in ((0.4, 3.0) if which == "INT" else (3.0,)):
                number = getattr(signal, f"SIG{which}")
                fine = frozenset({130, 0, -2}) if which == "INT" else frozenset({-number, 128 + number, 0, 130})
                case(f"SIG{which} after {wait} s: {name}", *args, make=make, want=fine, how={"signal": (number, wait), "partials": which != "INT"})


# fmt: on
# Running.


def digest(path):
    if path.is_dir():
        return sorted((str(p.relative_to(path)), digest(p)) for p in path.rglob("*") if p.is_file())
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def tree_bytes(pid):
    """Resident memory of a process and what it started."""
    total, todo = 0, [pid]
    while todo:
        one = todo.pop()
        try:
            total += int(Path(f"/proc/{one}/statm").read_text().split()[1]) * resource.getpagesize()
            todo += map(int, Path(f"/proc/{one}/task/{one}/children").read_text().split())
        except (OSError, ValueError, IndexError):
            pass
    return total


def prepared(how):
    def before():
        os.setsid()
        if "fsize" in how:
            resource.setrlimit(resource.RLIMIT_FSIZE, (how["fsize"], how["fsize"]))
        if "nofile" in how:
            resource.setrlimit(resource.RLIMIT_NOFILE, (how["nofile"], how["nofile"]))
        if "memory" in how:
            resource.setrlimit(resource.RLIMIT_AS, (how["memory"], how["memory"]))
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            if how.get(name) == "closed":
                os.close(number)

    return before


def attempt(number, one):
    folder = WORK / f"{number:04d}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    mounted = None
    if "tmpfs" in one.how:
        mounted = folder / "small"
        mounted.mkdir()
        made = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={one.how['tmpfs']}k", "tmpfs", str(mounted)],
            capture_output=True,
        )
        if made.returncode:
            return None, "no small file system can be had"
    try:
        if one.make:
            one.make(folder)
        if one.how.get("into"):
            filled = subprocess.run(
                ["cp", "-r", str(BASE / one.how["into"]), str(mounted)], capture_output=True
            )
            if filled.returncode:
                pass  # as full as can be
            free = os.statvfs(mounted)
            rest = free.f_bavail * free.f_frsize - 20_000
            if rest > 0:
                (mounted / "filler").write_bytes(bytes(rest))
        before = {name: digest(folder / name) for name in one.keep}
        env = {**os.environ, "HOME": str(ROOT), **one.env}
        env = {k: v for k, v in env.items() if v is not None}
        done = process(folder, one, env)
        wrong = judged(folder, one, done, before)
    finally:
        if mounted is not None:
            subprocess.run(["umount", "-l", str(mounted)], capture_output=True)
    if not wrong and not ARGS.keep:
        subprocess.run(["chmod", "-R", "u+rwX", str(folder)], capture_output=True)
        shutil.rmtree(folder, ignore_errors=True)
    return done, wrong


@dataclass
class Done:
    rc: int
    err: str
    out: str
    seconds: float
    peak: int
    hung: bool
    orphans: bool = False


def left_alive(group):
    """Tell whether processes outlive their caller by more than a few seconds; end them."""
    until = time.monotonic() + 6
    try:
        while time.monotonic() < until:
            os.killpg(group, 0)
            time.sleep(0.1)
        os.killpg(group, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def process(folder, one, env):
    outs = {"stdout": subprocess.PIPE}
    if one.how.get("stdout") == "full":
        outs["stdout"] = open("/dev/full", "w")
    if one.how.get("stdout") == "broken":
        read, write = os.pipe()
        os.close(read)
        outs["stdout"] = write
    error = open(folder / ".stderr", "w+b")
    start = time.monotonic()
    powers = WITHOUT_POWERS if one.how.get("mortal") and os.getuid() == 0 else []
    child = subprocess.Popen(
        [*powers, EXE, *map(str, one.args)],
        cwd=folder,
        env=env,
        stdin=subprocess.DEVNULL,
        stderr=error,
        preexec_fn=prepared(one.how),
        **outs,
    )
    printed = []
    reader = None
    if child.stdout:
        reader = threading.Thread(target=lambda: printed.append(child.stdout.read()), daemon=True)
        reader.start()
    elif isinstance(outs["stdout"], int):
        os.close(outs["stdout"])
    peak, hung, sent = 0, False, None
    while child.poll() is None:
        peak = max(peak, tree_bytes(child.pid))
        passed = time.monotonic() - start
        if "signal" in one.how and sent is None and passed > one.how["signal"][1]:
            number = one.how["signal"][0]
            sent = passed
            (os.killpg if number == signal.SIGINT else os.kill)(child.pid, number)
        if passed > LIMIT_S:
            hung = True
            os.killpg(child.pid, signal.SIGKILL)
            break
        time.sleep(0.05)
    rc = child.wait()
    seconds = time.monotonic() - start
    orphans = left_alive(child.pid) and not hung
    if reader:
        reader.join(5)
    error.seek(0)
    text = error.read().decode("utf-8", "replace")
    error.close()
    out = printed[0].decode("utf-8", "replace") if printed else ""
    return Done(rc, text, out, seconds, peak, hung, orphans)


def judged(folder, one, done, before):
    wrong = []
    if done.hung:
        wrong.append(f"hung for {LIMIT_S} s")
    elif done.rc not in one.want:
        taken = "taken without a word" if done.rc == 0 else f"exit code {done.rc}"
        wrong.append(f"{taken}, not {'/'.join(map(str, sorted(one.want)))}")
    if "Traceback (most recent call last)" in done.err + done.out:
        last = [
            x
            for x in (done.err + done.out).strip().splitlines()
            if re.match(r"\w[\w.]*(Error|Exception|Interrupt)\b", x)
        ]
        wrong.append(f"traceback ({(last or ['?'])[-1][:110]})")
    lines = [x for x in re.split(r"[\r\n]+", done.err) if x.strip()]
    if len(lines) > LIMIT_LINES and "signal" not in one.how:
        wrong.append(f"{len(lines)} lines of stderr")
    if (
        done.rc == 2
        and "afferents:" not in done.err
        and "Usage:" not in done.err
        and "Problem:" not in done.out
        and one.how.get("stderr") != "closed"
        and one.args[:1] != ["doctor"]
        and one.args
    ):
        wrong.append("refused without a sentence")
    if re.search(r"Unknown (option|command)", done.err) and "unknown" not in one.name:
        wrong.append("the option or command is gone: adapt the case")
    if done.peak > LIMIT_BYTES:
        wrong.append(f"{done.peak / 2**30:.1f} GB")
    if done.rc not in (0, 3):  # 3: what came before the fault is kept
        wrong += [
            f"left {name}"
            for name in one.out
            if (folder / name).exists()
            or ((folder / name).is_symlink() and name not in ("loop", "dangling"))
        ]
    if not one.how.get("partials"):
        partials = list(folder.rglob(".partial-*"))
        wrong += [f"left {partials[0].relative_to(folder)}"] if partials else []
    wrong += [f"changed {name}" for name, was in before.items() if digest(folder / name) != was]
    if done.orphans:
        wrong.append("left processes alive")
    if one.after and (found := one.after(folder, done)):
        wrong.append(found)
    if (
        re.search(
            r"KeyError|NoneType|object has no attribute|\[Errno|<class|unexpected keyword", done.err
        )
        and "Traceback" not in done.err
    ):
        wrong.append("sentence of Python's")
    return "; ".join(wrong)


def main():
    rng = random.Random(ARGS.seed)
    ROOT.mkdir(parents=True, exist_ok=True)
    if os.getuid() == 0:
        ROOT.chmod(0o755)
    fixtures()
    (
        media(rng),
        plausible(),
        paths(),
        permissions(),
        session_files(),
        sensors(rng),
        stores(rng),
        results(rng),
        models(rng),
    )
    (
        fabricslides(),
        damaged_pictures(rng),
        missing_keys(rng),
        names(),
        counting(rng),
        options(),
        surroundings(),
    )
    drawn = random.Random(ARGS.seed)
    chosen = [
        (n, c)
        for n, c in enumerate(CASES)
        if drawn.random() < ARGS.share and re.search(ARGS.only, c.name)
    ]
    if ARGS.list:
        print(*(c.name for _, c in chosen), sep="\n")
        return 0
    shutil.rmtree(WORK, ignore_errors=True)
    well, short, skipped, begun = 0, [], 0, time.monotonic()
    log = (ROOT / "log.jsonl").open("w")
    for number, one in chosen:
        done, wrong = attempt(number, one)
        if done is None:
            skipped += 1
            continue
        log.write(
            json.dumps(
                {
                    "case": one.name,
                    "number": number,
                    "args": [os.fsencode(str(a)).decode("latin1") for a in one.args],
                    "rc": done.rc,
                    "seconds": round(done.seconds, 2),
                    "peak_mb": done.peak >> 20,
                    "wrong": wrong,
                    "stderr": done.err[-1500:],
                    "stdout": done.out[-500:],
                }
            )
            + "\n"
        )
        log.flush()
        if wrong:
            short.append(one.name)
            print(
                f"{number:04d} {one.name}: {wrong}".encode("utf-8", "replace").decode(), flush=True
            )
        elif done.rc == 2:
            well += 1
    minutes = (time.monotonic() - begun) / 60
    tail = f": {', '.join(short[:8])}{' ...' if len(short) > 8 else ''}" if short else ""
    unmounted = f", {skipped} without a file system" if skipped else ""
    print(
        f"{len(chosen) - skipped} cases, {well} refused well, fell short: {len(short)} ({minutes:.0f} min{unmounted}){tail}"
    )
    return 1 if short else 0


if __name__ == "__main__":
    sys.exit(main())
