"""Every command that the README and the pages print does what it says, on small recordings."""

import re
import shlex
import signal
import urllib.request

import pytest

from ...conftest import few_epochs
from ...kept import contents
from .printed import ROOT, WITH_COMMANDS, flags_of, printed_on, understood
from .things import MAKERS, Things

PLACES = {}
"""Of each command: the pages and lines that print it."""
for page in WITH_COMMANDS:
    for one in printed_on(page):
        PLACES.setdefault(one.text, []).append(f"{page.name}:{one.line}")

VIEWER = "needs the extra view, which dev leaves out: test_all_of_a_session_and_its_store"
GITHUB = "fetches from a server; from one of ours: test_a_repository_of_github"
NTP = "needs the set; on files of its form: " + (
    "test_printed_textures_under_nine_taxels_are_learnt_from"
)
BENCHMARK = "needs data and entries; on a task of its own: tests/unit/benchmark"
SWEPT = "needs slides whose speed changes: test_a_sweep_goes_all_the_way"
NOT_RUN = {
    "afferents fetch ntp NTP": GITHUB,
    "afferents inspect ntp:NTP": NTP,
    "afferents evaluate ntp:NTP --out RESULTS --models order-te,order-te-speed-known": NTP,
    "afferents align TOUCH1 TOUCH2 TOUCH3": (
        "needs touches, filmed and recorded at once: test_a_known_offset_is_found"
    ),
    "afferents live --model demo --video rig --audio rig --web": (
        "simulates and trains for some minutes before it classifies; what it then does is printed "
        "too, with models from files"
    ),
    "afferents evaluate S.zarr --out ANGLE --split angle --models sa-wave-vector,vib-te "
    "--preset fast --protocol both --window-s 0.15 --stride-s 0.05 --fft-points 44100": (
        "needs recordings in which each drum turns once: test_results_name_the_split_and_its_arcs"
    ),
    "afferents extract arms/swept SWEPT.zarr": SWEPT,
    "afferents evaluate SWEPT.zarr --out BANDS --split speed --bands 35,65 "
    "--models sa-wave-vector": SWEPT,
    "afferents report BANDS": SWEPT,
    "afferents evaluate RUNS.zarr --out BANDS --split speed --bands 35,65 "
    "--models sa-wave-vector": SWEPT,
    "afferents evaluate RUNS.zarr --out FORCES --split force --bands 3 "
    "--models sa-wave-vector": SWEPT,
    "afferents benchmark run rig/speed --models chance,sa-wave-vector": (
        "simulates for a minute; on a smaller rig: test_the_rigs_task_makes_its_own_data"
    ),
    "afferents benchmark run fabricslide/speed --models vib-te-aug,my_model.py:logistic": BENCHMARK,
    "afferents benchmark table": BENCHMARK,
    "afferents view SESSION 4/60 --store STORE": VIEWER,
    "afferents view STORE --save touch.rrd": VIEWER,
}
"""Why a command is not run here, and which test runs it or the like."""

