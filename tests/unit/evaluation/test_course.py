"""How trainings went: best and first epochs of folds."""

from afferents.evaluation.fold_files import FoldFacts
from afferents.evaluation.schemas import FirstEpoch
from afferents.evaluation.summary import course_of

EPOCHS = [
    {"accuracy": 0.5, "validation_accuracy": 0.4},
    {"accuracy": 0.9, "validation_accuracy": 0.6},
]
FACTS = {
    "model": "sa-se", "protocol": "nested", "seconds": 1.0, "validation_mm_s": 20.0,
    "validation_accuracy": 0.6, "epochs": 2, "leaks": {},
}  # fmt: skip


def facts(speed, seed, **more):
    return FoldFacts(**FACTS, held_out_mm_s=speed, seed=seed, **more)


def test_best_and_first_epoch_by_speed_one_a_seed():
    folds = [facts(10.0, seed, best_epoch=2, history=EPOCHS) for seed in (0, 1)]
    found = course_of([*folds, facts(20.0, 0)])  # the last was solved at once
    assert found == {
        "best_epoch": {"10": (2, 2)},
        "first_epoch": {"10": (FirstEpoch(training=0.5, validation=0.4),) * 2},
    }
