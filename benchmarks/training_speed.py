"""Training samples a second of the three networks, in the loop that `evaluate` uses.

    python benchmarks/training_speed.py [--repeats 3]

Random samples of the published shapes, 13 textures, batches of 64: shuffling, gathering, forward,
backward, Adam, and after every epoch a validation on an eighth as many samples. As `evaluate`
does, as many processes of one thread as there are cores train a fold each; their rates are added
up. Prints a table in Markdown.
"""

import argparse
import platform
import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from joblib import cpu_count

from afferents.choices import Precision
from afferents.doctor import processor
from afferents.models.classifiers import build
from afferents.models.config import TrainingConfig
from afferents.models.hardware import has_bfloat16, use_channels_last
from afferents.models.layers import l2_penalty
from afferents.models.learning_set import LearningSet
from afferents.models.loop import train
from afferents.parallel import keep_freed_memory, side_by_side

BATCH, TEXTURES, EPOCHS = 64, 13, 4


class Case(NamedTuple):
    """A network, the shape of its samples, and batches an epoch."""

    network: str
    encoding: str
    shape: tuple[int, ...]
    batches: int


CASES = [
    Case("SpatialNet", "spatial-net", (19, 19), 40),
    Case("CnnLstm", "cnn-lstm", (10, 19, 19), 6),
    Case("VibrationNet", "vibration-net", (1, 200), 60),
]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    precision: Precision = "bfloat16" if has_bfloat16(device()) else "float32"
    print(f"{machine()}, {precision}\n\nMedian of {arguments.repeats}.\n")
    print(
        "| network | one process, samples/s | a process a core, samples/s | times one "
        "| loop over bare step |\n" + "|---" * 5 + "|"
    )
    for case in CASES:
        rates = defaultdict(list)
        for _ in range(arguments.repeats):
            rates["one"].append(side_by_side_rate(case, precision, 1))
            rates["all"].append(side_by_side_rate(case, precision, cpu_count()))
            for name, rate in bare_rates(case, precision).items():
                rates[name].append(rate)
        median = {name: statistics.median(each) for name, each in rates.items()}
        print(
            f"| {case.network} | {median['one']:.0f} | {median['all']:.0f} "
            f"| {median['all'] / median['one']:.2f} | {median['step'] / median['loop']:.2f} |",
            flush=True,
        )


def side_by_side_rate(case: Case, precision: Precision, workers: int) -> float:
    """Train as many folds at once as there are workers; return their samples a second, summed."""
    # One worker more than jobs: with a single one `side_by_side` stays in this process.
    jobs = [(case, precision)] * workers
    return sum(side_by_side(loop_rate, jobs, max(2, workers)))


def loop_rate(case: Case, precision: Precision, n_validation: int | None = None) -> float:
    """Train a few epochs in this process; return the samples a second of all but the first.

    Validates on an eighth as many samples as it trains on, or on `n_validation`.
    """
    keep_freed_memory()  # as every training of an evaluation does
    torch.set_num_threads(1)
    n = BATCH * case.batches
    n_validation = n_validation or n // 8
    values = torch.randn(n + n_validation, *case.shape)
    labels = torch.randint(TEXTURES, (n + n_validation,))
    config = TrainingConfig(
        learning_rate=1e-3, batch_size=BATCH, patience=EPOCHS, max_epochs=EPOCHS,
        precision=precision,
    )  # fmt: skip
    model = build(case.encoding, TEXTURES, case.shape)
    training, validation = np.arange(n), np.arange(n, n + n_validation)
    trained = train(model, LearningSet(values, labels, training, validation), config, seed=0)
    return n / statistics.median(epoch.seconds for epoch in trained.epochs[1:])


def bare_rates(case: Case, precision: Precision) -> dict[str, float]:
    """Return samples a second of one process: bare steps, and the loop."""
    return next(side_by_side(bare_rates_here, [(case, precision)], 2))


def bare_rates_here(case: Case, precision: Precision) -> dict[str, float]:
    """Do so in this process.

    A bare step is forward, backward and Adam on one batch that lies ready. The loop is timed
    without its validation.
    """
    torch.set_num_threads(1)
    where = device()
    model = use_channels_last(build(case.encoding, TEXTURES, case.shape).to(where))
    optimiser = torch.optim.Adam(
        [p for p in model.parameters() if p.requires_grad], eps=1e-7, fused=True
    )
    batch = torch.randn(BATCH, *case.shape, device=where)
    labels = torch.randint(TEXTURES, (BATCH,), device=where)

    def step() -> None:
        with torch.autocast(where.type, dtype=torch.bfloat16, enabled=precision == "bfloat16"):
            logits = model(batch)
        loss = F.cross_entropy(logits.float(), labels) + l2_penalty(model)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()

    return {
        "step": BATCH / seconds_of(step, case.batches),
        "loop": loop_rate(case, precision, n_validation=1),
    }


def seconds_of(action: Callable[[], object], times: int) -> float:
    """Return the mean seconds of an action, after one call that does not count."""
    action()
    synchronise()
    start = time.perf_counter()
    for _ in range(times):
        action()
    synchronise()
    return (time.perf_counter() - start) / times


def synchronise() -> None:
    """Wait for the GPU, where there is one."""
    if torch.cuda.is_available():
        torch.cuda.synchronize()


def device() -> torch.device:
    """Return the GPU where there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def machine() -> str:
    """Name processor or GPU, cores and versions."""
    name = torch.cuda.get_device_name() if torch.cuda.is_available() else processor()
    return f"{name}, PyTorch {torch.__version__}, Python {platform.python_version()}"


if __name__ == "__main__":
    main()
