"""`reproduce` takes the options of its stages as these spell them."""

import pytest
import typer

from afferents.cli import app

COMMANDS = typer.main.get_command(app).commands
SET_BY_IT = {"--json", "--quiet", "--out"}


def flags(name):
    return {
        flag
        for parameter in COMMANDS[name].params
        for flag in (*parameter.opts, *parameter.secondary_opts)
        if flag.startswith("--")
    }


@pytest.mark.parametrize("stage", ["extract", "evaluate"])
def test_it_has_every_option_of(stage):
    assert flags(stage) - SET_BY_IT <= flags("reproduce")


def test_none_is_set_unless_it_is_given():
    own = {"out", "session", "like", "size", "estimate", "discrepancies", "as_json", "quiet"}
    others = [one for one in COMMANDS["reproduce"].params if one.name not in {*own, "help"}]
    assert len(others) > 25
    assert all(one.default is None for one in others)


def test_options_of_encodings_are_taken_too(run):
    code, printed, _ = run("reproduce", "--help")
    assert code == 0
    assert "--frames" in printed
    assert "--tracker" in printed
