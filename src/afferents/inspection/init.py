"""A first session.toml or dataset.toml for a folder: what was found, and what was guessed."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from afferents import documents, files
from afferents.errors import InputError, reading, then
from afferents.markers.sensor import load_sensor
from afferents.quality.lasting import EDGE_S
from afferents.recordings import check, layouts
from afferents.recordings.data_sets import read_session, readers
from afferents.recordings.described import DATA_SET_FILE, Described
from afferents.recordings.draft import find_tables, guess_data_set
from afferents.recordings.guess import Guess, guess_recordings, guess_rule
from afferents.recordings.media import find_media, is_sound, named
from afferents.recordings.pattern import Pattern
from afferents.recordings.session_file import SESSION_FILE, SESSION_TOML, SessionFile
from afferents.recordings.video import open_video
from afferents.store.motion import TELL_SPEED
from afferents.store.recording import RecordingSet, require_utf8

MARK = "written by 'afferents init'"
MOST_NAMED = 30
"""Textures that are named at most, and values of a condition."""
_STRAY = "Files whose names do not follow this pattern are left out"


@dataclass(frozen=True)
class FirstSession:
    """The session file (or `dataset.toml`) that was written, and sentences on what it rests on."""

    path: Path
    sentences: list[str]


def _describe_tables(folder: Path, force: bool) -> FirstSession:
    """Write a first `dataset.toml` into a folder of tables."""
    target = folder / DATA_SET_FILE
    files.require_free(target, _is_ours, force=force)
    lines, sentences = guess_data_set(folder, find_tables(folder))
    files.write_text(target, "\n".join([*_head("description of these tables"), *lines]) + "\n")
    try:
        data_set = Described(folder)
        session = data_set.scan()
        for recording in session.recordings[:1]:
            if recording.audio is not None:
                recording.audio.read()
    except InputError as error:
        fault = f"To be mended before it can be learnt from: {error}."
        return FirstSession(target, [*sentences, fault])
    grid = f"{grid_sentence(session)} Check all with 'afferents inspect'."
    return FirstSession(target, [*sentences, *data_set.left_out(session), grid])


def _is_ours(path: Path) -> bool:
    return files.has_mark(path, MARK)


def _head(what: str) -> list[str]:
    return [
        f"# A first {what}, {MARK}: please check it.",
        "# All that can stand here is described in docs/your-data.md.",
    ]


def grid_sentence(session: RecordingSet) -> str:
    """Return of how many textures and speeds there are recordings."""
    speeds = ", ".join(f"{speed:g}" for speed in session.speeds_mm_s)
    n = len(session.speeds_mm_s)
    at = f"{n} speed{'s' * (n > 1)} ({speeds} mm/s)" if speeds else "unknown speed"
    if not speeds and all({log.name for log in r.beside} & TELL_SPEED for r in session.recordings):
        at = "speeds that are logged alongside"
    return (
        f"{len(session.recordings)} recordings of {len(session.textures)} textures "
        f"({list_first(session.textures)}) at {at}."
    )


def list_first(names: Sequence[str]) -> str:
    """Return the first names, and dots where there are more."""
    return ", ".join([*names[:MOST_NAMED], *["..."] * (len(names) > MOST_NAMED)])


@dataclass(frozen=True)
class _Found:
    """What lies in a folder.

    Attributes
    ----------
    media
        Videos, sound and folders of images, as a session file names them.
    rates_hz, lengths_s
        Of the videos that could be read.
    broken
        What is wrong with the others.
    sensors
        Sensor files.
    in_layout
        Whether recordings lie in the published layout.
    """

    media: list[str]
    rates_hz: dict[str, float]
    lengths_s: dict[str, float]
    broken: dict[str, str]
    sensors: list[str]
    in_layout: bool

    @property
    def readable(self) -> list[str]:
        """All that could be read."""
        return [path for path in self.media if path not in self.broken]

    @property
    def has_pictures(self) -> bool:
        """Whether there is something else than sound."""
        return bool(self.lengths_s) or any(path.endswith("/") for path in self.media)


def init_session(folder: files.Place, force: bool = False) -> FirstSession:
    """Write a first session.toml, or dataset.toml for tables, and say what was guessed.

    Parameters
    ----------
    folder
        Folder of videos, sound, folders of numbered images, or tables.
    force
        Overwrite what this command wrote there before (nothing else).

    Returns
    -------
    FirstSession
        The `path` of the file, and `sentences` on what was guessed and is to be checked.

    Raises
    ------
    InputError
        If there are no recordings in the folder, or a session file is there.

    Examples
    --------
    >>> made = init_session("clips")
    >>> made.path.name
    'session.toml'
    """
    folder = Path(folder)
    if not folder.is_dir():
        found_there = "a file" if folder.exists() else "no such folder"
        raise InputError(f"{folder}: expected a folder of recordings, found {found_there}")
    kinds = (kind for kind in readers().values() if not kind.drafted and kind.recognises(folder))
    if known := next(kinds, None):
        raise InputError(
            f"{folder}: expected a folder that needs a description, found {known.title}, which "
            f"'afferents extract {folder} OUT.zarr' reads as they are"
        )
    try:
        has_tables = bool(find_tables(folder)) and not find_media(folder)
    except OSError:  # which `_look` reports
        has_tables = False
    if has_tables:
        return _describe_tables(folder, force)
    target = folder / SESSION_TOML
    if (folder / SESSION_FILE).exists():
        do = "it holds already what a session file would"
        raise InputError(f"{folder}: expected a folder without {SESSION_FILE}, found one{then(do)}")
    files.require_free(target, _is_ours, force=force)
    found = _look(folder)
    lines, sentences = _write_lines(found)
    files.write_text(target, "\n".join(lines) + "\n")
    try:
        session = read_session(folder)
    except InputError as error:
        outcome = [f"To be mended before it is a session: {error}."]
    else:
        outcome = [grid_sentence(session), *session.left_out()]
    return FirstSession(target, [*sentences, *_list_doubts(found), *outcome])


def _look(folder: Path) -> _Found:
    with reading(folder, "a readable folder", OSError):
        paths = find_media(folder)
        try:
            in_layout = bool(layouts.published(folder, SessionFile.model_validate({"fps_hz": 1})))
        except InputError:
            in_layout = False
    if paths == [folder]:
        raise InputError(
            f"{folder}: expected a folder of recordings, found the images of one; give the folder "
            f"that holds it, {folder.resolve().parent}"
        )
    paths = [path for path in paths if path != folder]  # pictures among recordings
    if not paths:
        raise InputError(
            f"{folder}: expected videos, sound, or folders of numbered images, found none of them"
        )
    rates, lengths, broken = {}, {}, {}
    media = [f"{path.relative_to(folder).as_posix()}{'/' * path.is_dir()}" for path in paths]
    for name in media:
        require_utf8(name)
    for name, path in zip(media, paths, strict=True):
        if path.is_dir() or is_sound(path):
            continue
        try:
            video = open_video(path)
        except InputError as error:
            broken[name] = str(error)
        else:
            rates[name], lengths[name] = video.fps_hz, video.duration_s
    sensors = []
    for path in sorted(folder.glob("*.toml")):
        with suppress(InputError):
            load_sensor(path)
            sensors.append(path.name)
    return _Found(media, rates, lengths, broken, sensors, in_layout)


def _write_lines(found: _Found) -> tuple[list[str], list[str]]:
    """Return the lines of a session file, and sentences on what they rest on."""
    head = [*_head("session file"), ""]
    videos = [path for path in found.readable if not is_sound(Path(path))]
    if found.in_layout:
        sentences = ["Recordings lie in the published layout, <texture>/<speed>/video.mp4."]
        return [*head, *_write_common(found, {})], sentences
    names, own = videos or found.readable, {}
    if len(found.sensors) > 1:  # some may be named like recordings
        by_stem = {Path(sensor).stem: sensor for sensor in found.sensors}
        stems = {path: Path(path.rstrip("/")).stem for path in found.readable}
        own = {path: by_stem[stem] for path, stem in stems.items() if stem in by_stem}
    pattern = guess_rule(names)
    if pattern and not own and not found.broken:
        lines, sentences = _write_pattern(found, pattern, names)
        return [*head, *lines, "", *_write_common(found, own)], sentences
    guesses = guess_recordings(found.readable)
    sentences = [
        f"{len(guesses)} recordings are listed one by one; guessed: the texture is the first "
        "folder, or else the file's name."
    ]
    if not any(guess.speed_mm_s for guess in guesses):
        sentences.append("No name says a speed in mm/s: fill in speed_mm_s where you know it.")
    recordings = _write_list(guesses, own, _find_contradictions(found))
    return [*head, *_write_common(found, own), *recordings], sentences


def _write_pattern(
    found: _Found, pattern: str, names: Sequence[str]
) -> tuple[list[str], list[str]]:
    """Return the lines and sentences of names that follow a rule."""
    lines = [
        "# What stands in braces is read from the names of files. texture may be any label; speed",
        "# is in mm/s; other names (trial, pressure, direction) are conditions.",
        f"pattern = {documents.quoted(pattern)}",
    ]
    sentences = [f"Guessed from the names: {pattern}, with the speed in mm/s."]
    if "{speed}" not in pattern:
        sentences = [f"Guessed from the names: {pattern}; no name says a speed."]
    if any(Pattern(pattern).values(name.rstrip("/")) is None for name in names):
        lines.insert(2, f"# {_STRAY}.")
        sentences.append(f"{_STRAY}. Rename what is to be a recording.")
    sounds = [path for path in found.media if is_sound(Path(path))]
    if sounds and not is_sound(Path(names[0])):
        stem = pattern.rstrip("/") if pattern.endswith("/") else pattern.rpartition(".")[0]
        lines.append(f"audio_pattern = {documents.quoted(stem + Path(sounds[0]).suffix)}")
    return lines, sentences


def _write_common(found: _Found, own: Mapping[str, str]) -> Iterator[str]:
    """Yield the lines on what all recordings share; what is not known is commented out."""
    if len(found.sensors) == 1:
        yield f"sensor = {documents.quoted(found.sensors[0])}"
    elif not own and found.has_pictures:
        yield "# The sensor file; 'afferents calibrate CLIP --out mine.toml' makes one."
        yield '# sensor = "mine.toml"'
    yield ""
    yield "# Start and end of constant speed in every recording, s. Without it, the first and last"
    yield f"# {EDGE_S:g} s are left out, and shorter recordings can't be learnt from."
    yield "# steady_s = [0.5, 2.5]"
    yield ""
    images = [path for path in found.media if path.endswith("/")]
    if images:
        yield "# Images say no rate: how many were taken a second?"
        yield "# fps_hz = 30"
    elif found.rates_hz:
        rates = ", ".join(f"{rate:g}" for rate in sorted(set(found.rates_hz.values())))
        yield f"# Frames a second; the containers say {rates}. Where that is wrong, the true rate:"
        yield f"# fps_hz = {min(found.rates_hz.values()):g}"
        yield "# fps_overrules = true"
    for path, fault in found.broken.items():
        yield f"# Left out, since it can't be read: {path!a} ({fault!a})"


def _find_contradictions(found: _Found) -> dict[str, float]:
    """Return the videos' rates, Hz, if they contradict each other."""
    rates = found.rates_hz
    apart = rates and max(rates.values()) > min(rates.values()) * (1 + check.RATE_TOLERANCE)
    return rates if apart else {}


