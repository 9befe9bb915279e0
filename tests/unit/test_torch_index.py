"""Which PyTorch `make install` takes: the build for the CPU, unless there is an NVIDIA device."""

import runpy
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

SCRIPT = str(Path(__file__).resolve().parents[2] / "scripts/torch_index.py")
CUDA = '{"install": [{"metadata": {"requires_dist": ["nvidia-cublas-cu12==12.8"]}}]}'
CPU = '{"install": [{"metadata": {"requires_dist": ["numpy"]}}]}'


@pytest.mark.parametrize(
    ("offered", "program", "said"),
    [
        (CUDA, None, "https://download.pytorch.org/whl/cpu\n"),
        (CPU, None, ""),
        (CUDA, "/usr/bin/nvidia-smi", ""),
        ('{"install": []}', None, ""),
    ],
)
def test_the_cpus_build_is_named_where_pip_would_take_cuda(
    offered, program, said, monkeypatch, capsys
):
    monkeypatch.setattr("shutil.which", lambda name: program)
    monkeypatch.setattr(
        subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=0, stdout=offered)
    )
    monkeypatch.setattr(Path, "exists", lambda path: False)
    runpy.run_path(SCRIPT, run_name="__main__")
    assert capsys.readouterr().out == said
