"""The command line: one command a stage, each a thin call of the pipeline."""

import json
import sys
import traceback
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.table import Table

from afferents.core.cut import Cut
from afferents.core.doubt import KINDS, kinds_named
from afferents.core.errors import AfferentsError, InputError, PartialFailureError, Stopped
from afferents.core.model import BEST, TABLE1, models_named
from afferents.core.progress import Progress
from afferents.core.protocol import protocols
from afferents.core.stopping import stop_on_signals, stopped_by
from afferents.core.streams import flush_streams, prepare_streams
from afferents.core.version import __version__

app = typer.Typer(
    help="Artificial SA-I, RA-I and RA-II afferents for tactile sensing of texture.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    epilog="--debug, anywhere on the line, shows the traceback of an error.",
)

Json = Annotated[
    bool, typer.Option("--json", help="Print the outcome as JSON on stdout, no progress bars.")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress bars, plain lines on stderr.")]
KeepGoing = Annotated[
    bool,
    typer.Option(
        "--keep-going", help="Skip recordings that fail, name them, and exit with code 3."
    ),
]
Force = Annotated[
    bool,
    typer.Option("--force", help="Replace what this command wrote there before (nothing else)."),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes side by side (default: one a core).")
]
ClusterName = Annotated[
    str | None,
    typer.Option("--cluster", help="Work on a Dask cluster instead, such as tcp://scheduler:8786."),
]
SensorName = Annotated[
    str, typer.Option("--sensor", help="Sensor file, or the name of a packaged one.")
]
Accept = Annotated[
    list[str] | None,
    typer.Option(
        "--accept",
        help=f"Keep and mark recordings with this wrong ({', '.join(KINDS)}); may be repeated.",
    ),
]
DeviceName = Annotated[
    Literal["auto", "cpu", "cuda"], typer.Option("--device", help="What networks train on.")
]
PrecisionName = Annotated[
    Literal["auto", "float32", "bfloat16"],
    typer.Option("--precision", help="'auto' is bfloat16 where the processor multiplies it."),
]
CutName = Annotated[
    Cut,
    typer.Option("--cut", help="Part of the recordings: 'published' or 'all' at constant speed."),
]
SEED: dict[str, Any] = {"min": 0, "max": 2**32 - 1}
TrackerName = Annotated[
    Literal["windowed", "one-to-one", "published"],
    typer.Option(
        "--tracker", help="How markers are followed; 'published' keeps the reference's flaws."
    ),
]


def main() -> None:
    """Run the command line; exit code 2 and one sentence for what the user can mend."""
    stop_on_signals()
    prepare_streams()
    debug = "--debug" in sys.argv
    code = _run([a for a in sys.argv[1:] if a != "--debug"], debug)
    fault = flush_streams()
    if fault and code == 0:  # the work is done, and nobody is told
        code = 1 if isinstance(fault, BrokenPipeError) else _ended(_no_room(fault), debug)
    sys.exit(code)


def _run(arguments: list[str], debug: bool) -> int:
    """Run a command; return its exit code."""
    try:
        app(arguments, prog_name="afferents")
    except Stopped as stop:
        traceback.clear_frames(stop.__traceback__)  # whoever waits in them tidies up
        return _ended("stopped; what is finished is kept", debug, stop.code)
    except Exception as error:  # noqa: BLE001  told or raised again below
        if (number := stopped_by()) is not None:  # what was stopped failed in its own way
            return _ended("stopped; what is finished is kept", debug, 128 + number)
        return _failed(error, debug)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def _failed(error: Exception, debug: bool) -> int:
    """Say what went wrong; return the exit code. What is no fault of the input is raised again."""
    if isinstance(error, AfferentsError | OSError):
        return _ended(_sentence(error), debug, 3 if isinstance(error, PartialFailureError) else 2)
    if isinstance(error, UnicodeEncodeError):  # several libraries take no other names of files
        return _ended(_no_letters(error), debug)
    if isinstance(error, MemoryError | RuntimeError):
        from afferents.training import is_out_of_memory

        if is_out_of_memory(error):
            do = "run it again with less data, or where there is more"
            return _ended(f"out of memory; {do}", debug)
    raise error


def _ended(sentence: str, debug: bool, code: int = 2) -> int:
    """Say in one sentence why a command ended; return its exit code."""
    with suppress(OSError):
        if debug:
            traceback.print_exc()
        print(f"afferents: {sentence}", file=sys.stderr)  # noqa: T201
    return code


def _sentence(error: BaseException) -> str:
    """Return what the error says; the system's own errors name the file first."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _no_letters(error: UnicodeEncodeError) -> str:
    if error.object is None:  # of another process
        return "a name of a file or folder: expected letters of utf-8, found others; rename it"
    found = error.object[max(0, error.start - 40) : error.end + 40]
    return f"{found}: expected letters that {error.encoding} has, found others; rename it"


def _no_room(error: OSError) -> str:
    return f"stdout: expected room for what the command says, found {error.strerror}"


def _say(as_json: bool, content: Any, *lines: Any) -> None:
    """Print the outcome: JSON for scripts, or the lines for people."""
    try:
        _print(as_json, content, lines)
        sys.stdout.flush()
    except BrokenPipeError:
        raise  # who reads has heard enough
    except OSError as error:
        raise AfferentsError(_no_room(error)) from error


def _print(as_json: bool, content: Any, lines: Iterable[Any]) -> None:
    if as_json:
        print(json.dumps(content, indent=2, default=str))  # noqa: T201
        return
    console = Console(highlight=False, markup=False)
    for line in lines:
        console.print(line, soft_wrap=isinstance(line, str))


def _version(wanted: bool) -> None:
    if wanted:
        print(__version__)  # noqa: T201
        raise typer.Exit


@app.callback()
def _afferents(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turn recordings of a soft tactile fingertip into afferents, and learn texture from them."""


@app.command()
def inspect(
    source: Annotated[
        str, typer.Argument(help="A video, a wav, a session, a store or fabricslide:PATH.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the pictures (default: NAME-inspected).")
    ] = None,
    sensor: Annotated[
        str | None, typer.Option(help="Sensor file, or the name of a packaged one (tip_b).")
    ] = None,
    overlay: Annotated[
        Path | None, typer.Option(help="Write the video with its markers drawn in, such as o.mp4.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say what is in a file or session and whether it is sound, and draw a picture."""
    from afferents import commands

    found = commands.inspect(source, out, sensor, overlay, force, quiet or as_json)
    _say(
        as_json,
        vars(found),
        *found.sentences,
        *(f"Problem: {problem}" for problem in found.problems),
        *(f"Picture: {path}" for path in found.pictures),
    )
    if found.problems:
        raise typer.Exit(2)


@app.command()
def calibrate(
    video: Annotated[Path, typer.Argument(help="A clip that begins with the skin at rest.")],
    out: Annotated[Path, typer.Option(help="Sensor file to write, with a picture beside it.")],
    pitch_mm: Annotated[
        float | None, typer.Option(help="Distance of the markers on the skin, mm, if known.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Find out how a sensor's markers look and what layout they form; write its sensor file."""
    from afferents.pipeline.calibrate import calibrate_sensor

    said, picture = calibrate_sensor(video, out, pitch_mm, force)
    found = {"sensor": str(out), "picture": str(picture), "said": said}
    _say(as_json, found, *said, f"Sensor file: {out}", f"Picture to check: {picture}")


@app.command()
def track(
    source: Annotated[Path, typer.Argument(help="A video, or a session.")],
    out: Annotated[Path, typer.Argument(help="Store to write, such as OUT.zarr.")],
    sensor: Annotated[
        str | None,
        typer.Option(help="Sensor file or name (default: a video's is recognised, else tip_b)."),
    ] = None,
    method: TrackerName = "windowed",
    workers: Workers = None,
    cluster: ClusterName = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Follow the markers of a video, or of all videos of a session: positions, SA-I, RA-I."""
    from afferents.markers import load_sensor
    from afferents.pipeline.track import track_session, track_video

    said: list[str] = []
    with Progress(quiet or as_json) as progress:
        if source.is_dir():
            given = load_sensor(sensor or "tip_b")
            track_session(source, out, given, method, workers, progress, cluster)
        elif cluster is not None:
            raise InputError("--cluster", "a session, whose videos go side by side", "one video")
        else:
            given_or_none = load_sensor(sensor) if sensor else None
            said = track_video(source, out, given_or_none, method, progress, force)
    _say(as_json, {"store": str(out), "said": said}, *said, f"Store: {out}")


@app.command()
def simulate(
    session: Annotated[Path, typer.Argument(help="Folder to write, in the published layout.")],
    preset: Annotated[
        Literal["quick", "paper"],
        typer.Option(help="5 speeds of 7.5 s, or the paper's 10 speeds of 65 s."),
    ] = "quick",
    textures: Annotated[
        str, typer.Option(help="Letters a to m, bump spacings in mm, names of height maps.")
    ] = "a,b,c,d,e,f,g,h,i,j,k,l,m",
    speeds: Annotated[
        str | None, typer.Option(help="mm/s, comma-separated (default: the preset's).")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Length of each recording, s (default: the preset's).")
    ] = None,
    height_map: Annotated[
        list[str] | None,
        typer.Option(help="NAME=FILE,LENGTH_MM,HEIGHT_MM: an image or .npy wrapped round a drum."),
    ] = None,
    nuisances: Annotated[
        str,
        typer.Option(
            help="'all', 'hard', 'none', or names with or without =PENALTY: all,tilt=0.02."
        ),
    ] = "all",
    remount: Annotated[
        Literal["run", "drum"],
        typer.Option(help="Mount anew for each run, or once a drum (which gives it away)."),
    ] = "run",
    seed: Annotated[int, typer.Option(**SEED, help="The same seed gives the same session.")] = 0,
    sensor: SensorName = "tip_b",
    workers: Workers = None,
    cluster: ClusterName = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the rig: fingertip, drums, camera and microphone, as raw mp4 and wav."""
    from afferents.pipeline.simulate import simulate_session, simulation_of

    with Progress(quiet or as_json) as progress:
        simulation = simulation_of(
            session,
            preset,
            textures.split(","),
            _numbers("--speeds", speeds),
            seconds,
            height_map or [],
            nuisances,
            remount,
            seed,
            sensor,
        )
        simulate_session(simulation, workers, progress, cluster)
    _say(as_json, {"session": str(session)}, f"Session (simulated): {session}")


@app.command()
def drum(
    texture: Annotated[
        str,
        typer.Argument(
            help="A letter a to m, a bump spacing in mm, or NAME=FILE,LENGTH_MM,HEIGHT_MM."
        ),
    ],
    out: Annotated[Path, typer.Argument(help="STL to write, such as drum.stl.")],
    bore: Annotated[float, typer.Option(help="Diameter of the spindle's hole, mm.")] = 8.0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a textured drum for a 3-D printer."""
    from afferents.rig.drums import write_drum

    path = write_drum(texture, out, bore, force)
    _say(as_json, {"stl": str(path)}, f"STL, in mm: {path}")


@app.command()
def extract(
    session: Annotated[Path, typer.Argument(help="Folder in the published layout.")],
    out: Annotated[Path, typer.Argument(help="Store to write, such as OUT.zarr.")],
    sensor: SensorName = "tip_b",
    method: TrackerName = "windowed",
    rest: Annotated[
        Literal["own", "reference"],
        typer.Option(help="Count SA-I from each recording's rest frame, or throw_away.mp4's."),
    ] = "own",
    workers: Workers = None,
    cluster: ClusterName = None,
    keep_going: KeepGoing = False,
    accept: Accept = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn videos and audio into marker tracks, SA-I, RA-I and RA-II."""
    from afferents.markers import load_sensor
    from afferents.pipeline.copies import notes_of
    from afferents.pipeline.extract import Extraction
    from afferents.pipeline.extract import extract as run

    extraction = Extraction(
        session,
        out,
        load_sensor(sensor),
        method,
        keep_going,
        workers,
        rest=rest,
        cluster=cluster,
        accept=kinds_named(accept or []),
    )
    with Progress(quiet or as_json) as progress:
        failed = run(extraction, progress)
    found = {"store": str(out), "skipped": failed, **asdict(notes_of(out))}
    _say(as_json, found, f"Store: {out}")
    _fail_if_skipped(failed)


@app.command()
def evaluate(
    data: Annotated[list[str], typer.Argument(help="Extracted stores, or fabricslide:PATH.")],
    out: Annotated[Path, typer.Option(help="Results folder; finished folds in it are kept.")],
    models: Annotated[
        str,
        typer.Option(
            help="'all' of Table 1, 'best', or a list with commas; FILE.py:NAME for one's own."
        ),
    ] = "all",
    protocol: Annotated[str, typer.Option(help="nested, published or both.")] = "nested",
    preset: Annotated[
        Literal["quick", "fast", "paper"],
        typer.Option(
            help="Training recipe: 'paper' as published, 'fast' a shorter road, 'quick' to try."
        ),
    ] = "quick",
    cut: CutName = "all",
    seed: Annotated[int, typer.Option(**SEED, help="First seed.")] = 0,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds.")] = 1,
    without: Annotated[
        list[str] | None, typer.Option(help="Leave out a condition, such as pressure=F250.")
    ] = None,
    textures: Annotated[
        str | None, typer.Option(help="Only these: folder names or the paper's letters.")
    ] = None,
    speeds: Annotated[
        str | None, typer.Option(help="Only these, mm/s: 10,50,100 or 10..100:30.")
    ] = None,
    markers: Annotated[
        float, typer.Option(help="Share of the markers that images show, evenly spread.")
    ] = 1.0,
    train_speeds: Annotated[
        int | None, typer.Option(help="Speeds that each fold trains on (default: all it has).")
    ] = None,
    test_only: Annotated[
        str | None,
        typer.Option(help="Test a condition alone, learn from the others: repetition=1."),
    ] = None,
    held_out: Annotated[
        str | None, typer.Option(help="Hold out only these speeds in turn, mm/s (default: all).")
    ] = None,
    window_s: Annotated[float | None, typer.Option(help="Vibration window, s.")] = None,
    stride_s: Annotated[float | None, typer.Option(help="Stride of the windows, s.")] = None,
    fft_points: Annotated[int | None, typer.Option(help="Points of the zero-padded FFT.")] = None,
    bins: Annotated[int | None, typer.Option(help="Frequency bins that the network sees.")] = None,
    split: Annotated[
        Literal["speed", "texture"],
        typer.Option(
            help="Hold out speeds, or textures as well: are they unknown, and how coarse?"
        ),
    ] = "speed",
    frames: Annotated[
        int | None, typer.Option(min=1, help="Frames a sample, of runs of images.")
    ] = None,
    every: Annotated[
        int | None, typer.Option(min=1, help="Waves see one frame of so many.")
    ] = None,
    mask: Annotated[
        str | None,
        typer.Option(help="Lines cut out of orders and kernels, with harmonics: 50Hz,0.0573/mm."),
    ] = None,
    workers: Workers = None,
    cluster: ClusterName = None,
    device: DeviceName = "auto",
    precision: PrecisionName = "auto",
    keep_going: KeepGoing = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Train and test all folds: hold out one speed at a time."""
    from afferents.encodings import Lines
    from afferents.evaluation.ablation import Ablation, parse_speeds
    from afferents.pipeline.copies import warn_of_copies
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import best_of
    from afferents.pipeline.evaluate import Evaluation
    from afferents.pipeline.evaluate import evaluate as run
    from afferents.pipeline.held_out_texture.evaluate import evaluate_textures
    from afferents.reporting import texture_tables, to_rich
    from afferents.training import Compute

    wanted = models_named(models) if models != "best" else []
    under, left_out = protocols(protocol), _conditions(without or [])
    names = tuple(name.strip() for name in textures.split(",")) if textures else ()
    lines = Lines.parse(mask) if mask else None
    apart = next(iter(_conditions([test_only], "--test-only").items())) if test_only else None
    ablation = Ablation(names, parse_speeds(speeds), markers, train_speeds, apart)
    further = {
        "--textures": textures,
        "--speeds": speeds,
        "--markers": markers if markers != 1 else None,
        "--train-speeds": train_speeds,
        "--test-only": test_only,
        "--held-out": held_out,
        "--window-s": window_s,
        "--stride-s": stride_s,
        "--fft-points": fft_points,
        "--bins": bins,
        "--frames": frames,
        "--every": every,
        "--mask": mask,
    }
    options = [text for name, value in further.items() if value for text in (name, _said(value))]
    options += [text for pair in without or [] for text in ("--without", pair)]
    with Progress(quiet or as_json) as progress:
        opened = open_data(data, left_out, keep_going, progress)
        warn_of_copies(recordings_in(opened), progress)
        encodings = opened[0].encodings.changed(
            window_s=window_s,
            stride_s=stride_s,
            fft_points=fft_points,
            model_bins=bins,
            frames=frames,
            every=every,
            mask=lines,
        )
        evaluation = Evaluation(
            data=opened,
            out=out,
            models=wanted or [best_of(recordings_in(opened))],
            protocols=under,
            preset=preset,
            cut=cut,
            encodings=encodings,
            seeds=list(range(seed, seed + seeds)),
            without=left_out,
            may_leave_out=models == "all",
            keep_going=keep_going,
            ablation=ablation,
            held_out=parse_speeds(held_out, "--held-out"),
            options=options,
            workers=workers,
            cluster=cluster,
            compute=Compute(device, precision),
        )
        if split == "texture":
            found = evaluate_textures(evaluation, progress)
            tables = list(map(to_rich, texture_tables(found)))
            skipped = next(iter(found.values()))["skipped"]
        else:
            found = run(evaluation, progress)
            tables, skipped = _tables(found), found["skipped"]
    _say(as_json, found, *tables, f"Results: {out}")
    _fail_if_skipped({entry["recording"]: entry["reason"] for entry in skipped})


def _tables(summary: dict[str, Any]) -> list[Any]:
    """Return Table 1 where some of its models were evaluated, and what our own came to."""
    from afferents.reporting import table1, to_rich, touches_table

    evaluated = set(summary["models"])
    tables = [table1(summary)] if evaluated & set(TABLE1) else []
    tables += [touches_table(summary)] if evaluated - set(TABLE1) else []
    return [to_rich(table) for table in tables]


@app.command()
def report(
    results: Annotated[list[Path], typer.Argument(help="Results folders.")],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write Table 1, figures and a self-contained report.html; of several runs one table too."""
    from afferents.pipeline.report import compare_runs, write_report
    from afferents.reporting import to_rich

    with Progress(quiet or as_json) as progress:
        pages = [write_report(folder, progress) for folder in results]
    table, written = compare_runs(results)
    found = {"reports": [str(page) for page in pages], "table": str(written)}
    lines = [f"Report: {page}" for page in pages]
    _say(as_json, found, to_rich(table), *lines, f"Table: {written}")


@app.command()
def status(
    results: Annotated[Path, typer.Argument(help="Results folder of an evaluate, at work or not.")],
    as_json: Json = False,
) -> None:
    """Show what an evaluation has done, what runs, what failed, and when it will end."""
    from afferents.pipeline.status import STATES
    from afferents.pipeline.status import status as look

    found = look(results)
    table = Table("model", "protocol", *STATES, box=None)
    for row in found.rows:
        table.add_row(*row)
    _say(as_json, found.facts, table, *found.sentences)


@app.command()
def train(
    data: Annotated[str, typer.Argument(help="Extracted store, or fabricslide:PATH.")],
    out: Annotated[Path, typer.Argument(help="Folder of the model to write.")],
    model: Annotated[
        str,
        typer.Option(
            "--model", help="'best', what we recommend for such data, a name, or FILE.py:NAME."
        ),
    ] = "best",
    results: Annotated[
        Path | None, typer.Option(help="Results folder whose scores the model's card carries.")
    ] = None,
    preset: Annotated[
        Literal["quick", "fast", "paper"],
        typer.Option(help="Training recipe of networks, as of evaluate."),
    ] = "fast",
    cut: CutName = "all",
    frames: Annotated[
        int | None, typer.Option(min=1, help="Frames a sample, of runs of images.")
    ] = None,
    seed: Annotated[int, typer.Option(**SEED, help="Of the training.")] = 0,
    force: Force = False,
    device: DeviceName = "auto",
    precision: PrecisionName = "auto",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Train one model to feel with, on all speeds but the one that calibrates it."""
    from afferents import commands

    card = commands.train(
        data, out, model, preset, cut, seed, results, force, device, precision, quiet or as_json,
        frames=frames,
    )  # fmt: skip
    _say(as_json, card.model_dump(mode="json"), *card.describe(), f"Model: {out}")


@app.command()
def explain(
    model: Annotated[Path, typer.Argument(help="Folder of a trained model.")],
    data: Annotated[str, typer.Argument(help="Extracted store, or fabricslide:PATH.")],
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")],
    cut: CutName = "all",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show what decides: the markers, waves, or frequencies without which a model fails."""
    from afferents import commands

    found = commands.explain(model, data, out, cut, quiet or as_json)
    pictures = [f"Picture: {path}" for path in found.pictures]
    _say(as_json, found.facts, *found.sentences, *pictures)


@app.command()
def export(
    model: Annotated[Path, typer.Argument(help="Folder of a trained model.")],
    out: Annotated[Path, typer.Argument(help="File to write, such as model.onnx.")],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a trained model as one ONNX file that carries its card."""
    from afferents.pipeline.export import export_model

    card = export_model(model, out, force)
    _say(as_json, card.model_dump(mode="json"), *card.describe(), f"ONNX: {out}")


@app.command()
def align(
    recordings: Annotated[
        list[Path], typer.Argument(help="Touches of something smooth: folders of mp4 and wav.")
    ],
    sensor: SensorName = "tip_b",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure how far the microphone's clock is ahead of the camera's."""
    from afferents.markers import load_sensor
    from afferents.pipeline.align import align as measure

    with Progress(quiet or as_json) as progress:
        found = measure(recordings, load_sensor(sensor), progress)
    _say(as_json, found._asdict(), *found.describe())


@app.command()
def live(
    model: Annotated[
        list[Path] | None,
        typer.Option(help="Exported model; several feel side by side (default: the rig's own)."),
    ] = None,
    video: Annotated[
        str | None, typer.Option(help="camera:0, replay:SESSION/3/50, rig or rig:g/50.")
    ] = None,
    audio: Annotated[
        str | None, typer.Option(help="mic:default, replay:SESSION/3/50, rig or rig:g/50.")
    ] = None,
    speed: Annotated[str, typer.Option(help="Of replays: 1 for true speed, 8, or max.")] = "1",
    exposure_ms: Annotated[
        float | None, typer.Option(help="Exposure time of the camera (default: as it is).")
    ] = None,
    audio_offset_ms: Annotated[
        float, typer.Option(help="The microphone's clock is ahead of the camera's by this.")
    ] = 0.0,
    web: Annotated[
        bool, typer.Option("--web", help="Serve a page instead of drawing here.")
    ] = False,
    host: Annotated[str, typer.Option(help="Address that the page is served at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Its port.")] = 8800,
    token: Annotated[
        str | None, typer.Option(help="Word that visitors must give; needed off this machine.")
    ] = None,
    lsl: Annotated[bool, typer.Option("--lsl", help="Give percepts out by LSL as well.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print percepts as JSON lines.")] = False,
    quiet: Quiet = False,
) -> None:
    """Feel texture as it slides: models on a running camera, microphone, replay or the rig."""
    from afferents.live import Network, Perceiver, open_sources
    from afferents.live.outlets import give_out

    with Progress(quiet or as_json) as progress:
        paths = model or _rig_models(video, audio, progress)
    perceiver = Perceiver([Network(path) for path in paths], audio_offset_ms / 1000)
    sources = open_sources(video, audio, perceiver, _speed(speed), exposure_ms)
    give_out(sources, perceiver, web=(host, port, token) if web else None, lsl=lsl, as_json=as_json)


def _rig_models(video: str | None, audio: str | None, progress: Progress) -> list[Path]:
    """Return models that go with the simulated rig, where no others are given."""
    from afferents.pipeline.reproduce import demo_models

    asked = [source for source in (video, audio) if source is not None]
    if not asked or any(not source.startswith("rig") for source in asked):
        raise InputError(
            "--model", "an exported model (only the rig's own can be had without)", "none",
            "run 'afferents train' and 'afferents export' first",
        )  # fmt: skip
    both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (video, audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]


def _speed(text: str) -> float:
    try:
        return float("inf") if text == "max" else float(text)
    except ValueError:
        raise InputError("--speed", "a factor above 0, or 'max'", f"'{text}'") from None


@app.command()
def reproduce(
    out: Annotated[Path, typer.Argument(help="Folder for session, store, results and report.")],
    session: Annotated[
        Path | None, typer.Option(help="Your own session; if none is given, one is simulated.")
    ] = None,
    sensor: SensorName = "tip_b",
    preset: Annotated[
        Literal["quick", "fast", "paper"],
        typer.Option(help="Training recipe: 'paper' takes days, 'quick' shows that it runs."),
    ] = "fast",
    size: Annotated[
        Literal["quick", "paper"],
        typer.Option(help="What is simulated: 65 recordings of seconds, or the paper's 130."),
    ] = "quick",
    protocol: Annotated[
        str, typer.Option(help="'nested', 'published' (leaky, as the paper's code), or 'both'.")
    ] = "nested",
    cut: CutName = "all",
    seed: Annotated[int, typer.Option(**SEED, help="Of simulation and training.")] = 0,
    workers: Workers = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Go the paper's whole way: simulate (unless given), extract, evaluate, report.

    Evaluates the six models of Table 1 and the one that we recommend.
    """
    from afferents.core.results import read_summary
    from afferents.markers import load_sensor
    from afferents.pipeline.reproduce import Reproduction
    from afferents.pipeline.reproduce import reproduce as run
    from afferents.reporting import headline, table1, to_rich

    under = tuple(protocols(protocol))
    wanted = Reproduction(
        out, session, load_sensor(sensor), preset, size, under, cut, seed, workers
    )
    with Progress(quiet or as_json) as progress:
        page = run(wanted, progress)
    summary = read_summary(wanted.results)
    said = ("", headline(summary), f"Report: {page.resolve()}")
    _say(as_json, summary, to_rich(table1(summary)), *said)


@app.command()
def doctor(as_json: Json = False) -> None:
    """Show versions, cores, accelerator and codecs, and what is missing."""
    from afferents.pipeline.doctor import diagnose

    rows, missing = diagnose()
    table = Table(show_header=False, box=None)
    for row in rows:
        table.add_row(*row)
    verdict = [f"Missing: {line}" for line in missing] or ["Nothing is missing."]
    _say(as_json, {"found": dict(rows), "missing": missing}, table, *verdict)
    if missing:
        raise typer.Exit(2)


def _numbers(option: str, text: str | None) -> list[float] | None:
    """Return comma-separated numbers; None for none given."""
    try:
        return [float(number) for number in text.split(",")] if text else None
    except ValueError:
        raise InputError(option, "numbers separated by commas", f"'{text}'") from None


def _said(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def _conditions(pairs: list[str], option: str = "--without") -> dict[str, str]:
    for pair in pairs:
        if "=" not in pair:
            raise InputError(option, "NAME=VALUE, such as pressure=F250", f"'{pair}'")
    return dict(pair.split("=", 1) for pair in pairs)


def _fail_if_skipped(skipped: dict[str, str]) -> None:
    if skipped:
        reasons = "; ".join(f"{name} ({why})" for name, why in skipped.items())
        raise PartialFailureError(f"skipped {len(skipped)} of the recordings: {reasons}")
