"""Commands that bring stores to other programs."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.cli.printing import say
from afferents.cli.shared import Json, Quiet


def export_lerobot(
    store: Annotated[Path, typer.Argument(help="A store that 'extract' wrote.")],
    out: Annotated[Path, typer.Argument(help="Folder to write.")],
    session: Annotated[
        Path | None,
        typer.Option(help="Session folder that the store was extracted from, for its videos."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a store as a LeRobot data set (format 3.0): an episode a recording.

    LeRobot itself is not needed.
    """
    import afferents

    n = afferents.export_lerobot(store, out, session, quiet or as_json)
    say(as_json, {"lerobot": str(out), "episodes": n}, f"LeRobot data set of {n} episodes: {out}")


# The command that writes recordings as ROS 2 bags in MCAP files.


def export_mcap(
    source: Annotated[Path, typer.Argument(help="A session, or a store that 'extract' wrote.")],
    out: Annotated[Path, typer.Argument(help="Folder to write; in it a bag for each recording.")],
    store: Annotated[
        Path | None,
        typer.Option(
            help="Store that was extracted from the session: its markers and responses are written "
            "beside the pictures."
        ),
    ] = None,
    recording: Annotated[
        list[str] | None,
        typer.Option(help="Name of a recording, such as 4/60 (default: all); may be repeated."),
    ] = None,
    quality: Annotated[
        int,
        typer.Option(help="Of JPEGs, 1 to 100, where the camera gave none; its own are kept."),
    ] = 95,
    percepts: Annotated[
        Path | None,
        typer.Option(help="What 'live --json' said of the one recording that is named."),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write recordings as ROS 2 bags in MCAP files, for Foxglove, rerun and 'ros2 bag play'.

    No ROS is needed, but the extra mcap is.
    """
    import afferents

    bags = afferents.export_mcap(
        source, out, store, recording or (), quality, percepts, quiet or as_json
    )
    lines = [f"Bag: {bag}" for bag in bags[:3]]
    more = [f"and {len(bags) - 3} more in {out}"] if len(bags) > 3 else []
    say(as_json, {"bags": [str(bag) for bag in bags]}, *lines, *more)


# The command that shows a recording in rerun's viewer.


def view(
    source: Annotated[Path, typer.Argument(help="A session, or a store that 'extract' wrote.")],
    recording: Annotated[
        str | None, typer.Argument(help="Its name, such as 4/60 (default: the first).")
    ] = None,
    store: Annotated[
        Path | None,
        typer.Option(help="Store that was extracted from the session: adds markers and responses."),
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option(help="New file (.rrd) to write for 'rerun FILE', not the viewer."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Show a recording in rerun's viewer: camera, markers, SA-I, RA-I, sound and drum on one time.

    Needs the extra view.
    """
    import afferents

    n = afferents.view(source, recording, store, save)
    lines = [f"{entity}: {number}" for entity, number in n.items()]
    say(as_json, {"logged": n}, *lines, *([f"Written: {save}"] if save else []))
