"""Regenerate the golden path: python tests/golden/make_path.py

A small session goes the whole way: simulated, extracted, split, learnt from, tested, reported,
exported and felt live; numbers of every step are kept. It goes by commands and public functions
alone, so that the package may be rebuilt behind them. Run it only when a change is meant to change
the numbers, and say in the commit why.
"""

import hashlib
import io
import json
import os
import re
import sys
import tempfile
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import onnxruntime
import pandas as pd
import xarray as xr

import afferents
from afferents import cli

KEPT = Path(__file__).with_name("path.json")
TEXTURES, SPEEDS, HELD_OUT = ("0", "1.5", "5"), (20, 40, 70), 40
NETWORK, SOLVED = "sa-se", "ra-wave-vector"
RECIPE = "max_epochs = 1\nlearning_rate = 1e-4\n"
"""One short pass, so that what other processors round differently grows little."""
TOLD = ("ONEDNN_", "ATEN_", "MKL_", "OMP_", "OPENBLAS_", "NPY_", "NUMBA_", "OPENCV_")
"""Names of variables by which libraries are told how to compute begin so."""
ENCODED = {NETWORK: ("sa1", "spatial"), SOLVED: ("ra1_vector", "wavenumbers")}


def command(*words: object) -> str:
    """Run a command of the shell; return what it printed on stdout."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        cli.run([str(word) for word in words])
    return printed.getvalue()


def some(values: np.ndarray) -> list[float | None]:
    """Return seven evenly spaced values, the mean, the standard deviation; None for NaN."""
    flat = np.asarray(values, dtype=float).ravel()
    places = np.linspace(0, len(flat) - 1, 7).round().astype(int)
    chosen = [*flat[places], np.nanmean(flat), np.nanstd(flat)]
    return [None if np.isnan(value) else float(value) for value in chosen]


def processor() -> str:
    """Return what processors have in common on which all libraries round alike."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    known = {line for line in lines if line.startswith(("model name", "flags", "Features"))}
    chosen = {f"{k}={v}" for k, v in os.environ.items() if k.startswith(TOLD)}
    return hashlib.sha256("\n".join(sorted(known | chosen)).encode()).hexdigest()[:16]


def truth(session: Path) -> dict[str, object]:
    """What the rig says of three of its runs."""
    return {
        f"{texture}/{speed}": {
            name: some(values)
            for name, values in np.load(session / texture / str(speed) / "truth.npz").items()
        }
        for texture, speed in zip(TEXTURES, SPEEDS, strict=True)
    }


def store(place: Path) -> dict[str, object]:
    """Names, sizes and some values of each variable of three recordings."""
    found = {}
    for texture, speed in zip(TEXTURES, SPEEDS, strict=True):
        group = f"{texture}/{speed}"
        with xr.open_dataset(place, engine="zarr", group=group, consolidated=False) as content:
            found[group] = {
                name: {
                    "dims": dict(zip(variable.dims, variable.shape, strict=True)),
                    "dtype": str(variable.dtype),
                    "values": some(variable.values),
                }
                for name, variable in content.variables.items()
                if variable.dtype.kind in "biuf"
            }
            found[group]["attributes"] = sorted(content.attrs)
    return found


def folds(results: Path) -> dict[str, object]:
    """Who learnt, validated and was tested, what leaked, how long was learnt."""
    varying = {"seconds", "job_seconds", "prediction_ms", "torch", "history"}
    return {
        "/".join(file.parts[-5:-1]): {
            name: value
            for name, value in json.loads(file.read_text(encoding="utf-8")).items()
            if name not in varying
        }
        for file in sorted(results.glob("folds/*/*/*/*/fold.json"))
    }


def predictions(results: Path) -> dict[str, object]:
    """Probabilities that some test samples were given."""
    table = pd.read_parquet(results / "predictions.parquet")
    found: dict[str, object] = {"columns": list(table.columns)}
    for (model, protocol), rows in table.groupby(["model", "protocol"]):
        chosen = rows.iloc[np.linspace(0, len(rows) - 1, 12).round().astype(int)]
        found[f"{model} {protocol}"] = {
            "n": len(rows),
            "recordings": chosen["recording"].tolist(),
            "start_s": chosen["start_s"].tolist(),
            "true": chosen["true_texture"].tolist(),
            "probabilities": chosen.filter(like="p_").to_numpy(float).tolist(),
        }
    return found


