"""Condense the published figures that the report carries: `condense_published.py FOLDER`.

It was run once, at commit 5bcff185 or before; what it wrote is part of the package.

FOLDER holds `results.json` and `confusion.json`, digitised from the paper's notebook. What is
written to `src/afferents/reporting/published` is Table 1, of every held-out speed the accuracy and
how the training went, and the confusion matrices averaged over speeds.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

TARGET = Path(__file__).resolve().parents[1] / "src/afferents/reporting/published"
NAMES = {
    "SA-SE": "sa-se",
    "RA-SE": "ra-se",
    "SA-STE": "sa-ste",
    "RA-STE": "ra-ste",
    "vib-TE": "vib-te",
    "vib-TE-aug": "vib-te-aug",
}
SOURCE = {
    "paper": "Pestell & Lepora 2022, Artificial SA-I, RA-I and RA-II/Vibrotactile Afferents for "
    "Tactile Sensing of Texture, J. R. Soc. Interface, Table 1 and Figures 9, 11 and 13",
    "code": "nlepora/afferents-tactile-textures-jrsi2022, commit 880f9e4, figures.ipynb",
    "protocol": "published: the other half of the held-out speed picked the model",
}


def condense_accuracy(family: dict[str, Any]) -> dict[str, Any]:
    """Return Table 1's mean, and of every held-out speed the accuracy, percent, and training."""
    return {
        "figure": family["figure"],
        "table1_percent": family["table1_mean_percent"],
        "by_speed": {
            str(fold["held_out_speed"]): {
                "title_percent": fold["title_accuracy_percent"],
                "digitised_percent": round(fold["digitised_test_accuracy_percent"], 1),
                "best_epoch": fold["best_epoch"],
                "first_training_percent": round(100 * fold["train_accuracy_epoch1"], 2),
                "first_validation_percent": round(100 * fold["val_accuracy_epoch1"], 2),
            }
            for fold in family["folds"]
        },
    }


def condense_confusion(family: dict[str, Any]) -> list[list[float]]:
    """Return percent[true][predicted], the mean over held-out speeds of equal test size."""
    predicted_by_true = np.mean([fold["percent"] for fold in family["models"].values()], axis=0)
    return [[round(float(value), 2) for value in row] for row in predicted_by_true.T]


def write(name: str, content: dict[str, Any]) -> None:
    """Write one file with its source in front."""
    text = json.dumps({"source": SOURCE, **content}, indent=1)
    (TARGET / name).write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Read the folder given and write the two condensed files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    confusion = json.loads((folder / "confusion.json").read_text(encoding="utf-8"))
    write(
        "accuracy.json",
        {
            "fields": "title_percent: integer printed above the matrix; digitised_percent: from "
            "the colours of the matrix; best_epoch, first_training_percent and "
            "first_validation_percent: from the training logs in the notebooks, the epoch whose "
            "weights were kept, and accuracies of the first epoch",
            "families": {ours: condense_accuracy(results[name]) for name, ours in NAMES.items()},
        },
    )
    write(
        "confusion.json",
        {
            "orientation": "percent[true][predicted]: every row sums to 100; mean over the ten "
            "held-out speeds; true percentages, also for Figure 13",
            "textures": [f"{index / 2:g}" for index in range(13)],
            "families": {ours: condense_confusion(confusion[name]) for name, ours in NAMES.items()},
        },
    )
    print(*sorted(TARGET.glob("*.json")), sep="\n")


if __name__ == "__main__":
    main()
