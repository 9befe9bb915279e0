"""What the docs show runs: examples of docstrings, of README and of the page on own models."""

import doctest
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WITH_EXAMPLES = sorted(
    path.relative_to(ROOT / "src").with_suffix("").as_posix().replace("/", ".")
    for path in (ROOT / "src").rglob("*.py")
    if ">>> " in path.read_text()
)


def python_in(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_examples_of_docstrings_say_what_comes_out(module):
    found = doctest.testmod(import_module(module))
    assert found.attempted > 0
    assert found.failed == 0


def test_the_base_classes_show_a_whole_one():
    assert {"afferents.channels.base", "afferents.encodings.base"} <= set(WITH_EXAMPLES)


def test_the_readme_s_example_runs(session):
    (example,) = python_in("README.md")
    names = {"path": session}
    exec(example, names)
    assert names["rapid"].attrs["units"] == "px/frame"
    assert float(names["rapid"][20:].max()) > 0


def test_the_models_of_the_page_are_evaluated(run, stores, tmp_path):
    (example,) = python_in("docs/own-models.md")
    (tmp_path / "my_models.py").write_text(example)
    models = ",".join(f"{tmp_path}/my_models.py:{name}" for name in ("logistic", "mlp"))
    code, out, err = run(
        "evaluate", stores["video"], "--out", tmp_path / "r", "--models", models,
        "--held-out", "40", "--workers", "1", "--quiet",
    )  # fmt: skip
    assert code == 0, err
    assert "logistic" in out
    assert "mlp" in out
