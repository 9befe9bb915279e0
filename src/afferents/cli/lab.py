"""Commands on devices and this machine: record, live, devices, doctor."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from afferents.cli.command import Output
from afferents.cli.printing import list_rows, put_apart
from afferents.errors import InputError
from afferents.models.model import BEST
from afferents.progress import Progress

DEMO = "demo"
"""Stands for the models of the simulated rig, which are trained if need be."""


def devices() -> Output:
    """List cameras with their formats and rates, microphones, serial ports and drives."""
    from afferents.lab.devices import find_devices

    found = find_devices()
    rows = []
    for camera in found.cameras:
        rows.append(("camera", camera.device, camera.name))
        rows += [("", "", f"also {camera.lasting}")] if camera.lasting else []
        for mode in camera.modes:
            rates = ", ".join(f"{rate:g}" for rate in mode.fps_hz)
            rows.append(("", "", f"{mode.format} {mode.width} x {mode.height} at {rates}"))
    for one in found.microphones:
        what = f"{one.name}: {one.channels} channel(s), {one.rate_hz:g} Hz"
        rows.append(("microphone", one.device, what))
    rows += [("serial port", port.port, port.name) for port in found.ports]
    rows += [("kind of drive", drive, "") for drive in found.drives]
    kinds = {"camera": found.cameras, "microphone": found.microphones, "serial port": found.ports}
    absent = [
        f"No {name}."
        for name, there in kinds.items()
        if not there and not any(note.startswith(name) for note in found.notes)
    ]
    return Output(asdict(found), [list_rows("Devices", ("", "", ""), rows), *absent, *found.notes])


def doctor() -> Output:
    """Check this machine: versions, cores, accelerator, codecs, and what is missing."""
    from afferents.doctor import diagnose

    groups, missing = diagnose()
    tables = [list_rows(title, ("", ""), rows.items()) for title, rows in groups.items()]
    verdict = [f"Missing: {line}" for line in missing] or [
        "Nothing is missing that every command needs. The extras are for single commands."
    ]
    content = {
        "found": {what: one for its in groups.values() for what, one in its.items()},
        "missing": missing,
    }
    return Output(content, [*put_apart(tables), *verdict], is_bad=bool(missing))


def record(
    plan: Path = Path("PLAN.toml"),
    session: Path | None = None,
    dry_run: bool = False,
    check: bool = False,
    example: bool = False,
    again: Sequence[str] = (),
    web: bool = False,
    host: str = "127.0.0.1",
    port: int = 8800,
    token: str | None = None,
    quiet: bool = False,
) -> Output:
    """Record a session: camera, microphone and drum on one clock.

    Each run is checked; one that lost frames or missed its speed is kept aside and recorded again.
    Stopped or broken off, the same command goes on where it was.

    Parameters
    ----------
    plan
        Plan (TOML): what is recorded, and with what.
    session
        Session folder to write; runs in it are kept.
    dry_run
        Record the simulated rig instead, four times as fast as in truth.
    check
        Check devices, light, sound, disk and drive alone.
    example
        Write a plan to begin with, and record nothing.
    again
        Record this run, such as 4/60, although the session holds it; the earlier one is kept aside.
        May be repeated.
    web
        Serve a page with camera, markers, sound, progress, and what to do next.
    host
        Address that the page is served at.
    port
        Port of the page.
    token
        Password for the page; required if other machines can reach it.
    quiet
        No progress bars; plain lines on stderr.
    """
    import afferents

    if example:
        from afferents.lab.recorder.plan import write_example

        write_example(plan)
        then = f"Change it. 'afferents record {plan} REHEARSAL --dry-run' tries it without devices."
        return Output({"plan": str(plan)}, [f"Plan: {plan}", then])
    if check:
        from afferents.lab.recorder.record import ask_in_terminal, make_recorder

        found = make_recorder(plan, dry_run, ask_in_terminal).check(session or Path())
        lines = [line.describe() for line in found]
        is_bad = not all(line.passes for line in found)
        return Output([line.as_json() for line in found], lines, is_bad=is_bad)
    if session is None:
        raise InputError(
            "SESSION: expected a folder to write, found none; name one, or give --check"
        )
    page = (host, port, token) if web else None
    done = afferents.record(plan, session, dry_run, quiet=quiet, web=page, again=again)
    preflight = [line.as_json() for line in done.preflight]
    lines = [
        *(f"Aside: {place} ({why})" for place, why in done.attempts_aside),
        f"Recorded {len(done.recorded)} runs now; {len(done.remaining)} of the plan are missing.",
        f"Session{' (simulated)' if dry_run else ''}: {session}",
    ]
    content = {**asdict(done), "session": str(session), "preflight": preflight}
    return Output(content, lines, done.kept_aside)


def live(
    model: Sequence[Path] = (),
    videos: Sequence[str] = (),
    audios: Sequence[str] = (),
    sensors: Sequence[str] = (),
    speed: str = "1",
    fps: float | None = None,
    exposure_ms: float | None = None,
    audio_offset_ms: float = 0.0,
    web: bool = False,
    host: str = "127.0.0.1",
    port: int = 8800,
    token: str | None = None,
    lsl: bool = False,
    signals: str | None = None,
    to: Sequence[str] = ("-",),
    as_json: bool = False,
    control: bool = False,
    learn: Path | None = None,
    name: str = "",
    beside: Sequence[str] = (),
    quiet: bool = False,
) -> None:
    """Look at what a fingertip senses, classify texture while it slides, or give out its signals.

    On a camera and a microphone, on a recording that is replayed, or on the simulated rig. Without
    a model it shows camera, markers, SA-I, RA-I, spectrum, and how good they are. Exported models
    say which texture they recognise. With --signals it gives out the numbers.

    Parameters
    ----------
    model
        ONNX file that 'export' wrote; may be repeated, to run several side by side; 'demo' for the
        simulated rig's own (default: no model, look only).
    videos
        Source of images: camera:0, a video file, replay:SESSION/3/50, rig or rig:g/50. May be
        repeated, for several fingertips, each with its own --sensor.
    audios
        Source of sound: mic:default, a sound file, replay:SESSION/3/50, rig or rig:g/50.
    sensors
        Without a model: sensor file (TOML) or name (default: markers are found at rest).
    speed
        How fast replays run: 1 as recorded, 8 times as fast, or max.
    fps
        Without a model: frame rate requested of a camera, or true rate of a recording or a folder
        of images (default: its own).
    exposure_ms
        Exposure time of the camera, ms (default: unchanged).
    audio_offset_ms
        How far the microphone's clock is ahead of the camera's, ms; 'align' measures it.
    web
        Serve a web page instead of drawing in the terminal.
    host
        Address that the page is served at.
    port
        Port of the page.
    token
        Password for the page; required if other machines can reach it.
    lsl
        Also send predictions as streams of Lab Streaming Layer.
    signals
        Give out these for each frame: some of position, sa1, ra1, speed, shear, ra2, separated by
        commas.
    to
        Where signals go: - for the terminal or a file such as touch.jsonl, as JSON lines; lsl for
        Lab Streaming Layer; mcap:FILE for an MCAP file (default: -). May be repeated.
    as_json
        Print predictions as JSON, one per line.
    control
        Set rest anew for each line 'rest' on standard input (in a terminal: key z). With --learn,
        'learn NAME' or 'learn NAME at SPEED' begins a lesson, and 'learn' ends it.
    learn
        Folder of lessons, or a new one: touches are taught on the page, or with --control, and
        recognised at once; each is kept there as a recording that 'extract' reads.
    name
        Of the fingertip, where there are several: in streams of LSL, and on the page.
    beside
        Page of another fingertip, such as right=8801, that this one's page links to.
    quiet
        No progress bars; plain lines on stderr.
    """
    from afferents import choices, plugins
    from afferents.lab.live import (
        control as controls,
        events,
        fingertip,
        outlets,
        signals as given_out,
    )
    from afferents.recordings.session_file import parse_rate

    # What does not go together.
    has_several = max(map(len, (videos, audios, sensors))) > 1
    if signals is not None and (model or web or lsl or learn):
        raise InputError(
            "--signals: expected none of --model, --web, --lsl and --learn with it, found one; run "
            "another 'afferents live' for them"
        )
    if signals is None and list(to) != ["-"]:
        raise InputError("--to: expected --signals with it, such as sa1,ra1, found none")
    if has_several and (model or lsl or learn or not (web or as_json or signals)):
        raise InputError(
            "--video: expected --signals, --web or --json with several, and none of --model, --lsl "
            "and --learn; run an 'afferents live' for each"
        )
    if model and sensors:
        raise InputError(
            f"--sensor: expected none with --model, which carries its own, found {sensors[0]}"
        )
    if model and fps is not None:
        raise InputError(f"--fps: expected none with --model, which has its own, found {fps:g}")
    if web:  # before models are trained, or others begin
        plugins.import_extra("lab", "--web", "starlette", "uvicorn", "websockets")
    factor, offset_s = choices.speed_factor(speed), audio_offset_ms / 1000
    fps_hz = None if fps is None else parse_rate(fps)
    # Several fingertips: a process each.
    if has_several:
        same = {
            "signals": signals, "json": as_json, "web": web, "host": host, "token": token,
            "speed": speed, "fps": fps, "exposure_ms": exposure_ms,
            "audio_offset_ms": audio_offset_ms or None, "quiet": quiet,
        }  # fmt: skip
        _run_several(videos, audios, sensors, to, port, same, control)
        return
    video, audio, sensor = (given[0] if given else None for given in (videos, audios, sensors))
    # One fingertip's signals.
    if signals is not None:
        if video is None:
            raise InputError("--video: expected a source, such as camera:0 or rig, found none")
        names = given_out.parse_signals(signals, audio is not None)
        places = given_out.prepare_places(to, (video, audio))
        tip = fingertip.stream(video, audio, sensor, offset_s, factor, fps_hz, exposure_ms)
        with controls.set_rest_on_request(tip.set_rest, control):
            given_out.give_signals(tip, names, places, name)
        return
    # What models recognise, or a look at what comes in.
    for page in beside:
        if not page.partition("=")[2].isdecimal():
            raise InputError(f"--beside: expected a name and a port, as right=8801, found '{page}'")
    ports = {tip: int(port) for tip, _, port in (page.partition("=") for page in beside)}
    if list(model) == [Path(DEMO)]:
        model = _train_demo(video, audio, quiet or as_json)
    if not model and learn is not None and (own := learn / "sensor.toml").is_file():
        sensor = sensor or str(own)
    sources, pipeline = outlets.open_pipeline(
        model, video, audio, sensor, factor, fps_hz, exposure_ms, offset_s
    )
    with events.close_afterwards(sources):
        if learn is not None:
            pipeline.learn(learn, (video or "").startswith("rig"))
        greeting = {"name": name, "beside": ports}
        page_at = (host, port, token) if web else None
        outlets.give_out(sources, pipeline, page_at, lsl, as_json, control, greeting)


def _run_several(
    videos: Sequence[str],
    audios: Sequence[str],
    sensors: Sequence[str],
    to: Sequence[str],
    port: int,
    same: Mapping[str, Any],
    control: bool,
) -> None:
    """Run `live` for each of several fingertips, with the options that are the same for all."""
    from afferents.choices import flag_of
    from afferents.lab.live import several, signals

    given = {flag_of(key): value for key, value in same.items() if value not in (None, False)}
    words = [w for flag, v in given.items() for w in ((flag,) if v is True else (flag, str(v)))]
    commands = several.make_commands(videos, audios, sensors, to, port, words)
    if same["signals"] is not None:  # what is wrong is reported once, before any begins
        signals.parse_signals(same["signals"], bool(audios))
        files = {*to} - several.SHARED
        signals.prepare_places([several.add_name(at, tip) for tip in commands for at in files], ())
    several.run_each(commands, control)


def _train_demo(video: str | None, audio: str | None, quiet: bool) -> list[Path]:
    """Return exported models for sources of the simulated rig; they are trained if need be."""
    from afferents.reproduction.demo import demo_models

    named = [source for source in (video, audio) if source is not None]
    if not named or any(not source.startswith("rig") for source in named):
        raise InputError(
            f"--model {DEMO}: expected sources of the simulated rig, such as --video rig, found "
            f"{', '.join(named) or 'none'}; run 'afferents train' and 'afferents export' for "
            "others"
        )
    with Progress(quiet) as progress:
        both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (video, audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]
