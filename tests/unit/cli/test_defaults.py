"""What commands take is what their functions take, read from the source of each."""

import inspect
import subprocess
from importlib import import_module
from importlib.metadata import version

import pytest

import afferents
from afferents.choices import PRESET_ASKED, Cut, Preset
from afferents.cli import show
from afferents.cli.command import Output
from afferents.cli.program import COMMANDS
from afferents.cli.signatures import REQUIRED, read_fields, read_signature
from afferents.evaluation.options import EvaluationOptions, TrainingOptions
from afferents.quality.issues import KINDS


def function_of(command):
    module, _, name = command.function.partition(":")
    return getattr(import_module(module), name)


@pytest.mark.parametrize("name", COMMANDS)
def test_arguments_and_defaults_are_those_of_the_function(name):
    read = {one.name: one.default for one in read_signature(COMMANDS[name].function).arguments}
    there = inspect.signature(function_of(COMMANDS[name])).parameters.values()
    defaults = {one.name: one.default for one in there if one.kind is not one.VAR_KEYWORD}
    computed = {
        name for name, default in defaults.items() if isinstance(default, (tuple, type(afferents)))
    }
    computed |= {name for name, default in defaults.items() if hasattr(default, "parts")}  # a path
    assert set(read) == set(defaults)
    assert {n: d for n, d in read.items() if n not in computed} == {
        n: REQUIRED if d is inspect.Parameter.empty else d
        for n, d in defaults.items()
        if n not in computed
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_every_argument_has_a_sentence_and_every_command_says_what_came_of_it(name):
    command = COMMANDS[name]
    assert [one.name for one in command.arguments.values() if not one.help.endswith(".")] == []
    if command.shows:
        assert callable(getattr(show, command.shows.partition(":")[2]))
    else:
        returned = inspect.signature(function_of(command)).return_annotation
        assert returned in (Output, None)
    assert set(command.shown) | set(command.several) | set(command.flags) <= set(command.arguments)


@pytest.mark.parametrize("model", [EvaluationOptions, TrainingOptions])
def test_fields_are_those_of_the_model(model):
    read = {one.name: one for one in read_fields(f"afferents.evaluation.options:{model.__name__}")}
    assert set(read) == set(model.model_fields)
    for name, field in model.model_fields.items():
        assert read[name].help == " ".join(field.description.partition("\n\n")[0].split())
    assert (read["preset"].kind, read["preset"].default) == (Preset, PRESET_ASKED)
    assert read["cut"].kind is Cut


def test_checks_that_may_be_accepted_are_listed(does):
    assert ", ".join(KINDS) in " ".join(does("extract", "--help").replace("│", " ").split())


def test_the_paper_s_models_and_what_we_recommend_are_evaluated_so_that_numbers_hold():
    options = EvaluationOptions()
    assert (options.models, options.preset) == ("best,all", "fast")
    assert inspect.signature(afferents.evaluate).parameters["models"].default == options.models


def test_the_version_is_the_one_that_is_installed(run):
    assert afferents.__version__ == version("afferents")
    assert run("--version") == (0, f"{afferents.__version__}\n", "")


def test_a_shell_completes_commands_and_options(does, monkeypatch, tmp_path):
    monkeypatch.setenv("SHELL", "/bin/bash")
    monkeypatch.setenv("HOME", str(tmp_path))
    does("--install-completion")
    script = next(
        path for path in tmp_path.rglob("*") if path.is_file() and "bashrc" not in path.name
    )
    words = "COMP_WORDS=(afferents extract --track); COMP_CWORD=2; COMP_LINE='afferents extract'"
    asked = f"source {script}; {words}; _afferents; echo ${{COMPREPLY[@]}}"
    done = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, check=False)
    assert "--tracker" in done.stdout, done.stderr