NAMES = {
    "session": "SESSION S S31 S51 DATA",
    "hexagonal session": "HEXAGONAL",
    "store": "OUT.zarr S.zarr S31.zarr S51.zarr STORE responses.zarr",
    "clip": "CLIP CLIP.avi CLIP.mp4 VIDEO",
    "another clip": "CLIP2",
    "sound": "AUDIO",
    "times": "CSV",
    "clips": "FOLDER",
    "drafted clips": "CLIPS",
    "sensor.toml": "mine.toml left.toml right.toml",
    "results": "RESULTS results all five-speeds half-the-pins coarse",
    "model": "MODEL",
    "model.onnx": "model.onnx touch.onnx",
    "vibration model.onnx": "vib.onnx",
    "bag": "BAG",
    "percepts": "felt.jsonl",
    "plan": "PLAN.toml",
    "fabrics": "PATH",
    "taxels": "taxels",
    "arms": "arms",
    "trials": "TRIALS.zarr",
    "own models": "my_models.py",
    "heights": "corduroy.png",
}
"""What stands for the names that commands read."""
KINDS = {name: kind for kind, names in NAMES.items() for name in names.split()}
SIZES = {"extract": "short", **dict.fromkeys(("evaluate", "explain", "train"), "large")}
"""Of sessions and stores, where a command needs more recordings than others, or one will do."""
WRITES = {"simulate": "session", "record": "session", "import": "session", "live": "learn"}
"""What a command writes that is not called `out`, `save`, `overlay` or `to`."""
NO_FILES = {"HOST", "F120", "F250"}
NAME = re.compile(r"(?<![\w./-])(?:[A-Z][A-Z0-9]*(?:\.\w+)?|[\w-]+\.[a-z]\w+)(?![\w.-])")
"""Words of a command that are, by their form, names of files or folders."""

SHORTER = (
    (r"init CLIPS", "init FOLDER"),
    (r"(inspect|extract) FOLDER", r"\1 SESSION"),  # as init has described it
    (r"CLIP CLIP", "CLIP CLIP2"),
    (r"--preset (paper|fast)", "--preset quick"),
    (r"--models all", "--models sa-se,vib-te"),
    (r"--seconds [\d.]+", "--seconds 1.6"),
    (r"--textures a,2.2,g --speeds 10,50,100", "--textures 2.2 --speeds 50"),
    (r"--textures g (--height-map cord)", r"--textures cord --speeds 50 \1"),
    (r"--speeds 10\.\.100:30", "--speeds 20..40:20,50"),
    (r"--markers 0.5", r"--markers 0.5 --models sa-se"),
    (r"--train-speeds 5", "--train-speeds 2"),
    (r"--seeds 3", "--seeds 2"),
    (r"S.zarr (--out TRIALS)", r"TRIALS.zarr \1 --models ridge-te"),
    (r"--out PRESSURES", r"--out PRESSURES --models ridge-te"),
    (r"SESSION (S.zarr --sensor hex127)", r"HEXAGONAL \1"),
    (r"--like published", "--like published --cut all --preset quick"),
)
"""What would take long, or more recordings than there are, and what is run instead."""
DEVICES = (
    (r"live (--audio-offset-ms)", r"live --video replay:SESSION/3/50 --audio mic:default \1"),
    (r"camera:0", "replay:SESSION/3/50"),
    (r"mic:default", "replay:SESSION/3/50"),
    (r"record PLAN.toml (SESSION|--check)( --web)?$", r"record PLAN.toml \1\2 --dry-run"),
)
"""What stands for a camera, a microphone and a drum."""
ADDED = {
    "simulate": "--textures g --speeds 50 --seconds 1.6",
    "evaluate": "--models sa-wave-vector --held-out 40",
    "reproduce": "--models sa-wave-vector --held-out 40",
    "neural": "--window-s 0.25",
    "live": "--speed max --port 0",
    "record": "--port 0",
}
"""Options that a command is given where it has none of that name."""
EVERYWHERE = "--workers 1"
ENDLESS = "--web"
"""A page is served until somebody stops it."""


def run_instead(text):
    """Return the words of a command that is as the printed one, and short."""
    for long, short in (*SHORTER, *DEVICES):
        text = re.sub(long, short, text)
    words = shlex.split(text)
    known = flags_of(text)
    added = shlex.split(f"{ADDED.get(words[1], '')} {EVERYWHERE}")
    for option, value in zip(added[::2], added[1::2], strict=True):
        if option in known and option not in words and not excluded(words, option):
            words += [option, value]
    return [*words, "--quiet"] if "--quiet" in known and "--quiet" not in words else words


def excluded(words, option):
    """Tell whether a command has no speeds: it holds out something else, or sweeps over them."""
    if option == "--speeds":
        return "--sweep" in words
    return option == "--held-out" and "--split" in words and "speed" not in words