def _write_list(
    guesses: Sequence[Guess], own: Mapping[str, str], rates_hz: Mapping[str, float]
) -> Iterator[str]:
    for guess in guesses:
        yield ""
        yield "[[recordings]]"
        for key, value in (
            ("video", guess.video and guess.video.rstrip("/")),
            ("audio", guess.audio),
            ("texture", guess.texture),
            ("repetition", guess.repetition),
            ("sensor", own.get(guess.video or guess.audio or "")),
        ):
            if value is not None:
                yield f"{key} = {documents.quoted(value)}"
        if guess.speed_mm_s:
            yield f"speed_mm_s = {guess.speed_mm_s:g}"
        else:
            yield "# speed_mm_s = 30"
        if guess.video and guess.video in rates_hz:
            yield f"# fps_hz = {rates_hz[guess.video]:g}  # as its container says"


def _list_doubts(found: _Found) -> Iterator[str]:
    """Yield what a person should look at."""
    if found.broken:
        paths = [Path(path) for path in found.broken]
        yield f"Can't be read, and left out: {named(Path(), paths)}."
    if rates := _find_contradictions(found):
        slow, fast = min(rates, key=lambda path: rates[path]), max(rates, key=lambda p: rates[p])
        yield (
            f"Frame rates contradict each other: {rates[slow]:g} in {slow}, {rates[fast]:g} in "
            f"{fast}; write the true fps_hz, or make a session of each rate."
        )
    short = {path: length for path, length in found.lengths_s.items() if length <= 2 * EDGE_S}
    if short:
        path = min(short, key=lambda one: short[one])
        yield (
            f"{len(short)} of {len(found.lengths_s)} videos last {2 * EDGE_S:g} s or less "
            f"({path} {short[path]:.1f} s): fill in steady_s, else they can't be learnt from."
        )
    if not found.sensors and found.has_pictures:
        yield "No sensor file lies here: make one with 'afferents calibrate' and name it as sensor."
