"""The command that asks spikes what the field asks of nerve fibres."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from afferents.commands.given import Place
from afferents.core.progress import Progress

if TYPE_CHECKING:
    from afferents.pipeline.neural import NeuralResults


def neural(
    store: Place,
    out: Place,
    units: str = "izhikevich",
    seed: int = 0,
    classes: Sequence[str] = ("SA", "RA", "PC"),
    window_s: float = 0.5,
    natural: Place | None = None,
    quiet: bool = False,
) -> "NeuralResults":
    """Turn a store's responses into spikes, and ask of them what is asked of nerve fibres.

    How often units fire; at which temporal resolution, and from how many units, texture is read;
    how rates grow with speed; whether trains stretch with it.

    Parameters
    ----------
    store
        As `extract` writes it: recordings of two textures and two speeds or more.
    out
        Folder for tables (CSV), figures (PNG) and `neural.json`.
    units
        Model of a unit: ``izhikevich`` or ``lif`` (leaky integrate-and-fire).
    seed
        Draws how units differ, and which are analysed.
    classes
        Of afferents, some of SA, RA and PC.
    window_s
        Of the stretches that texture is read from, s.
    natural
        TOML file that describes recordings of nerve fibres, to be put beside; see `read_natural`.
    quiet
        Whether no progress is shown.

    Returns
    -------
    NeuralResults
        `spikes`, `tables`, `sentences`, `pictures`.

    Raises
    ------
    InputError
        If the store can't be read, the folder holds something else, a recording has no speed, or
        there are fewer than two textures or speeds.

    Examples
    --------
    >>> found = neural("S.zarr", "neural")  # doctest: +SKIP
    >>> found.tables["stretch"].groupby(["class", "stretched"]).accuracy.mean()  # doctest: +SKIP
    """
    from pathlib import Path

    from afferents.pipeline.neural import neural as run

    fibres = None if natural is None else Path(natural)
    with Progress(quiet) as progress:
        return run(Path(store), Path(out), progress, units, seed, classes, window_s, fibres)