def reported(results: Path) -> dict[str, object]:
    """Numbers of the summary and of the first table, and the figures drawn."""
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    names = ("mean_accuracy", "ci95", "by", "confusion", "n_test", "leaks")
    cells = (results / "table1.md").read_text(encoding="utf-8").split("|")
    return {
        "models": {
            f"{model} {protocol}": {name: content[name] for name in names}
            for model, protocols in summary["models"].items()
            for protocol, content in protocols.items()
        },
        "chance": summary["chance"],
        "table": [float(n) for cell in cells for n in re.findall(r"\d+\.\d+", cell)],
        "figures": sorted(path.name for path in (results / "figures").iterdir()),
    }


def exported(model: Path, samples: xr.DataArray) -> list[list[float]]:
    """What a trained model's ONNX file says of six samples."""
    running = onnxruntime.InferenceSession(str(model))
    entry = running.get_inputs()[0]
    places = tuple(slice(0, size) for size in entry.shape)  # spectra go on beyond 200 Hz
    rows = np.linspace(0, len(samples) - 1, 6).round().astype(int)
    found = [running.run(None, {entry.name: samples.values[[row]][places]}) for row in rows]
    return [[float(number) for part in parts for number in part.ravel()] for parts in found]


def live(replayed: Path, models: list[Path]) -> dict[str, object]:
    """Events of a recording that is replayed to both models."""
    words = [word for model in models for word in ("--model", model)]
    source = f"replay:{replayed}"
    printed = command("live", *words, "--video", source, "--audio", source,
                      "--speed", "max", "--json")  # fmt: skip
    events = [json.loads(line) for line in printed.splitlines()]
    found: dict[str, object] = {}
    for name in (NETWORK, SOLVED):
        own = [event for event in events if event["model"] == name]
        fed = [event for event in own if event["probabilities"]]
        chosen = [fed[i] for i in np.linspace(0, len(fed) - 1, 6).round().astype(int)]
        found[name] = {
            "keys": sorted(own[0]),
            "n": len(own),
            "states": sorted({event["state"] for event in own}),
            "time_s": [event["time_s"] for event in chosen],
            "probabilities": [list(event["probabilities"].values()) for event in chosen],
            "evidence": [list(event["evidence"].values()) for event in chosen],
            "novelty": [event["novelty"] for event in chosen],
            "markers_found": [event["markers_found"] for event in chosen],
            "frames_and_samples": [own[-1]["counters"][n] for n in ("frames", "samples")],
        }
    return found


def path(folder: Path) -> dict[str, object]:
    """Go the whole way in an empty folder; return its numbers."""
    session, responses, results = folder / "S", folder / "S.zarr", folder / "R"
    recipe = folder / "recipe.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    briefly = ("--preset", "quick", "--quiet")
    learning = ("--recipe", recipe, "--precision", "float32", *briefly)
    command("simulate", session, "--textures", "a,d,k", "--speeds", "20,40,70", "--seconds", 6,
            "--seed", 11, "--workers", 1, "--quiet")  # fmt: skip
    command("extract", session, responses, "--workers", 1, "--quiet")
    command("evaluate", responses, "--out", results, "--models", f"{NETWORK},{SOLVED}",
            "--protocol", "both", "--held-out", HELD_OUT, *learning, "--workers", 1)  # fmt: skip
    command("report", results, "--quiet")
    samples = {
        model: afferents.samples(responses, *encoded, quiet=True)
        for model, encoded in ENCODED.items()
    }
    models = []
    for model in ENCODED:
        models.append(folder / f"{model}.onnx")
        chosen = learning if model == NETWORK else briefly
        command("train", responses, folder / model, "--model", model, *chosen)
        command("export", folder / model, models[-1])
    return {
        "processor": processor(),
        "truth": truth(session),
        "store": store(responses),
        "samples": {model: some(values) for model, values in samples.items()},
        "folds": folds(results),
        "predictions": predictions(results),
        "report": reported(results),
        "onnx": {p.stem: exported(p, samples[p.stem]) for p in models},
        "live": live(session / "1.5" / "40", models),
    }


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else KEPT
    with tempfile.TemporaryDirectory() as made:
        numbers = path(Path(made))
    target.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
