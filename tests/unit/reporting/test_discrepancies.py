"""The list of discrepancies, and what of it remains in a reproduction."""

import re

from afferents.models.config import training_config
from afferents.reporting.published import (
    discrepancies,
    list_discrepancies,
    remaining_discrepancies,
)


def test_epochs_of_fast_are_those_of_the_code():
    images, runs, spectra = (
        training_config("fast", name) for name in ("spatial-net", "cnn-lstm", "vibration-net")
    )
    demo = 13 * 8 * 12  # drums, speeds learnt from, windows of 1 s in 6.5 s
    stretched = min(7 * demo, spectra.training_samples)  # originals and six copies
    said = (
        f"`fast`: {images.epochs(images.training_samples)} epoch of single images, "
        f"{runs.epochs(runs.training_samples)} of runs of images; of spectra as many as make "
        f"{spectra.passes:,} samples, at most {spectra.max_epochs} (in the demo "
        f"{spectra.epochs(demo)} of plain and {spectra.epochs(stretched)} of stretched spectra)."
    )
    assert f"recommended: {said}\n" in discrepancies()


def test_what_remains_is_said_with_its_number():
    page = discrepancies()
    listed = list_discrepancies()
    numbers = [int(n) for n in re.findall(r"^(\d+)\. \*\*", page, re.M)]
    assert numbers == list(range(1, len(listed) + 1))
    assert sum(len(one.sides) for one in listed) == page.count("\n    - ")
    of_code = [said for said in remaining_discrepancies() if re.match(r"\d+\. [A-Z]", said)]
    assert len(of_code) == page.count("still different: ") > 5
    assert len(remaining_discrepancies()) > len(of_code), "and of other software"
