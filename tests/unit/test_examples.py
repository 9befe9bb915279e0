"""What the docs show runs: examples of docstrings and of the pages on own models and on Python."""

import doctest
import re
import shutil
from importlib import import_module
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor
from matplotlib import pyplot

import afferents
from afferents.rig.simulation import make_simulation

pytestmark = pytest.mark.system

ROOT = Path(__file__).resolve().parents[2]
WITH_EXAMPLES = sorted(
    path.relative_to(ROOT / "src").with_suffix("").as_posix().replace("/", ".")
    for path in (ROOT / "src").rglob("*.py")
    if ">>> " in path.read_text()
)
COMMANDS = {"example", "fetch", "init_session", "record", "import_recording", "calibrate", "track"}
COMMANDS |= {"simulate", "extract", "evaluate", "report", "reproduce", "train", "export", "view"}
COMMANDS |= {"export_lerobot", "export_mcap", "export_nwb", "explain", "inspect", "samples"}
COMMANDS |= {"load_model", "neural", "stream"}
"""Their examples need what other commands have written."""


def python_in(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_docstrings_say_what_comes_out(module, request):
    if module == "afferents.examples":
        request.getfixturevalue("example_cache")
    examples = doctest.DocTestFinder().find(import_module(module))
    runner = doctest.DocTestRunner()
    for example in examples:
        if example.name.rpartition(".")[2] not in COMMANDS - {"example"}:
            runner.run(example)
    assert examples
    assert runner.failures == 0


def test_examples_of_the_commands_say_what_comes_out(session, tmp_path, monkeypatch):
    """In the order of the way of the data: one goes on with what another has written."""
    monkeypatch.chdir(tmp_path)
    get_reusable_executor().shutdown()  # processes of an earlier test are in its folder still
    shutil.copytree(session, "session")
    shutil.copytree(session / "1/20", "clips")
    names = {name: getattr(afferents, name) for name in afferents.__all__}
    failed = []
    finder = doctest.DocTestFinder(recurse=False)
    shown = ["simulate", "init_session", "calibrate", "track", "stream", "extract", "inspect"]
    shown += ["samples", "evaluate", "report", "train", "load_model", "explain", "export"]
    shown += ["export_nwb"]
    for name in shown:
        (example,) = finder.find(names[name], name, module=False, globs=names)
        found = doctest.DocTestRunner().run(example, clear_globs=False)
        assert found.attempted > 0, name
        failed += [name] * bool(found.failed)
    assert failed == []


def test_the_models_of_the_page_are_evaluated(does, stores, tmp_path):
    (tmp_path / "my_models.py").write_text("\n".join(python_in("docs/own-models.md")))
    names = ("logistic", "mlp", "series", "shears")
    models = ",".join(f"{tmp_path}/my_models.py:{name}" for name in names)
    out = does(
        "evaluate", stores["video"], "--out", tmp_path / "r", "--models", models,
        "--held-out", "40", "--window-s", "0.25", "--workers", "1", "--quiet",
    )  # fmt: skip
    assert all(name in out for name in names)


def test_the_page_on_python_runs_from_top_to_bottom(
    example_cache, session, tmp_path, monkeypatch, capsys
):
    """With a session that is there already in place of the one that it simulates."""
    asked = []

    def simulate(folder, **options):
        asked.append(make_simulation(Path(folder), "quick", **options))
        shutil.copytree(session, folder)

    monkeypatch.setattr(afferents, "simulate", simulate)
    monkeypatch.chdir(tmp_path)
    get_reusable_executor().shutdown()  # processes of an earlier test are in its folder still
    names = {}
    for example in python_in("docs/python.md"):
        exec(example, names)
    assert len(asked[0].names) == 6
    assert (tmp_path / "responses.png").stat().st_size > 10_000
    assert (tmp_path / "results" / "report.html").is_file()
    assert names["card"].title == "logistic regression on RA-I"
    assert "can't be exported or run live" in capsys.readouterr().out
    pyplot.close("all")
