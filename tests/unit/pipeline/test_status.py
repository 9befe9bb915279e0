"""What a run says of itself while it is at work."""

from afferents.core.files import write_json
from afferents.evaluation import FoldKey, at_work, plan
from afferents.pipeline.status import status

SHORT, LONG = (
    [FoldKey(model, "nested", 1, speed) for speed in (10.0, 20.0)] for model in ("vib-te", "ra-se")
)


def expected_end(results):
    return status(results).sentences[-1]


def test_an_expected_end_says_which_models_it_knows_nothing_of(tmp_path):
    plan(tmp_path, [*SHORT, *LONG], workers=1)
    with at_work(tmp_path, LONG[0]):
        assert "Expected end" not in expected_end(tmp_path)
        write_json(SHORT[0].folder(tmp_path) / "fold.json", {"seconds": 9.0})
        assert "taking ra-se (none ended yet) to be like the others" in expected_end(tmp_path)
        write_json(LONG[1].folder(tmp_path) / "fold.json", {"seconds": 900.0})
        assert "Expected end" in expected_end(tmp_path)
        assert "taking" not in expected_end(tmp_path)
