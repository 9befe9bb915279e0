"""The page of an evaluation that leaves out textures as well as speeds."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from afferents.core.files import write_text
from afferents.core.results import UNKNOWN
from afferents.reporting.html import shortened, template, textures_line
from afferents.reporting.in_short import what_was_lost
from afferents.reporting.labels import Summary, data_line, model_title, percent, speed_key
from afferents.reporting.published import CITATION
from afferents.reporting.replicates import interval_note
from afferents.reporting.unknown import texture_tables


def write_texture_page(path: Path, summaries: Mapping[str, dict[str, Any]]) -> Path:
    """Write the page of `--split texture`, whole or not at all, and return its path.

    Parameters
    ----------
    path
        The file to write, such as `RESULTS/report.html`.
    summaries
        By question; what is unknown is always asked.
    """
    summary = summaries[UNKNOWN]
    page = template("textures.html").render(
        headline=_headline(summary),
        sureness=interval_note(summary),
        facts=_facts(summary),
        simulated=[data for data in summary["data"] if data["simulated"]],
        skipped=summary["skipped"],
        accepted=summary.get("accepted", ()),
        lost=what_was_lost(summary),
        tables=texture_tables(summaries),
        command=_redo_command(summary, path.parent.name or "RESULTS"),
        citation=CITATION,
        version=summary["afferents"],
    )
    write_text(path, page)
    return path


def _headline(summary: Summary) -> str:
    """Return what the model that tells unknown from known best comes to."""
    models = summary["models"]
    best = max(models, key=lambda model: models[model]["auroc"]["samples"])
    both = [models[best][key]["samples"] for key in ("found", "false_alarms")]
    inner = all(one["inside"] for one in both)
    found, alarms = ((one["inside"] if inner else one)["mean"] for one in both)
    where = "at speeds between those learnt from" if inner else "at speeds held out"
    title, stated = model_title(best, summary), percent(summary["false_alarms_stated"], 0)
    return (
        f"{title[0].upper()}{title[1:]} does best: {where} it calls {percent(found)} % of "
        f"the samples of textures never felt unknown, and {percent(alarms)} % of those "
        f"of textures that it has felt, where {stated} % are stated."
    )


def _facts(summary: Summary) -> list[tuple[str, str]]:
    speeds = shortened([speed_key(v) for v in summary["speeds_mm_s"]])
    return [
        ("Data", data_line(summary)),
        ("Textures", textures_line(summary)),
        ("Speeds", f"{len(summary['speeds_mm_s'])}: {speeds} mm/s"),
        ("Models", ", ".join(model_title(name, summary) for name in summary["models"])),
        ("Protocol", "nested"),
        ("Cut", summary["cut"]),
    ]


def _redo_command(summary: Summary, out: str) -> str:
    arguments = [
        *(data["source"] for data in summary["data"]),
        *("--out", out, "--split", "texture", "--models", ",".join(summary["models"])),
        *("--cut", summary["cut"]),
        *summary["options"],
    ]
    return shlex.join(["afferents", "evaluate", *arguments])
