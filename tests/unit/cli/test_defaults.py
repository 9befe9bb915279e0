"""What a command does where nothing is said is the same in the shell and in Python."""

import inspect
from importlib.metadata import version

import pytest

import afferents
from afferents.cli import evaluation, models, neuro, recordings, reproduction, rig
from afferents.evaluation.options import EvaluationOptions

SHELL = {
    "report": evaluation.report,
    "train": models.train,
    "calibrate": recordings.calibrate,
    "extract": recordings.extract,
    "inspect": recordings.inspect,
    "simulate": rig.simulate,
    "neural": neuro.neural,
    "reproduce": reproduction.reproduce,
}
SAID_OTHERWISE = {
    "simulate": {"textures"},  # one text in the shell, letters in Python
    "extract": {"sensor"},
    "neural": {"classes"},
}


def defaults(function):
    return {
        name: parameter.default
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.default is not parameter.empty
    }


def plain(value):
    """Return a default as one may spell it: nothing given is None, an empty text or tuple."""
    return value if value or (value in (0, False) and not isinstance(value, str)) else None


@pytest.mark.parametrize("command", SHELL)
def test_defaults_are_the_same_in_the_shell_and_in_python(command):
    shell, python = defaults(SHELL[command]), defaults(getattr(afferents, command))
    both = set(shell) & set(python) - SAID_OTHERWISE.get(command, set())
    assert {n: plain(shell[n]) for n in both} == {n: plain(python[n]) for n in both}


def test_the_paper_s_models_and_what_we_recommend_are_evaluated_so_that_numbers_hold():
    options = EvaluationOptions()
    assert (options.models, options.preset) == ("best,all", "fast")
    assert defaults(afferents.evaluate)["models"] == options.models


def test_the_version_is_the_one_that_is_installed(run):
    assert afferents.__version__ == version("afferents")
    assert run("--version") == (0, f"{afferents.__version__}\n", "")
