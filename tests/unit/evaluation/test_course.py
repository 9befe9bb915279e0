"""How trainings went: best and first epochs of folds, also of those that an old summary left."""

import json

from afferents.evaluation.fold_files import course_of, read_course
from afferents.folds.held_out import SPEED

EPOCHS = [
    {"accuracy": 0.5, "validation_accuracy": 0.4},
    {"accuracy": 0.9, "validation_accuracy": 0.6},
]
FACTS = {
    "model": "sa-se", "protocol": "nested", "seconds": 1.0, "validation_mm_s": 20.0,
    "validation_accuracy": 0.6, "epochs": 2, "leaks": {},
}  # fmt: skip


def facts(speed, seed, **more):
    return {**FACTS, "held_out_mm_s": speed, "seed": seed, **more}


def test_best_and_first_epoch_by_speed_one_a_seed():
    folds = [facts(10.0, seed, best_epoch=2, history=EPOCHS) for seed in (0, 1)]
    found = course_of([*folds, facts(20.0, 0)], SPEED)  # the last was solved at once
    assert found == {
        "best_epoch": {"10": [2, 2]},
        "first_epoch": {"10": [{"training": 0.5, "validation": 0.4}] * 2},
    }


def test_what_folds_still_say_is_read(tmp_path):
    for speed in (10.0, 20.0):
        folder = tmp_path / f"folds/sa-se/nested/seed-0/{speed:g}"
        folder.mkdir(parents=True)
        content = facts(speed, 0, best_epoch=1, history=EPOCHS)
        (folder / "fold.json").write_text(json.dumps(content))
    (tmp_path / "folds/sa-se/nested/seed-0/20/fold.json").write_text("{")
    found = read_course(tmp_path, "sa-se", "nested", [0], [10.0, 20.0, 40.0], SPEED)
    assert found["best_epoch"] == {"10": [1]}
