import os
import subprocess
import sys

import pytest

ASK = "import afferents, os; r = afferents.example(quiet=True); print(os.stat(r.store).st_ino)"


@pytest.fixture(scope="session")
def example_asked_twice(tmp_path_factory):
    """The folder of the example, and what two processes found there that asked for it at once."""
    folder = tmp_path_factory.mktemp("cache")
    environment = {**os.environ, "AFFERENTS_CACHE": str(folder)}
    given = {"env": environment, "stdout": subprocess.PIPE, "text": True}
    asking = [subprocess.Popen([sys.executable, "-c", ASK], **given) for _ in range(2)]
    return folder, [process.communicate()[0] for process in asking]


@pytest.fixture
def example_cache(example_asked_twice, monkeypatch):
    """The folder of the example, where it is looked for."""
    folder, _ = example_asked_twice
    monkeypatch.setenv("AFFERENTS_CACHE", str(folder))
    return folder
