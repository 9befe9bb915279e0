"""A first `dataset.toml` for a folder of tables."""

from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.files import write_text
from afferents.core.outputs import has_mark, require_free
from afferents.recordings import DATA_SET_FILE, Described, guess_data_set, media_in, tables_in


def is_of_tables(folder: Path) -> bool:
    """Tell whether a folder holds tables, and neither videos nor sound nor images."""
    try:
        return bool(tables_in(folder)) and not media_in(folder)
    except OSError:  # which whoever looks for videos says
        return False


def first_data_set(folder: Path, mark: str, force: bool) -> tuple[Path, list[str]]:
    """Write a first `dataset.toml` into a folder of tables.

    Parameters
    ----------
    mark
        What such a file is recognised by.
    force
        Whether one that was written so before may be replaced.

    Returns
    -------
    tuple
        Where it is, and sentences on what was guessed.

    Raises
    ------
    InputError
        If the folder has one already, or its first table can't be read.
    """
    target = folder / DATA_SET_FILE
    what = "a description of a data set"
    require_free(target, what, lambda path: has_mark(path, mark), force=force)
    lines, said = guess_data_set(folder, tables_in(folder))
    head = [
        f"# A first description of these tables, {mark}: please check it.",
        "# All that can stand here is described in docs/your-data.md.",
    ]
    write_text(target, "\n".join([*head, *lines]) + "\n")
    return target, [*said, _outcome(folder)]


def _outcome(folder: Path) -> str:
    """Say what it reads as, or what is still to be mended."""
    try:
        session = Described(folder).recordings()
        for recording in session.recordings[:1]:
            if recording.audio is not None:
                recording.audio.read()
    except InputError as error:
        return f"To be mended before it can be learnt from: {error}."
    speeds = ", ".join(f"{speed:g}" for speed in session.speeds_mm_s)
    return (
        f"{len(session.recordings)} recordings of {len(session.textures)} textures at "
        f"{speeds + ' mm/s' if speeds else 'unknown speed'}: check all with 'afferents inspect'."
    )
