"""Commands that record: a session from a plan, and files recorded elsewhere."""

import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from afferents.errors import InputError
from afferents.files import Place
from afferents.progress import Progress

if TYPE_CHECKING:
    from afferents.recorder.gate import Check
    from afferents.recorder.plan_run import Recorded

_ONCE_MORE = "r"


def record(
    plan: Place,
    session: Place,
    dry_run: bool = False,
    ask: Callable[[str], None] | None = None,
    quiet: bool = False,
    web: tuple[str, int, str | None] | None = None,
    again: Sequence[str] = (),
) -> "Recorded":
    """Record a session: camera, microphone and drum on one clock, run after run of a plan.

    Parameters
    ----------
    plan
        A ``PLAN.toml``; ``afferents record --example PLAN.toml`` writes one.
    session
        Folder to write, in the published layout; runs that are in it are kept.
    dry_run
        Record the simulated rig instead of the plan's devices, four times as fast as in truth.
    ask
        Shows a person a sentence, such as ``change the drum to 4``, and returns when it is done;
        None for a line in the terminal.
    quiet
        Whether no progress is shown.
    web
        Address, port and token of a page that shows the recording and asks instead of the
        terminal; None for no page. A dry run with a page is a rehearsal: it asks, too.
    again
        Names of runs, such as ``4/60``, to be recorded although they are in the session. Those in
        it are kept aside once the new ones are accepted.

    Returns
    -------
    Recorded
        Names of the runs that were recorded, and what was refused and why.

    Raises
    ------
    InputError
        If the plan or a device is not what it should be, the session is of another plan, or the
        disk is full. What is finished is kept.
    """
    from afferents.recorder.plan_run import record as run
    from afferents.recorder.plan_run import recording_of

    if web is not None:
        return _beside_a_page(Path(plan), Path(session), dry_run, quiet, web, again)
    wanted = recording_of(Path(plan), dry_run, ask or ask_in_terminal)
    with Progress(quiet) as progress:
        return run(wanted, Path(session), progress, again)


def _beside_a_page(
    plan: Path,
    session: Path,
    dry_run: bool,
    quiet: bool,
    web: tuple[str, int, str | None],
    again: Sequence[str],
) -> "Recorded":
    """Record; who looks on at the page may press its buttons, or enter in the terminal."""
    from afferents.live.web.server import page_beside
    from afferents.recorder.page import RecordingPage
    from afferents.recorder.plan_run import record as run
    from afferents.recorder.plan_run import recording_of
    from afferents.recorder.watch import NEXT, REDO, Watch

    watch = Watch(show_in_terminal)
    wanted = recording_of(plan, dry_run, watch.wait, watch=watch)

    def typed() -> None:
        for line in sys.stdin:
            watch.request(REDO if line.strip() == _ONCE_MORE else NEXT)

    with page_beside(RecordingPage(watch, wanted.sensor), *web, watch.request):
        threading.Thread(target=typed, name="afferents-enter", daemon=True).start()
        try:
            with Progress(quiet) as progress:
                done = run(wanted, session, progress, again)
        except BaseException as error:
            stopped = not isinstance(error, Exception)
            watch.end("stopped: what is finished is kept" if stopped else str(error))
            raise
        missing = f"; {len(done.remaining)} are missing" if done.remaining else ""
        watch.end(f"done: {len(done.recorded)} runs recorded{missing}")
        return done


def import_recording(
    video: Place,
    audio: Place | None,
    times: Place | None,
    session: Place,
    texture: str,
    speed_mm_s: float,
    audio_start_s: float | None = None,
    keep: bool = False,
    image_topic: str | None = None,
    audio_topic: str | None = None,
    audio_rate_hz: int | None = None,
    audio_channels: int | None = None,
) -> "list[Check]":
    """Bring a recording made elsewhere into a session, with its own time stamps.

    Parameters
    ----------
    video, audio
        Files; `audio` may be None. The frames are not encoded again. Instead of a video it may be
        a bag of ROS (a rosbag2 folder, an MCAP file or a ``.bag``), which holds times and sound as
        well; that needs the extra ``mcap``.
    times
        CSV with a row a frame: `time_s`, and `sequence` where the camera numbers its frames. None
        of a bag.
    session
        Folder to write, or to add to.
    texture, speed_mm_s
        What was recorded.
    audio_start_s
        When the first sample was taken, on the clock of `times`; None for with the first frame.
    keep
        Whether it is imported although frames are missing.
    image_topic, audio_topic
        Of a bag; None for the only one of pictures, and of sound.
    audio_rate_hz, audio_channels
        Of a bag's sound where its messages do not say it; None for 44100 and 1.

    Returns
    -------
    list
        What the gate says of the frames, a `Check` each.

    Raises
    ------
    InputError
        If a file or its times are not what they should be.
    """
    from afferents.recorder.bags import Bag, bag_files, is_bag
    from afferents.recorder.importing import Import
    from afferents.recorder.importing import import_recording as run

    path, target = Path(video), Path(session)
    if is_bag(path):
        if audio is not None or times is not None:
            raise InputError(
                f"{path}: expected a bag alone, which holds sound and times, found more files"
            )
        bag = Bag(path, image_topic, audio_topic, audio_rate_hz, audio_channels)
        with tempfile.TemporaryDirectory(prefix="afferents-bag-") as folder:
            files = bag_files(bag, Path(folder))
            start_s = files.audio_start_s if audio_start_s is None else audio_start_s
            return run(
                Import(
                    files.video, files.audio, files.times, target, texture, speed_mm_s, start_s,
                    keep, path,
                )
            )  # fmt: skip
    if times is None:
        raise InputError(
            "--times: expected a CSV with the time of each frame, found none; or give a bag"
        )
    sound = None if audio is None else Path(audio)
    return run(Import(path, sound, Path(times), target, texture, speed_mm_s, audio_start_s, keep))


def show_in_terminal(sentence: str) -> None:
    """Show what is to be done."""
    print(f"\n>>> {sentence}", file=sys.stderr, flush=True)  # noqa: T201


def ask_in_terminal(sentence: str) -> None:
    """Show a sentence and wait for enter.

    Raises
    ------
    OnceMoreError
        If somebody enters ``r``: the last run is to be made once more first.
    InputError
        If nobody is there to press it.
    """
    show_in_terminal(sentence)
    line = sys.stdin.readline()
    if line.strip() == _ONCE_MORE:
        from afferents.recorder.watch import OnceMoreError

        raise OnceMoreError
    if not line:
        raise InputError(
            "stdin: expected somebody who changes drums and presses enter, found nobody"
        )
