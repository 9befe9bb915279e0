"""The recordings of a session: in the published layout, or as its session file names them.

Published are ``<texture>/<speed>/video.mp4`` and ``audio.wav`` (preprocess/process.ipynb and
vibrotactile/process_vibration.ipynb, cells 2-3): texture folders ``0 0.5 ... 6`` (bump spacing,
mm), speed folders ``10 20 ... 100`` (mm/s), the marker reference ``throw_away.mp4`` in the first of
them, ``0/10``. Repetitions are one folder deeper: ``<texture>/<speed>/<repetition>/``. The video
may be in any container (``video.avi``), or a folder of numbered images, ``video/``. A session file
names files one by one, or by a pattern.
"""

import glob
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from afferents.errors import InputError
from afferents.recordings import media, pictures, session_file
from afferents.recordings.audio import WavFile
from afferents.recordings.pattern import SPEED, TEXTURE, Pattern, parse_speed
from afferents.recordings.session_file import SESSION_FILES, ListedRecording, SessionFile
from afferents.recordings.video import VideoFile
from afferents.store.log import LoggedFile
from afferents.store.recording import Recording, Video, fold_label, require_utf8

VIDEO, AUDIO, REFERENCE = "video.mp4", "audio.wav", "throw_away.mp4"

_POSITIVE = re.compile(r"\d+(\.\d+)?")


def published(root: Path, declared: SessionFile) -> list[Recording]:
    """Return the recordings of a folder in the published layout, in no order; none is opened.

    Raises
    ------
    InputError
        If a folder is not named by a speed, or holds two videos or recordings within a recording.
    """
    found = []
    for folder in recording_folders(root):
        texture, speed, *repetition = folder.relative_to(root).parts
        if not _POSITIVE.fullmatch(speed) or float(speed) == 0:
            raise InputError(
                f"{root / texture / speed}: expected a folder named by its speed in mm/s, found "
                f"'{speed}'"
            )
        again = {"repetition": repetition[0]} if repetition else {}
        video, audio = find_video(folder), folder / AUDIO
        recording = Recording(
            name="/".join((texture, speed, *repetition)),
            texture=texture,
            speed_mm_s=float(speed),
            source=folder,
            video=make_clip(video, declared) if video else None,
            audio=WavFile(audio, declared.channel) if audio.is_file() else None,
            steady_s=declared.steady_s,
            conditions={"direction": declared.direction, **declared.conditions, **again},
            rest_frame=declared.rest_frame,
            named_by_spacing=True,
        )
        found.append(recording)
    return found


def recording_folders(root: Path) -> Iterator[Path]:
    """Yield the folders of recordings in the published layout, of whatever names."""
    for texture in _list_folders(root):
        for speed in _list_folders(texture):
            repetitions = [folder for folder in _list_folders(speed) if _is_recorded(folder)]
            if _is_recorded(speed):
                if repetitions:
                    raise InputError(
                        f"{speed}: expected a recording, or repetitions of it in folders of their "
                        f"own, found both ({repetitions[0].name} among them); move its files into "
                        "a folder of its own"
                    )
                yield speed
            yield from repetitions


def _list_folders(parent: Path) -> list[Path]:
    return [path for path in parent.iterdir() if path.is_dir() and not path.name.startswith(".")]


def _is_recorded(folder: Path) -> bool:
    return find_video(folder) is not None or (folder / AUDIO).is_file()


def find_video(folder: Path) -> Path | None:
    """Return the folder's video, in whatever container, or of images."""
    usual = folder / VIDEO
    if usual.is_file():  # most are
        return usual
    stem = usual.stem
    found = [
        path
        for path in sorted(folder.glob(f"{stem}*"))
        if path.stem == stem and (path.is_dir() if path.name == stem else media.is_video(path))
    ]
    if len(found) > 1:
        names = " and ".join(path.name for path in found)
        raise InputError(f"{folder}: expected one video, found {names}; move one of them elsewhere")
    return found[0] if found else None


def make_clip(
    path: Path, declared: SessionFile, own_hz: float | None = None, times: Path | None = None
) -> Video:
    """Return a video, or images as one; `own_hz` and the CSV `times` apply to it alone."""
    true_hz = own_hz or (declared.fps_hz if declared.fps_overrules else None)
    if not (path.is_dir() or path.suffix.lower() == pictures.ZIP):
        return VideoFile(path, true_hz)
    times = times or pictures.times_beside(path)
    if times is None and "fps_hz" in declared.model_fields_set:
        true_hz = true_hz or declared.fps_hz
    return pictures.ImageFolder(path, true_hz, times)


def session_around(path: Path) -> tuple[SessionFile, float | None]:
    """Return what the session says in which a video or sound lies, and the video's own rate, Hz.

    Where there is no session, no channel; where it names no rate for this video, no rate.
    """
    path = path.absolute()
    for folder in path.parents:
        if any((folder / name).is_file() for name in SESSION_FILES):
            declared = session_file.read_session_file(folder)
            own = (r.fps_hz for r in declared.recordings if path == folder / (r.video or ""))
            return declared, next(own, None)
    return SessionFile(sensor_channel=None), None


def listed(root: Path, declared: SessionFile) -> list[Recording]:
    """Return the recordings of a session whose files are named; none is opened.

    Raises
    ------
    InputError
        If a file is not there, a pattern fits none, or two recordings have one id.
    """
    entries = declared.recordings or tuple(_list_by_pattern(root, declared))
    if declared.audio_pattern and not any(entry.audio for entry in entries):
        raise InputError(
            f"{root / declared.file}: expected sound that the audio_pattern "
            f"'{declared.audio_pattern}' fits, found none; mend it, or leave it out"
        )
    _require_names(root / declared.file, entries)
    found = [_make_listed(root, entry, declared) for entry in entries]
    in_folder = Counter(one.source.parent for one in found)
    # A folder of its own may hold the log of its drum, or the reference of its markers.
    return [
        replace(one, source=one.source.parent) if in_folder[one.source.parent] == 1 else one
        for one in found
    ]


