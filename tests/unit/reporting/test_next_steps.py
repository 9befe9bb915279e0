"""The report's next steps are commands that run on the data that it is of."""

import shlex

from afferents.evaluation.results import read_summary
from afferents.reporting.summary_text import next_steps


def test_what_is_printed_is_run(stores, tmp_path, run, monkeypatch):
    """All but `live`, which needs the camera; the results are made better than chance."""
    monkeypatch.chdir(tmp_path)
    command = ("evaluate", stores["video"], "--out", "R", "--models", "sa-wave-vector")
    assert run(*command, "--workers", 1, "--quiet")[0] == 0
    summary = read_summary(tmp_path / "R")
    assert next_steps(summary) == []  # the textures of these videos are all the same
    found = summary.models["sa-wave-vector"]["nested"]
    better = found.model_copy(update={"mean_accuracy": 0.9, "ci95": (0.8, 1.0)})
    summary = summary.model_copy(update={"models": {"sa-wave-vector": {"nested": better}}})
    lines = [line for step in next_steps(summary) for line in step.command.splitlines()]
    assert [line.split()[1] for line in lines] == ["train", "export", "live"]
    for line in lines[:-1]:
        code, said, failed = run(*shlex.split(line)[1:])
        assert code == 0, f"{line}: {failed}"
        assert "Nothing was learnt that can be told from guessing (33.3%)" in said
    assert (tmp_path / "model.onnx").is_file()
