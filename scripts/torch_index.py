"""Print where PyTorch's build for the CPU is, if it is wanted and pip would take another.

    PIP_EXTRA_INDEX_URL="$(python scripts/torch_index.py)" python -m pip install ...

On Linux, PyPI has PyTorch with CUDA: gigabytes that only an NVIDIA GPU needs.
"""

import json
import subprocess
import sys
from pathlib import Path
from shutil import which
from typing import Any

INDEX = "https://download.pytorch.org/whl/cpu"
"""PyTorch's own, public: pytorch.org/get-started/locally."""


def has_nvidia() -> bool:
    """Tell whether there is an NVIDIA device, or its program."""
    return Path("/dev/nvidia0").exists() or which("nvidia-smi") is not None


def asked_of_pip() -> dict[str, Any]:
    """Return what pip knows of the PyTorch that it would install."""
    constraints = Path(__file__).resolve().parents[1] / "constraints.txt"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--no-deps",
               "--ignore-installed", "--disable-pip-version-check", "--report", "-",
               "-c", str(constraints), "torch"]  # fmt: skip
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    reported = json.loads(found.stdout) if found.returncode == 0 else {"install": []}
    return reported["install"][0]["metadata"] if reported["install"] else {}


def with_cuda(metadata: dict[str, Any]) -> bool:
    """Tell whether a PyTorch draws NVIDIA's packages."""
    return any(
        str(line).startswith(("nvidia", "cuda")) for line in metadata.get("requires_dist", [])
    )


if __name__ == "__main__":
    if not has_nvidia() and with_cuda(asked_of_pip()):
        print(f"no NVIDIA device here: PyTorch for the CPU, from {INDEX}", file=sys.stderr)
        print(INDEX)
