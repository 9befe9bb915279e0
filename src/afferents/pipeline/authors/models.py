"""Samples of the paper's models and what their networks say, ours and the authors'."""

from afferents.core import dims
from afferents.core.model import Model
from afferents.pipeline.authors.difference import Difference
from afferents.pipeline.authors.folder import AuthorsFolder
from afferents.pipeline.authors.networks import Asked, ask
from afferents.pipeline.authors.samples import TestSets

_KINDS = {
    dims.SA1: ("images of SA-I", dims.PIXELS),
    dims.RA1: ("images of RA-I", "px/frame"),
    dims.RA2: ("spectra", "of the largest"),
}
_OUTPUTS = "probability"


class ModelDifferences:
    """Differences of one model over held-out speeds.

    Attributes
    ----------
    samples
        Of the test sets.
    computed
        Of a network's outputs as Keras and as we compute them, both of the authors' samples.
    outputs
        Of a network's outputs, all computed here: of the authors' samples and of ours.
    networks
        What each network names rightly.
    """

    def __init__(self, model: Model) -> None:
        """Begin with none."""
        self.model = model
        kind, unit = _KINDS[model.channel]
        self.samples = Difference(f"{model.title}: {kind}", unit)
        self.computed = Difference(f"{model.title}: network, by Keras and here", _OUTPUTS)
        self.outputs = Difference(f"{model.title}: network, of our samples", _OUTPUTS)
        self.networks: list[Asked] = []

    def add(self, speed_mm_s: float, folder: AuthorsFolder, sets: TestSets) -> None:
        """Compare what there is of a held-out speed.

        Raises
        ------
        InputError
            If a file is damaged or another's, or a recording too short for the published cut.
        """
        where = f"{speed_mm_s:g} mm/s"
        theirs = sets.theirs(self.model, speed_mm_s)
        if theirs is None and folder.network(self.model.name, speed_mm_s) is None:
            return
        ours = sets.ours(self.model, speed_mm_s, theirs)
        if theirs is not None and ours is not None:
            self.samples.add(ours, theirs, where)
        if (asked := ask(self.model, speed_mm_s, folder, sets, theirs, ours)) is None:
            return
        about, said = asked
        self.networks.append(about)
        if said.theirs is not None and said.keras is not None:
            self.computed.add(said.theirs, said.keras, where)
        if said.theirs is not None and said.ours is not None:
            self.outputs.add(said.ours, said.theirs, where)
