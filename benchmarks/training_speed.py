"""Training samples a second of the three networks, in the loop that `evaluate` uses.

    python benchmarks/training_speed.py [--threads 2] [--repeats 3]

Random samples of the published shapes, 13 textures, batches of 64: shuffling, gathering,
forward, backward, Adam and the epoch's bookkeeping; validation is one batch. The precisions take
turns, so that what else the machine does falls on both. Prints a table in Markdown.
"""

import argparse
import platform
import statistics
from pathlib import Path

import numpy as np
import torch

from afferents.core.families import Encoding
from afferents.models import build
from afferents.training import TrainingConfig, train
from afferents.training.config import Precision
from afferents.training.hardware import has_bfloat16

BATCH, TEXTURES = 64, 13
CASES: list[tuple[str, Encoding, tuple[int, ...], int]] = [
    ("SpatialNet", "spatial", (19, 19), 10),
    ("CnnLstm", "spatiotemporal", (10, 19, 19), 2),
    ("VibrationNet", "spectral", (1, 200), 10),
]
PRECISIONS: tuple[Precision, ...] = ("float32", "bfloat16")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--threads", type=int, default=torch.get_num_threads())
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    print(f"{machine()}\n\nMedian of {arguments.repeats} (lowest to highest), samples/s.\n")
    print("| network | float32 | bfloat16 |\n|---|---|---|")
    for name, encoding, shape, steps in CASES:
        rates: dict[Precision, list[float]] = {precision: [] for precision in PRECISIONS}
        for _ in range(arguments.repeats):
            for precision in PRECISIONS:
                rates[precision].append(samples_a_second(encoding, shape, steps, precision))
        cells = (f"{statistics.median(r):.0f} ({min(r):.0f}-{max(r):.0f})" for r in rates.values())
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def samples_a_second(
    encoding: Encoding, shape: tuple[int, ...], steps: int, precision: Precision
) -> float:
    """Train two epochs of `steps` batches and return the second's rate."""
    n = BATCH * steps
    values = torch.randn(n + BATCH, *shape)
    labels = torch.randint(TEXTURES, (n + BATCH,))
    config = TrainingConfig(
        learning_rate=1e-3, batch_size=BATCH, patience=2, max_epochs=2, precision=precision
    )
    model = build(encoding, TEXTURES, shape)
    training, validation = np.arange(n), np.arange(n, n + BATCH)
    trained = train(model, values, labels, training, validation, 1.0, config, seed=0)
    return n / trained.history[-1].seconds


def machine() -> str:
    """Name processor or GPU, cores, threads and versions."""
    if torch.cuda.is_available():
        device, native = torch.cuda.get_device_name(), has_bfloat16(torch.device("cuda"))
    else:
        device, native = processor(), has_bfloat16(torch.device("cpu"))
    return (
        f"{device}, {torch.get_num_threads()} threads, PyTorch {torch.__version__}, "
        f"Python {platform.python_version()}, bfloat16 {'native' if native else 'emulated'}"
    )


def processor() -> str:
    """Return the processor's name as the system gives it."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]} ({len(names)} cores)" if names else platform.processor()


if __name__ == "__main__":
    main()
