import json
import subprocess
import sys

import pytest

pytestmark = pytest.mark.system


def test_devices_are_listed_whatever_is_there():
    done = subprocess.run(
        [sys.executable, "-m", "afferents", "devices", "--json"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert set(found) == {"cameras", "microphones", "ports", "drives", "notes"}
    assert "serial (odrive)" in found["drives"]
    shown = subprocess.run(
        [sys.executable, "-m", "afferents", "devices"], capture_output=True, text=True
    )
    assert shown.returncode == 0, shown.stderr
    assert "serial (odrive)" in shown.stdout
