"""How sure a model may seem live: no surer than it was found to be right."""

import io
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from afferents.live.network import Outcome
from afferents.live.prediction import Counters
from afferents.live.quality import AudioQuality
from afferents.live.reporters import ModelReporter, limit_confidence
from afferents.live.terminal import Screen
from afferents.models.calibrate import best_evidence, interval_of


@given(weights=st.lists(st.floats(0.001, 100), min_size=2, max_size=13), most=st.floats(0.51, 1))
def test_probabilities_are_capped_in_their_order(weights, most):
    given = np.array(weights) / sum(weights)
    capped = limit_confidence(given, most)
    assert capped.max() <= most + 1e-9
    assert capped.sum() == pytest.approx(1)
    order = np.argsort(given)
    assert (np.diff(capped[order]) >= -1e-12).all()


@pytest.mark.parametrize(("most", "sure"), [(0.8, False), (0.97, True)])
def test_a_touch_is_no_surer_however_long_it_lasts(most, sure):
    """Of two textures each sample says 96%; after a second the sum of them says all but 100."""
    card = SimpleNamespace(model="m", textures=("a", "b"), evidence_per_s=10.0, most_sure=most)
    says = Outcome(np.array([0.96, 0.04], np.float32), 0.0)
    network = SimpleNamespace(card=card, predict=lambda _: says)
    reporter = ModelReporter(network, Counters(), AudioQuality(44100))
    predictions = [reporter.report(np.zeros(1, np.float32), 0.1 * n, 0.1, 0.0) for n in range(30)]
    assert max(p.evidence["a"] for p in predictions) == pytest.approx(most)
    assert (predictions[-1].sure_after_s is not None) == sure
    screen = Screen(SimpleNamespace(reporters=[("audio", reporter)]))
    shown = Console(file=io.StringIO(), width=80)
    screen.take(predictions[-1])
    shown.print(screen.draw(shown))
    assert f"{100 * min(most, 0.96):.0f}% now" in shown.file.getvalue()


def test_the_interval_is_wilson_s():
    assert interval_of(0.5, 13) == pytest.approx((0.2612, 0.7388), abs=1e-3)  # by hand
    assert interval_of(1.0, 13)[1] == pytest.approx(1.0)
    assert interval_of(0.0, 13)[1] < 0.25


def test_evidence_that_is_sure_and_wrong_is_found_out():
    """Two textures; all samples of a recording say the same, in half of them what is wrong."""
    labels = np.repeat([0, 1, 0, 1], 50)
    says = np.repeat([0, 1, 1, 0], 50)
    probabilities = np.where(np.eye(2)[says] > 0, 0.99, 0.01)
    recording = np.repeat(["a", "b", "c", "d"], 50)
    _, right = best_evidence(probabilities, labels, recording, np.tile(np.arange(50) / 90, 4))
    assert right in (0.5, 1.0)  # 1 where so little evidence is taken that nothing is ever sure
    _, alone = best_evidence(
        np.where(np.eye(2)[labels] > 0, 0.99, 0.01), labels, recording,
        np.tile(np.arange(50) / 90, 4),
    )  # fmt: skip
    assert alone == 1.0
