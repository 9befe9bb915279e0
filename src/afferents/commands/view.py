"""The command that shows a recording in rerun's viewer."""

from pathlib import Path

from afferents.commands.given import Place


def view(
    source: Place, recording: str | None = None, store: Place | None = None,
    save: Place | None = None,
) -> dict[str, int]:  # fmt: skip
    """Show a recording in rerun's viewer: camera and markers, SA-I, RA-I, sound, drum, on one time.

    Needs the extra ``view``.

    Parameters
    ----------
    source
        A session, or a store, which has no pictures of the camera.
    recording
        Its name, such as ``4/60``; None for the first.
    store
        Of a session: the store that was extracted from it, for markers and responses.
    save
        File to write, which ``rerun FILE`` shows later; None to open the viewer.

    Returns
    -------
    dict
        How many values were logged, by entity.

    Raises
    ------
    InputError
        If there is no such recording, or the package is missing.

    Examples
    --------
    >>> view("responses.zarr", "4/60", save="touch.rrd")["sa1"]
    1800
    """
    from afferents.pipeline.bags.viewer import view as run

    given = [None if path is None else Path(path) for path in (store, save)]
    return run(Path(source), recording, *given)
