"""Commands on recordings: look at, calibrate, track, extract, fetch."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from afferents.choices import Rest
from afferents.cli.errors import fail_if_skipped
from afferents.cli.printing import once_a_kind, say
from afferents.cli.shared import (
    Accept,
    ClusterName,
    Force,
    FpsHz,
    Json,
    KeepGoing,
    Quiet,
    SensorName,
    Session,
    StoreOut,
    TrackerName,
    Workers,
)
from afferents.progress import Progress


def fetch(
    name: Annotated[
        str,
        typer.Argument(
            help="Data set: pestell2022, fabricslide, cluster-haptic-accel or cluster-haptic-audio."
        ),
    ],
    folder: Annotated[Path, typer.Argument(help="Folder that it goes into.")],
    url: Annotated[
        str | None,
        typer.Option(
            help="Another place where it is: a folder of a web server that lists its files, or "
            "what the paths of --manifest count from."
        ),
    ] = None,
    manifest: Annotated[
        Path | None,
        typer.Option(help="List of its files: PATH SHA-256 BYTES a line, or as sha256sum writes."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fetch a public data set, with its size and licence said before it begins.

    Run it again to go on with the file at which it was stopped.
    """
    import afferents
    from afferents.recordings.fetch.fetch import public_sets

    found = afferents.fetch(name, folder, url, manifest, quiet or as_json)
    outcome = {**vars(found), "folder": str(found.folder)}
    then = public_sets()[name].next_step.format(folder=folder)
    say(
        as_json,
        outcome,
        f"{found.fetched} files fetched, {found.kept} were here: {folder}",
        f"Next: {then}",
    )


# Commands of recordings: look at them, calibrate a sensor, track markers, extract responses.


def init(
    folder: Annotated[
        Path, typer.Argument(help="Folder of videos, sound, folders of numbered images, or tables.")
    ],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a first session.toml, or dataset.toml for tables, and say what was guessed."""
    import afferents

    made = afferents.init_session(folder, force)
    found = {"session_file": str(made.path), "said": made.sentences}
    what = "Session file" if made.path.name == "session.toml" else "Description"
    say(as_json, found, *made.sentences, f"{what} to check: {made.path}")


def inspect(
    source: Annotated[
        str,
        typer.Argument(
            help="A video (or folder of images), sound, a session folder, a store, a "
            "dataset.toml, or fabricslide:PATH."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the pictures (default: NAME-inspected).")
    ] = None,
    sensor: Annotated[
        str | None, typer.Option(help="Sensor file (TOML), or the name of a packaged one.")
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(help="Video to write with the tracked markers drawn in, such as o.mp4."),
    ] = None,
    fps: FpsHz = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Check a file or a session: what it holds, whether it is sound, and a picture of it."""
    import afferents

    found = afferents.inspect(source, out, sensor, overlay, force, quiet or as_json, fps)
    say(
        as_json,
        vars(found),
        *found.sentences,
        *(f"Problem: {problem}" for problem in once_a_kind(found.problems)),
        *(f"Picture: {path}" for path in found.pictures),
    )
    if found.problems:
        raise typer.Exit(2)


def calibrate(
    videos: Annotated[
        list[Path],
        typer.Argument(help="Videos of one sensor, each beginning with the skin at rest."),
    ],
    out: Annotated[
        Path, typer.Option(help="Sensor file (TOML) to write; a picture is put beside it.")
    ],
    pitch_mm: Annotated[
        float | None,
        typer.Option(help="Distance between neighbouring markers on the skin, mm, if known."),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Measure a new sensor: how its markers look and how they are laid out.

    Writes the sensor file that the other commands take.
    """
    from afferents.inspection.calibrate import calibrate_sensor

    said, picture = calibrate_sensor(videos, out, pitch_mm, force)
    found = {"sensor": str(out), "picture": str(picture), "said": said}
    say(as_json, found, *said, f"Sensor file: {out}", f"Picture to check: {picture}")


def track(
    source: Annotated[Path, typer.Argument(help="A video (or folder of images), or a session.")],
    out: StoreOut,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor file (TOML) or name (default: recognised from a video; what its file "
            "names, else tip_b, for a session)."
        ),
    ] = None,
    method: TrackerName = "windowed",
    workers: Workers = None,
    cluster: ClusterName = None,
    fps: FpsHz = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Track the markers in a video, or in all videos of a session.

    Writes their positions, SA-I and RA-I.
    """
    from afferents.extraction.track import track_into
    from afferents.markers.sensor import load_sensor

    with Progress(quiet or as_json) as progress:
        given = load_sensor(sensor) if sensor else None
        said = track_into(source, out, given, method, progress, force, workers, cluster, fps)
    say(as_json, {"store": str(out), "said": said}, *said, f"Store: {out}")


def extract(
    session: Session,
    out: StoreOut,
    sensor: Annotated[
        str | None,
        typer.Option(
            help="Sensor file (TOML), or the name of a packaged one (default: what the session "
            "file names, else tip_b)."
        ),
    ] = None,
    method: TrackerName = "windowed",
    rest: Annotated[
        Rest,
        typer.Option(
            help="Rest positions that SA-I is measured from: of each recording's 'own' rest "
            "frame, or of the 'reference' clip throw_away.mp4."
        ),
    ] = "own",
    fps_hz: FpsHz = None,
    workers: Workers = None,
    cluster: ClusterName = None,
    keep_going: KeepGoing = False,
    accept: Accept = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn the videos and audio of a session into marker tracks, SA-I, RA-I and RA-II.

    Recordings that the store holds already are kept.
    """
    import afferents
    from afferents.extraction.copies import notes_of

    extracted = afferents.extract(
        session,
        out,
        sensor,
        method,
        rest=rest,
        keep_going=keep_going,
        accept=accept or (),
        workers=workers,
        cluster=cluster,
        quiet=quiet or as_json,
        fps_hz=fps_hz,
    )
    store, skipped = str(out) if extracted else None, extracted.skipped
    found = {"store": store, "skipped": skipped, **asdict(notes_of(out))}
    say(as_json, found, *([f"Store: {out}"] if extracted else []))
    fail_if_skipped(skipped)


def align(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Recordings of touches on something smooth: folders of mp4 and wav."),
    ],
    sensor: SensorName = "tip_b",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure the time offset between microphone and camera, for 'live --audio-offset-ms'."""
    from afferents.extraction.align import align as measure
    from afferents.markers.sensor import load_sensor

    with Progress(quiet or as_json) as progress:
        found = measure(recordings, load_sensor(sensor), progress)
    say(as_json, found._asdict(), *found.describe())
