import numpy as np
import pandas as pd
import pytest

from afferents.evaluation.metrics import accuracy_by_group, confusion, macro_f1


def table(rows):
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    return pd.DataFrame(rows, columns=names)


def test_by_hand():
    """Four samples at 10 mm/s, three right; two at 20 mm/s, one right."""
    predictions = table(
        [(10, "a/10", "a", "a"), (10, "a/10", "a", "a"), (10, "b/10", "b", "b"),
         (10, "b/10", "b", "a"), (20, "a/20", "a", "b"), (20, "b/20", "b", "b")]
    )  # fmt: skip
    assert accuracy_by_group(predictions) == {10.0: 0.75, 20.0: 0.5}
    np.testing.assert_array_equal(confusion(predictions, ["a", "b"]), [[2, 1], [1, 2]])
    assert macro_f1(predictions, ["a", "b"]) == pytest.approx(2 / 3)
