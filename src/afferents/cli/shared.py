"""Arguments and options that several commands take, each said once."""

from pathlib import Path
from typing import Annotated, Any

import typer

from afferents.choices import Cut, Method
from afferents.quality.issues import KINDS

Session = Annotated[
    Path,
    typer.Argument(
        help="Session folder: TEXTURE/SPEED/video.mp4 and audio.wav for each run, or any files "
        "that its session.toml names."
    ),
]
StoreOut = Annotated[Path, typer.Argument(help="Store (Zarr) to write, such as OUT.zarr.")]
Data = Annotated[
    str, typer.Argument(help="A store that 'extract' wrote, a dataset.toml, or fabricslide:PATH.")
]
ModelFolder = Annotated[Path, typer.Argument(help="Folder of a model that 'train' wrote.")]

Json = Annotated[
    bool, typer.Option("--json", help="Print the outcome as JSON on stdout; no progress bars.")
]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress bars; plain lines on stderr.")]
KeepGoing = Annotated[
    bool,
    typer.Option(
        "--keep-going", help="Skip recordings that fail, name them, and exit with code 3."
    ),
]
Force = Annotated[
    bool,
    typer.Option("--force", help="Overwrite what this command wrote there before (nothing else)."),
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes to run in parallel (default: one per core).")
]
ClusterName = Annotated[
    str | None,
    typer.Option("--cluster", help="Run on a Dask cluster instead, such as tcp://scheduler:8786."),
]
SensorName = Annotated[
    str, typer.Option("--sensor", help="Sensor file (TOML), or the name of a packaged one.")
]
Accept = Annotated[
    list[str] | None,
    typer.Option(
        "--accept",
        help="Keep recordings that fail this check, and mark them; may be repeated. "
        f"Checks: {', '.join(KINDS)}.",
    ),
]
CutName = Annotated[
    Cut,
    typer.Option(
        "--cut",
        help="Part of each recording to use: 'all' at constant speed, or the 'published' cut.",
    ),
]
TrackerName = Annotated[
    Method,
    typer.Option(
        "--tracker",
        help="How markers are matched from frame to frame; "
        "'published' repeats the reference code, flaws included.",
    ),
]
FpsHz = Annotated[
    float | None,
    typer.Option(
        "--fps",
        help="True frame rate of the videos, frames a second, where their files say another; "
        "times then count from it (default: what the session file says, else the files).",
    ),
]
Host = Annotated[str, typer.Option(help="Address that the page is served at.")]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port of the page.")]
Token = Annotated[
    str | None,
    typer.Option(help="Password for the page; required if other machines can reach it."),
]
SEED: dict[str, Any] = {"min": 0, "max": 2**32 - 1}
"""What may be a seed."""