def _list_by_pattern(root: Path, declared: SessionFile) -> Iterator[ListedRecording]:
    """Yield the recordings of the files that a pattern fits."""
    where = root / declared.file
    pattern = Pattern(declared.pattern or "", where)
    sound = Pattern(declared.audio_pattern, where) if declared.audio_pattern else None
    if TEXTURE not in pattern.names:
        expected = "a pattern with {texture}, or with {texture} and {speed}"
        raise InputError(f"{where}: expected {expected}, found '{pattern.text}'")
    found = pattern.paths_in(root)
    if not found:
        there = media.find_media(root)
        raise InputError(
            f"{where}: expected files that the pattern '{pattern.text}' fits, found "
            f"{f'none among {media.named(root, there)}' if there else 'no recordings at all'}; "
            "mend the pattern, or list the recordings"
        )
    for path, values in found:
        file = path.relative_to(root).as_posix()
        require_utf8(file)
        # Whether all have sound is checked of all together.
        sound_file = _find_in_any_case(root, sound.filled(values)) if sound else None
        heard = media.is_sound(path)
        speed = parse_speed(values[SPEED]) if SPEED in values else None
        if speed == 0:
            raise InputError(f"{path}: expected a speed above 0 mm/s, found {values[SPEED]}")
        others = {name: text for name, text in values.items() if name not in (TEXTURE, SPEED)}
        parts = [values[TEXTURE]]
        parts += [values[SPEED].replace(",", ".")] if SPEED in values else []
        parts += ["_".join(others.values())] if others else []
        yield ListedRecording(
            video=None if heard else file,
            audio=file if heard else sound_file,
            texture=_require_label(path, values[TEXTURE]),
            speed_mm_s=speed,
            id="/".join(_require_label(path, part) for part in parts),
            conditions=others,
        )


def _find_in_any_case(root: Path, file: str) -> str | None:
    """Return a file, or one whose ending differs from it in capitals alone; None for none."""
    wanted = root / file
    if wanted.is_file():
        return file
    for path in wanted.parent.glob(f"{glob.escape(wanted.stem)}.*"):
        if path.suffix.lower() == wanted.suffix.lower():
            return path.relative_to(root).as_posix()
    return None


def _require_label(path: Path, text: str) -> str:
    try:
        return session_file.require_label(fold_label(text))
    except ValueError as error:
        raise InputError(f"{path}: expected {error!s}, found '{text}'; rename the file") from error


def _require_names(where: Path, entries: tuple[ListedRecording, ...]) -> None:
    """Refuse two recordings of one id, and one whose group would lie in another's."""
    by_name: dict[str, ListedRecording] = {}
    for entry in entries:
        other = by_name.setdefault(entry.name, entry)
        if other is not entry:
            raise InputError(
                f"{where}: expected recordings with an id each, found {other.file} and "
                f"{entry.file}, both {entry.name}; give them a repetition or an id (conditions "
                "make none), or name in the pattern what differs"
            )
    for name in by_name:
        for parent in map(str, Path(name).parents):
            if parent in by_name:
                raise InputError(
                    f"{where}: expected ids of which none lies in another, found {parent} and "
                    f"{name}; give both a repetition, or an id"
                )


def _make_listed(root: Path, entry: ListedRecording, declared: SessionFile) -> Recording:
    repetition = {} if entry.repetition is None else {"repetition": entry.repetition}
    direction = declared.model_dump(include={"direction"}, exclude_unset=True)
    video, audio, times = (
        _require_there(root, file) for file in (entry.video, entry.audio, entry.times)
    )
    return Recording(
        name=entry.name,
        texture=entry.texture,
        speed_mm_s=entry.speed_mm_s,
        source=root / entry.file,
        video=make_clip(video, declared, entry.fps_hz, times) if video else None,
        audio=WavFile(audio, declared.channel) if audio else None,
        steady_s=entry.steady_s or declared.steady_s,
        conditions={**direction, **declared.conditions, **repetition, **entry.conditions},
        sensor=sensor_named(root, entry.sensor) if entry.sensor else None,
        rest_frame=declared.rest_frame if entry.rest_frame is None else entry.rest_frame,
        beside=tuple(
            LoggedFile(log.name, root / log.file, log.time, log.columns, log.units)
            for log in entry.beside
        ),
    )


def sensor_named(root: Path, name: str) -> str:
    """Return the path of a sensor file as a session says it; a packaged sensor's name stays."""
    path = root / name
    return str(path) if path.is_file() or Path(name).suffix else name


def _require_there(root: Path, file: str | None) -> Path | None:
    """Return where a file is that a session names; None for none."""
    if file is None:
        return None
    if not (root / file).exists():
        there = media.find_media(root)
        found = f"no such file (there are {media.named(root, there)})" if there else "no such file"
        raise InputError(f"{root / file}: expected a file that the session names, found {found}")
    return root / file


def find_reference(root: Path, declared: SessionFile, first: Recording) -> Video | None:
    """Return the skin at rest: what is declared, or a clip next to the first recording."""
    if path := _require_there(root, declared.reference):
        if path.suffix.lower() in media.IMAGES:
            return pictures.ImageFolder(path, 1.0)
        return make_clip(path, declared)
    path = first.source / REFERENCE
    return VideoFile(path) if path.is_file() else None


def find_press(root: Path, declared: SessionFile) -> Recording | None:
    """Return the recording by which clocks are set; None where none is declared."""
    return _make_listed(root, declared.press, declared) if declared.press else None
