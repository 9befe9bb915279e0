"""What a run says of itself while it is at work."""

from afferents.errors import AfferentsError
from afferents.evaluation.fold_files import FoldKey
from afferents.evaluation.job_status import at_work, plan
from afferents.files import write_json
from afferents.models import fitting
from afferents.reproduction.run_folder import status

SHORT, LONG = (
    [FoldKey.of(model, "nested", 1, speed) for speed in (10.0, 20.0)]
    for model in ("vib-te", "ra-se")
)


def finish(results, key, seconds):
    facts = {"validation_mm_s": 30.0, "validation_accuracy": 0.5, "epochs": 3, "leaks": {}}
    content = {**key.content(), **facts, "seconds": seconds}
    write_json(key.folder(results) / "fold.json", content)


def expected_end(results):
    return status(results).sentences[-1]


def test_an_expected_end_says_which_models_it_knows_nothing_of(tmp_path):
    plan(tmp_path, [*SHORT, *LONG], workers=1)
    with at_work(tmp_path, LONG[0]):
        assert "Expected end" not in expected_end(tmp_path)
        finish(tmp_path, SHORT[0], 9.0)
        assert "taking ra-se (none ended yet) to be like the others" in expected_end(tmp_path)
        finish(tmp_path, LONG[1], 900.0)
        assert "Expected end" in expected_end(tmp_path)
        assert "taking" not in expected_end(tmp_path)


def test_what_workers_elsewhere_do_is_not_called_nothing(tmp_path):
    plan(tmp_path, SHORT, workers=2)
    assert "Nothing is running" in status(tmp_path).sentences[-1]
    plan(tmp_path, SHORT, workers=2, cluster="tcp://there:1")
    said = " ".join(status(tmp_path).sentences)
    assert "Workers at tcp://there:1 that don't see this folder leave no mark" in said
    assert "Nothing is running" not in said


def test_what_failed_is_named_once(run, stores, tmp_path, monkeypatch):
    def fail(*_):
        raise AfferentsError("no luck")

    learning_set = fitting.learning_set
    monkeypatch.setattr(fitting, "learning_set", fail)
    asked = ("--models", "vib-te", "--workers", 1, "--quiet")
    code, _, error = run("evaluate", stores["audio"], "--out", tmp_path / "r", *asked)
    key = "vib-te, nested, seed 0, 20 mm/s held out"
    assert (code, error) == (2, f"afferents: {key}: no luck\n")
    assert f"Failed: {key}: no luck" in status(tmp_path / "r").sentences

    monkeypatch.setattr(
        fitting, "learning_set", lambda *a: fail() if a[4].held_out == 20 else learning_set(*a)
    )
    assert run("evaluate", stores["audio"], "--out", tmp_path / "r", *asked)[0] == 2
    done = [n for n in range(30, 100) if (tmp_path / f"r/folds/vib-te/nested/seed-0/{n}").is_dir()]
    assert done == [30, 40, 60], "what failed comes last, so all else is done"
