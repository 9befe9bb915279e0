"""The commands, each by its function, and the program that runs one."""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from cyclopts import App, CycloptsError, Group

from afferents import errors, progress, stopping
from afferents.cli.command import Command, describe_error
from afferents.cli.errors import end_after_fault, run_to_exit_code
from afferents.cli.signatures import read_first_line

FPS, TRACKER = {"fps_hz": "--fps"}, {"method": "--tracker"}
EVALUATION = "afferents.evaluation.options:EvaluationOptions"
EXTRACT = "afferents.extraction.extract:extract"

_GROUPS: Mapping[str, Sequence[Command]] = {
    "Recordings": (
        Command(
            "record", "afferents.cli.lab:record", words=("plan", "session"), several=("again",)
        ),
        Command(
            "import",
            "afferents.lab.recorder.importing:import_recording",
            words=("video", "audio"),
            flags={
                "speed_mm_s": "--speed",
                "audio_start_s": "--audio-start",
                "audio_rate_hz": "--audio-rate",
            },
        ),
        Command("fetch", "afferents.recordings.fetch:fetch"),
        Command(
            "simulate",
            "afferents.rig.simulate:simulate",
            several=("height_maps",),
            flags={
                "speeds_mm_s": "--speeds",
                "height_maps": "--height-map",
                "indentation_mm": "--indentation",
            },
            shown=(
                "preset",
                "textures",
                "speeds_mm_s",
                "seconds",
                "nuisances",
                "seed",
                "sensor",
                "workers",
                "quiet",
            ),
        ),
        Command("init", "afferents.inspection.init:init_session"),
        Command("inspect", "afferents.inspection.inspect:inspect", flags=FPS),
    ),
    "Afferents": (
        Command(
            "calibrate",
            "afferents.inspection.calibrate:calibrate_sensor",
            words=("videos",),
            several=("videos", "hide"),
        ),
        Command("track", "afferents.extraction.track:track_into", flags=FPS | TRACKER),
        Command("extract", EXTRACT, several=("accept",), flags=FPS | TRACKER),
        Command("align", "afferents.extraction.align:align", several=("recordings",)),
        Command(
            "live",
            "afferents.cli.lab:live",
            words=(),
            several=("model", "to", "videos", "audios", "sensors", "beside"),
            flags={"videos": "--video", "audios": "--audio", "sensors": "--sensor"},
        ),
    ),
    "Texture": (
        Command(
            "evaluate",
            "afferents.evaluation.evaluate:evaluate",
            words=("data",),
            several=("data", "without"),
            shown=(
                "out",
                "models",
                "protocol",
                "preset",
                "split",
                "held_out",
                "seeds",
                "workers",
                "quiet",
            ),
            takes=(EVALUATION,),
        ),
        Command("report", "afferents.cli.results:report", several=("results",)),
        Command("status", "afferents.cli.results:status"),
        Command(
            "reproduce",
            "afferents.reproduction.reproduce:reproduce",
            several=("accept", "without"),
            flags=FPS | TRACKER,
            shown=("session", "like", "size", "sensor", "models", "held_out", "workers", "quiet"),
            takes=(EXTRACT, EVALUATION),
        ),
        Command("discrepancies", "afferents.cli.results:discrepancies"),
        Command(
            "train",
            "afferents.evaluation.train:train",
            shown=("model", "preset", "results", "split", "seed", "force", "quiet"),
            takes=("afferents.evaluation.options:TrainingOptions",),
        ),
        Command("explain", "afferents.reporting.explain:explain", words=("model", "data")),
        Command("export", "afferents.models.export:export"),
        Command("benchmark", "afferents.cli.results:benchmark"),
        Command("benchmark run", "afferents.benchmark.run:run", words=("task",)),
        Command("benchmark table", "afferents.cli.results:benchmark_table", words=("folder",)),
        Command("benchmark seal", "afferents.benchmark.tasks:seal"),
    ),
    "Other programs and sciences": (
        Command("neural", "afferents.neuro.neural:neural", words=("store",)),
        Command("export-nwb", "afferents.neuro.nwb:export_nwb"),
        Command(
            "export-mcap",
            "afferents.robots.bags:export_mcap",
            several=("recordings",),
            flags={"recordings": "--recording"},
        ),
        Command("export-lerobot", "afferents.robots.lerobot:export_lerobot"),
        Command("view", "afferents.robots.viewer:view", words=("source", "recording")),
        Command("drum", "afferents.rig.drums:write_drum", flags={"bore_mm": "--bore"}),
    ),
    "This machine": (
        Command("devices", "afferents.cli.lab:devices"),
        Command("doctor", "afferents.cli.lab:doctor"),
    ),
}
COMMANDS = {one.name: one for group in _GROUPS.values() for one in group}
"""By name."""


