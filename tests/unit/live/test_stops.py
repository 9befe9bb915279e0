"""A signal ends `live` as it ends any command, whoever else listens for it."""

import signal

import pytest

from .conftest import LIVE

pytestmark = pytest.mark.system


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("outlet", ["--json", "--web"])
def test_a_signal_ends_it(launch, models, session, outlet, number):
    command = ["live", "--model", models["sa-se"], outlet]
    source = ["--video", "rig"] if outlet == "--json" else ["--video", f"replay:{session}/1/20"]
    running = launch([*command, *source, "--port", "0"], imports=LIVE)
    begun, sign = (running.stdout, "{") if outlet == "--json" else (running.stderr, "Page: ")
    next(line for line in iter(begun.readline, "") if line.startswith(sign))
    running.send_signal(number)
    _, said = running.communicate(timeout=60)
    assert said.splitlines()[-1] == "afferents: stopped; what is finished is kept"
    assert "Warning" not in said
    assert running.returncode == 128 + number
