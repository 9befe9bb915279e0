"""Commands that record, and list what can be recorded with."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from afferents.cli.errors import fail_if_skipped
from afferents.cli.printing import say
from afferents.cli.shared import Host, Json, Port, Quiet, Token
from afferents.errors import InputError


def devices(as_json: Json = False) -> None:
    """List cameras with their formats and rates, microphones, serial ports and drives."""
    from afferents.devices.found import find_devices

    found = find_devices()
    table = Table(show_header=False, box=None)
    for camera in found.cameras:
        table.add_row("camera", camera.device, camera.name)
        for mode in camera.modes:
            rates = ", ".join(f"{rate:g}" for rate in mode.fps_hz)
            table.add_row("", "", f"{mode.format} {mode.width} x {mode.height} at {rates}")
    for one in found.microphones:
        what = f"{one.name}: {one.channels} channel(s), {one.rate_hz:g} Hz"
        table.add_row("microphone", one.device, what)
    for port in found.ports:
        table.add_row("serial port", port.port, port.name)
    for drive in found.drives:
        table.add_row("kind of drive", drive, "")
    absent = [
        f"No {name}."
        for name, there in (
            ("camera", found.cameras),
            ("microphone", found.microphones),
            ("serial port", found.ports),
        )
        if not there and not any(note.startswith(name) for note in found.notes)
    ]
    say(as_json, asdict(found), table, *absent, *found.notes)


# Commands that record.


def record(
    plan: Annotated[
        Path, typer.Argument(help="Plan (TOML): what is recorded, and with what.")
    ] = Path("PLAN.toml"),
    session: Annotated[
        Path | None, typer.Argument(help="Session folder to write; runs in it are kept.")
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Record the simulated rig instead, four times as fast as in truth."
        ),
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Check devices, light, sound, disk and drive alone.")
    ] = False,
    example: Annotated[
        bool, typer.Option("--example", help="Write a plan to begin with, and record nothing.")
    ] = False,
    again: Annotated[
        list[str] | None,
        typer.Option(
            help="Record this run, such as 4/60, although the session holds it; the earlier one is "
            "kept aside. May be repeated."
        ),
    ] = None,
    web: Annotated[
        bool,
        typer.Option(
            "--web", help="Serve a page with camera, markers, sound, progress, and what to do next."
        ),
    ] = False,
    host: Host = "127.0.0.1",
    port: Port = 8800,
    token: Token = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Record a session: camera, microphone and drum on one clock.

    Each run is checked; one that lost frames or missed its speed is kept aside and recorded again.
    Stopped or broken off, the same command goes on where it was.
    """
    import afferents

    if example:
        from afferents.recorder.plan import write_example

        write_example(plan)
        return say(
            as_json,
            {"plan": str(plan)},
            f"Plan: {plan}",
            f"Change it. 'afferents record {plan} REHEARSAL --dry-run' tries it without devices.",
        )
    if check:
        return _check(plan, session, dry_run, as_json)
    if session is None:
        raise InputError(
            "SESSION: expected a folder to write, found none; name one, or give --check"
        )
    page = (host, port, token) if web else None
    done = afferents.record(
        plan, session, dry_run, quiet=quiet or as_json, web=page, again=again or ()
    )
    say(
        as_json,
        {
            **asdict(done),
            "session": str(session),
            "preflight": [line.as_json() for line in done.preflight],
        },
        *(f"Aside: {place} ({why})" for place, why in done.attempts_aside),
        f"Recorded {len(done.recorded)} runs now; {len(done.remaining)} of the plan are missing.",
        f"Session{' (simulated)' if dry_run else ''}: {session}",
    )
    return fail_if_skipped(done.kept_aside)


def _check(plan: Path, session: Path | None, dry_run: bool, as_json: bool) -> None:
    """Make the preflight alone; exit code 2 if it says no."""
    from afferents.recorder.record import ask_in_terminal, make_recorder

    found = make_recorder(plan, dry_run, ask_in_terminal).check(session or Path())
    say(as_json, [line.as_json() for line in found], *(line.describe() for line in found))
    if not all(line.passes for line in found):
        raise typer.Exit(2)


def import_(
    video: Annotated[
        Path,
        typer.Argument(
            help="Video, whose frames are not encoded again; or a bag of ROS (rosbag2, .mcap, "
            ".bag; extra mcap), which holds times and sound too."
        ),
    ],
    audio: Annotated[Path | None, typer.Argument(help="Sound that belongs to it.")] = None,
    *,
    times: Annotated[
        Path | None,
        typer.Option(
            help="CSV with a row a frame: time_s, and sequence if frames are numbered. Not of a "
            "bag."
        ),
    ] = None,
    session: Annotated[Path, typer.Option(help="Session folder to write, or to add to.")],
    texture: Annotated[str, typer.Option(help="Texture that was recorded.")],
    speed: Annotated[float, typer.Option(help="Its sliding speed, mm/s.")],
    audio_start: Annotated[
        float | None,
        typer.Option(
            help="Time of the first sample on the clock of the times, s (default: with the first "
            "frame)."
        ),
    ] = None,
    keep: Annotated[
        bool, typer.Option("--keep", help="Import it although frames are missing.")
    ] = False,
    image_topic: Annotated[
        str | None, typer.Option(help="Topic of a bag's pictures (default: the only one).")
    ] = None,
    audio_topic: Annotated[
        str | None, typer.Option(help="Topic of a bag's sound (default: the only one).")
    ] = None,
    audio_rate: Annotated[
        int | None,
        typer.Option(help="Samples a second of a bag's sound, if it says none (default: 44100)."),
    ] = None,
    audio_channels: Annotated[
        int | None, typer.Option(help="Channels of a bag's sound, if it says none (default: 1).")
    ] = None,
    as_json: Json = False,
) -> None:
    """Bring a recording made elsewhere into a session, with its own time stamps."""
    import afferents

    checks = afferents.import_recording(
        video, audio, times, session, texture, speed, audio_start, keep,
        image_topic, audio_topic, audio_rate, audio_channels,
    )  # fmt: skip
    said = {"session": str(session), "checks": [line.as_json() for line in checks]}
    say(as_json, said, *(line.describe() for line in checks), f"Session: {session}")
