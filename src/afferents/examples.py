"""One short simulated recording for newcomers, made once and kept."""

import json
import os
from pathlib import Path
from typing import Any

from filelock import FileLock

from afferents import dims, files
from afferents.extraction.extract import extract_session
from afferents.extraction.options import Extraction
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.rig.config import Rig
from afferents.rig.record import AUDIO, VIDEO
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import make_simulation
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses
from afferents.version import __version__

CACHE = "AFFERENTS_CACHE"
"""Environment variable that names another folder for what is kept."""
SPACING_MM, SPEED_MM_S, SECONDS = "4", 40.0, 4.0
"""Texture i of the paper; the drum has reached its speed after 1.5 s."""
_FOLDER, _KEPT, _LOCK = "example", "recording", "lock"
_SESSION, _STORE, _ABOUT = "session", "responses.zarr", "example.json"

_SHOWN = ("name", dims.TEXTURE, dims.SPEED, "sensor", "steady_s", "conditions")
"""Of the store's attributes: the others are for programs, and would hide these."""


def example(folder: str | Path | None = None, quiet: bool = False) -> Responses:
    """Return a short recording of the simulated rig: 4 s of a fingertip on a bumped drum.

    The soft fingertip has 361 markers inside. A drum with bumps 4 mm apart turns under it: at
    rest first, from 1.5 s on at 40 mm/s. A camera sees the markers and a microphone in the gel
    hears the vibration. The recording is simulated when it is asked for first, which takes some
    seconds, and is kept for the next time (about 10 MB).

    Parameters
    ----------
    folder
        Where it is kept; None for the folder that the environment variable ``AFFERENTS_CACHE``
        names, else ``afferents`` in the user's cache folder (``~/.cache``).
    quiet
        Whether no progress is shown.

    Returns
    -------
    xarray.Dataset
        In memory. `sa1` (time, marker), px, how far each marker is displaced from rest; `ra1`
        (time, marker), px/frame, the change of that; `ra2` (audio_time, channel), share of full
        scale, the vibration, `ra2.sample_rate_hz` samples a second; `position` (time, marker,
        space), px, and `detected` (time, marker), False where a marker was lost. `time` is in s;
        `row` and `column` are a marker's place in its grid of 19 by 19. SA-I is measured from the
        eleventh frame, at rest; the frames before it are NaN.

        Attributes: `texture`, the bumps' distance in mm, and `speed_mm_s`; the files `video`
        (mp4) and `audio` (wav), the `session` folder that holds them, and the `store` of the
        responses, for functions that take one, such as `afferents.samples`.

    Raises
    ------
    InputError
        If the folder can't be written.

    Examples
    --------
    >>> import afferents
    >>> responses = afferents.example(quiet=True)
    >>> responses.sa1.dims, responses.sa1.units
    (('time', 'marker'), 'px')
    >>> rests, slides = (responses.sel(time=slice(*s)) for s in ((0.1, 0.2), (2, 4)))
    >>> float(slides.sa1.mean()) > 5 * float(rests.sa1.mean())
    True
    >>> afferents.open_video(responses.video).width  # px
    640
    """
    if folder is None:
        of_user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folder = os.environ.get(CACHE) or of_user / "afferents"
    place = Path(folder).resolve() / _FOLDER
    kept = place / _KEPT
    if not _is_whole(kept):
        with files.naming(place / _LOCK):
            place.mkdir(parents=True, exist_ok=True)
            lock = FileLock(place / _LOCK).acquire()
        with lock:  # of two that ask at once, the second finds what the first has made
            if not _is_whole(kept):
                files.remove_partials(place)
                _make(kept, quiet)
    session = kept / _SESSION
    recording = session / SPACING_MM / f"{SPEED_MM_S:g}"
    (responses,) = open_responses(kept / _STORE)
    return (
        responses.load()
        .drop_attrs(deep=False)
        .assign_attrs(
            {name: responses.attrs[name] for name in _SHOWN},
            video=str(recording / VIDEO),
            audio=str(recording / AUDIO),
            session=str(session),
            store=str(kept / _STORE),
        )
    )


def _is_whole(kept: Path) -> bool:
    """Tell whether the example is there as this version made it."""
    try:
        about = json.loads((kept / _ABOUT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return bool(about == _about(kept))


def _about(kept: Path) -> dict[str, Any]:
    """Return what tells a whole example of this version from any other."""
    paths = sorted(path for path in kept.rglob("*") if path.is_file() and path.name != _ABOUT)
    return {
        "afferents": __version__,
        "made": [SPACING_MM, SPEED_MM_S, SECONDS],
        "rig": Rig().model_dump(mode="json"),
        "files": [path.relative_to(kept).as_posix() for path in paths],
        "checksum": files.checksum(*paths),
    }


def _make(kept: Path, quiet: bool) -> None:
    """Simulate and extract; what is left of an earlier example is replaced."""
    ours = files.holds_only(_SESSION, _STORE, _ABOUT)
    with files.write_aside(kept, replaces=ours) as partial, Progress(quiet) as progress:
        session, store = partial / _SESSION, partial / _STORE
        wanted = make_simulation(session, "quick", [SPACING_MM], [SPEED_MM_S], SECONDS)
        simulate_session(wanted, 1, progress)
        extract_session(
            Extraction(session=session, out=store, sensor=load_sensor("tip_b"), workers=1),
            progress,
        )
        files.write_json(partial / _ABOUT, _about(partial))