def reads(words):
    """Return the names among the words that stand for something, but for what is written."""
    found = {name for word in words[2:] for name in re.findall(r"[\w.-]+", word)}
    return (found & set(KINDS)) - written(words)


def written(words):
    """Return the files and folders that a command is to write."""
    params = {"out", "save", "overlay", "to", WRITES.get(words[1])}
    params |= {"plan"} if "--example" in words else set()
    values = understood(shlex.join(words))
    found = [values[name] for name in params & set(values)]
    every = [one for value in found for one in (value if isinstance(value, list) else [value])]
    return {str(one).removeprefix("mcap:") for one in every}


def kind_of(name, command):
    kind = KINDS[name]
    sized = kind in ("session", "store") and command in SIZES
    return f"{SIZES[command]} {kind}" if sized else kind


@pytest.fixture(scope="module")
def things(tmp_path_factory):
    made = Things(tmp_path_factory.mktemp("things"))
    yield made
    left = {path: contents(path) for path in made.begun}
    assert left == made.begun, "a command changed its input"


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [pytest.param(t, id=",".join(p)) for t, p in PLACES.items() if t not in NOT_RUN]
)
def test_a_printed_command_is_run(text, things, own_models, run, launch, request, tmp_path):
    words = run_instead(text)
    for name in sorted(reads(words)):
        things.lay(kind_of(name, words[1]), tmp_path / name)
    if "--cluster" in words:
        scheduler = request.getfixturevalue("cluster").scheduler_address
        words = [scheduler if word == "tcp://HOST:8786" else word for word in words]
    if ENDLESS in words:
        code, said = stopped_by_hand(launch, words, tmp_path)
        assert code == 128 + signal.SIGINT, said
    else:
        with few_epochs():
            code, _, said = run(*words[1:])
        assert code == 0, f"{shlex.join(words)}\n{said}"
    assert "Traceback" not in said


@pytest.fixture
def own_models(tmp_path, monkeypatch):
    """The folder of a command, with the file that must be there when options are read."""
    monkeypatch.chdir(tmp_path)
    MAKERS["own models"](None, tmp_path / "my_models.py")


def stopped_by_hand(launch, words, folder):
    """Stop a command when its page has been seen; return its exit code and what it said."""
    from ..lab.live.conftest import LIVE  # imports all that trains, for the slow test alone

    running = launch(words[1:], imports=LIVE, cwd=str(folder))
    said = []
    for line in iter(running.stderr.readline, ""):
        said.append(line)
        if line.startswith("Page: "):
            address = line.removeprefix("Page: ").strip()
            assert b"<title>" in urllib.request.urlopen(address, timeout=60).read()
            running.send_signal(signal.SIGINT)
            break
    _, rest = running.communicate(timeout=60)
    return running.returncode, "".join(said) + rest


def test_what_is_not_run_is_printed_and_has_a_test():
    assert sorted(set(NOT_RUN) - set(PLACES)) == [], "printed no more: take them out of NOT_RUN"
    named = {name for why in NOT_RUN.values() for name in re.findall(r"test_\w+", why)}
    there = "".join(path.read_text() for path in (ROOT / "tests").rglob("*.py"))
    assert named
    assert [name for name in named if f"def {name}(" not in there] == []


@pytest.mark.parametrize("text", [pytest.param(t, id=",".join(p)) for t, p in PLACES.items()])
def test_every_command_is_understood_and_something_stands_for_every_name(text, own_models):
    """Each is read as a shell would hand it over: command, options, and their values."""
    understood(text)
    if text in NOT_RUN:
        return
    words = run_instead(text)
    names = {name for word in words[2:] for name in NAME.findall(word)}
    unknown = names - NO_FILES - set(KINDS) - written(words)
    assert unknown == set(), "add them to NAMES, or the command to NOT_RUN"