def make_app(arguments: Sequence[str]) -> App:
    """Return the program as cyclopts reads it; only the command that is called is made whole."""
    called = find_name(arguments)
    app = App(
        name="afferents",
        help="Artificial SA-I, RA-I and RA-II afferents for tactile sensing of texture.",
        help_epilogue="Add --debug to any command to see the traceback of an error. 'afferents "
        "--install-completion' lets the shell complete commands and options.",
        help_format="plaintext",
        version=lambda: import_module("afferents.version").__version__,  # it looks packages up
    )
    completes = bool(arguments) and arguments[0] == "--install-completion"
    flags = [one.partition("=")[0] for one in arguments]
    for place, (title, commands) in enumerate(_GROUPS.items()):
        group = Group(title, sort_key=place)
        for order, command in enumerate(commands):
            parent, _, last = command.name.rpartition(" ")
            if completes or command.name == called:
                one = command.app(group, "--help-all" in flags, "--config" in flags)
            else:
                about = read_first_line(command.function)
                one = App(last, about, group=group, version_flags=())
            one.sort_key = order
            (app[parent] if parent else app).command(one)
    if completes:
        app.register_install_completion_command()
    return app


def find_name(arguments: Sequence[str]) -> str:
    """Return the name of the command that arguments begin with; empty if there is none."""
    names = [" ".join(arguments[:n]) for n in (2, 1)]
    return next((name for name in names if name in COMMANDS), "")


def read_given(arguments: Sequence[str]) -> dict[str, Any] | None:
    """Return what the command that is called is given, by name; None if help was printed instead.

    Raises
    ------
    InputError
        If it makes no sense.
    """
    app, name = make_app(arguments), find_name(arguments)
    if name and "--help-all" in arguments:
        app.help_print(name.split())
        return None
    try:
        call, given, _ = app.parse_args(list(arguments), print_error=False, exit_on_error=False)
    except CycloptsError as error:
        raise errors.InputError(describe_error(error, name)) from error
    found: dict[str, Any] | None = call(*given.args, **given.kwargs)
    return found


def run(arguments: Sequence[str]) -> None:
    """Run what was typed after ``afferents``.

    Raises
    ------
    InputError
        If it makes no sense.
    SystemExit
        If what was looked at is not as it should be.
    """
    if (given := read_given(arguments)) is not None:
        COMMANDS[find_name(arguments)].run(given)


def main() -> None:
    """Run the command line; exit code 2 and one sentence for what the user can mend."""
    stopping.stop_on_signals()
    progress.prepare_streams()
    debug = "--debug" in sys.argv
    if not debug:
        progress.silence_libraries()
    arguments = [text for text in sys.argv[1:] if text != "--debug"]
    code = run_to_exit_code(lambda: run(arguments), debug)
    stopping.ignore_signals_briefly()
    fault = progress.flush_streams()
    if fault and code == 0:  # the work is done, and nobody is told
        code = end_after_fault(fault, debug)
    sys.exit(code)
