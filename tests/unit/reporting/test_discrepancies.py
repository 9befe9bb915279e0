"""The list of discrepancies, and what of it remains in a reproduction."""

import re

from afferents.reporting.published import discrepancies, remaining_discrepancies


def test_what_remains_is_said_with_its_number():
    page = discrepancies()
    assert [int(n) for n in re.findall(r"^(\d+)\. \*\*", page, re.M)] == list(range(1, 45))
    remaining = remaining_discrepancies()
    of_code = [said for said in remaining if said[0].isdigit()]
    assert len(of_code) == page.count("still different: ") > 5
    assert all(re.match(r"\d+\. [A-Z]", said) for said in of_code)
    of_software = remaining[len(of_code) :]
    assert of_software[0].startswith("PyTorch instead of Keras on TensorFlow 1: The same layers")
    assert len(of_software) == 6
