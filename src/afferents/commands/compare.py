"""The command that holds a store against the authors' own arrays and networks."""

from pathlib import Path
from typing import TYPE_CHECKING

from afferents.commands.given import Place
from afferents.core.progress import Progress

if TYPE_CHECKING:
    from afferents.pipeline.authors.compare import Comparison


def compare(store: Place, authors: Place, quiet: bool = False) -> "Comparison":
    """Say how far a store is from the authors' own arrays and networks, at each stage of the way.

    Parameters
    ----------
    store
        Of the published recordings, extracted; with the tracker ``published`` if the numbers are to
        be the same.
    authors
        Folder that ``scripts/convert_authors_arrays.py`` wrote. Anything may be missing in it.
        Reading networks (Keras' HDF5) needs the extra ``hdf5``.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Comparison
        `differences` of each stage, what the authors' `networks` name rightly, and `sentences`.

    Raises
    ------
    InputError
        If the folder holds pickles or nothing to compare, a file is damaged or another's, or a
        recording is too short for the published cut.

    Examples
    --------
    >>> found = compare("published.zarr", "converted")  # doctest: +SKIP
    >>> found.differences[1].stage, found.differences[1].largest  # doctest: +SKIP
    ('SA-I', 1.9e-06)
    """
    from afferents.pipeline.authors.compare import compare as run

    with Progress(quiet) as progress:
        return run(Path(store), Path(authors), progress)
