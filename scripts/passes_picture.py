"""Draw accuracy against samples gone forward and backward, of `fast` and `paper`, from kept counts.

    python scripts/passes_picture.py docs/counts/rig-fast.jsonl docs/counts/rig-paper.jsonl OUT.png

Lines: accuracy at the validation's speed after each epoch, each fold's best so far, mean over the
folds that both have; a fold that has ended keeps its best. A dot: accuracy at the held-out speed of
the weights that were kept, at the mean of all passes. Where a network is trained in stages, the
passes of its first stage come before the first epoch.
"""

import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from count_folds import Line, accuracy_of, in_both, read, those_of
from matplotlib.axes import Axes
from numpy.typing import NDArray

from afferents.models.model import MODELS, TABLE1
from afferents.reporting.style import BLUE, VERMILION, styled


@styled
def main(fast: Path, paper: Path, out: Path) -> None:
    """Draw a panel for each model under the nested protocol."""
    of_fast, of_paper = in_both(read(fast), read(paper))
    models = [model for model in TABLE1 if those_of(of_paper, model, "nested")]
    figure, axes = plt.subplots(
        2, 3, figsize=(8, 4.4), layout="constrained", sharex=True, sharey=True
    )
    for axis, model in zip(axes.flat, models, strict=False):
        draw(axis, those_of(of_paper, model, "nested"), color=BLUE, label="paper")
        draw(axis, those_of(of_fast, model, "nested"), color=VERMILION, label="fast")
        axis.set_title(MODELS[model].title, loc="left")
    axes.flat[0].set(xscale="log", ylim=(0, 100))
    axes.flat[0].legend(loc="lower right")
    figure.supxlabel("samples gone forward and backward, a fold", fontsize=8.5)
    figure.supylabel("accuracy, %", fontsize=8.5)
    figure.savefig(out, dpi=130)


def draw(axis: Axes, folds: list[Line], **style: Any) -> None:
    """Draw the folds of a model and a recipe."""
    epochs = max(len(fold["validation"]) for fold in folds)
    best = np.mean([best_so_far(fold, epochs) for fold in folds], axis=0)
    axis.plot(passes_after(folds, epochs), 100 * best, **style)
    whole = np.mean([fold["passes"] for fold in folds])
    axis.plot(whole, 100 * accuracy_of(folds).mean(), "o", color=style["color"])


def best_so_far(fold: Line, epochs: int) -> NDArray[np.float64]:
    """Return the best validation accuracy after each epoch, held where the fold has ended."""
    best = np.maximum.accumulate(fold["validation"])
    return np.pad(best, (0, epochs - len(best)), mode="edge")


def passes_after(folds: list[Line], epochs: int) -> NDArray[np.float64]:
    """Return how many passes a fold has made after each epoch, on average."""
    of_epoch = np.mean([fold["n_train"] for fold in folds])
    before = np.mean([f["passes"] - f["n_train"] * f["epochs"] for f in folds])
    return np.asarray(before + of_epoch * np.arange(1, epochs + 1))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
