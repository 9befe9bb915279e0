"""Commands of the rig, simulated or printed: recordings and drums."""

from pathlib import Path
from typing import Annotated

import typer

from afferents.choices import Nodules, Remount, Size, numbers_in
from afferents.cli.options import shows
from afferents.cli.printing import say
from afferents.cli.shared import SEED, ClusterName, Force, Json, Quiet, SensorName, Workers

Preset = Annotated[
    Size,
    typer.Option(help="Length of recordings: 'quick' has 8 s, 'paper' 65 s; both have 10 speeds."),
]
Textures = Annotated[
    str,
    typer.Option(
        help="Textures, comma-separated: letters a to m, bump spacings in mm, or names of "
        "height maps."
    ),
]
Speeds = Annotated[
    str | None,
    typer.Option(help="Sliding speeds, mm/s, comma-separated (default: 10, 20, ... 100)."),
]
Seconds = Annotated[
    float | None, typer.Option(help="Length of each recording, s (default: the preset's).")
]
HeightMaps = Annotated[
    list[str] | None,
    typer.Option(
        help="A surface of your own: NAME=FILE,LENGTH_MM,HEIGHT_MM, where FILE is an image or "
        ".npy; may be repeated."
    ),
]
Nuisances = Annotated[
    str,
    typer.Option(
        help="Imperfections of the rig: 'all', 'hard', 'none', or names, with =STRENGTH to set "
        "the strength: all,tilt=0.02."
    ),
]
Mounted = Annotated[
    Remount,
    typer.Option(
        help="When the fingertip is mounted: once a 'session', or anew for each 'drum' or each "
        "'run'."
    ),
]
Reprint = Annotated[
    int | None,
    typer.Option(
        help="Set of printed drums, 0, 1, ...: each set has printing errors of its own "
        "(default: the seed's)."
    ),
]
Indentation = Annotated[
    float | None,
    typer.Option(
        help="How deep the fingertip is pressed on, mm, kept as the condition indentation_mm "
        "(default: 1, the paper's)."
    ),
]
WithNodules = Annotated[
    Nodules,
    typer.Option(help="Whether the skin has its fingerprint's nodules or is flat."),
]
SessionSeed = Annotated[
    int, typer.Option(**SEED, help="Random seed; the same seed gives the same session.")
]


@shows("preset", "textures", "speeds", "seconds", "nuisances", "seed", "sensor", "workers", "quiet")
def simulate(
    session: Annotated[Path, typer.Argument(help="Session folder to write.")],
    preset: Preset = "quick",
    textures: Textures = "a,b,c,d,e,f,g,h,i,j,k,l,m",
    speeds: Speeds = None,
    seconds: Seconds = None,
    height_map: HeightMaps = None,
    nuisances: Nuisances = "all",
    remount: Mounted = "session",
    reprint: Reprint = None,
    indentation: Indentation = None,
    nodules: WithNodules = "on",
    seed: SessionSeed = 0,
    sensor: SensorName = "tip_b",
    workers: Workers = None,
    cluster: ClusterName = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a session: a fingertip slides over textured drums, filmed and recorded.

    Writes raw mp4 and wav files, as a real rig would.
    """
    import afferents

    afferents.simulate(
        session,
        preset,
        textures.split(","),
        numbers_in(speeds, "--speeds"),
        seconds,
        seed=seed,
        height_maps=height_map or (),
        nuisances=nuisances,
        remount=remount,
        reprint=reprint,
        indentation_mm=indentation,
        nodules=nodules,
        sensor=sensor,
        workers=workers,
        cluster=cluster,
        quiet=quiet or as_json,
    )
    say(as_json, {"session": str(session)}, f"Session (simulated): {session}")


def drum(
    texture: Annotated[
        str,
        typer.Argument(
            help="Its texture: a letter a to m, a bump spacing in mm, or "
            "NAME=FILE,LENGTH_MM,HEIGHT_MM."
        ),
    ],
    out: Annotated[Path, typer.Argument(help="STL file to write, such as drum.stl.")],
    bore: Annotated[float, typer.Option(help="Diameter of the hole for the spindle, mm.")] = 8.0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a textured drum as an STL file for a 3-D printer.

    The diameter of its bumps, 0.36 of their spacing, is a guess: Figure 3 of the paper prints it.
    """
    from afferents.rig.drums import write_drum

    path = write_drum(texture, out, bore, force)
    say(as_json, {"stl": str(path)}, f"STL, in mm: {path}")
