"""The commands as functions, with the same words: what `afferents NAME` does from a shell.

Each takes strings or paths, shows progress in a terminal or a notebook (``quiet=True`` for none),
returns something to go on with, and raises `InputError`, one sentence, where something given is not
what it should be. What a function writes is kept if it is called again, as the commands do.

The command line calls these functions: checks and defaults of Python stand here, once.
"""

from afferents.commands.compare import compare
from afferents.commands.evaluation import evaluate, evaluate_textures, report
from afferents.commands.fetch import fetch
from afferents.commands.lerobot import export_lerobot
from afferents.commands.mcap import export_mcap
from afferents.commands.models import explain, explain_shear, export, load_model, samples, train
from afferents.commands.neural import neural
from afferents.commands.nwb import export_nwb
from afferents.commands.record import import_recording, record
from afferents.commands.recordings import (
    Extracted,
    calibrate,
    extract,
    init_session,
    inspect,
    track,
)
from afferents.commands.reproduction import reproduce
from afferents.commands.simulation import simulate
from afferents.commands.view import view

__all__ = [
    "Extracted",
    "calibrate",
    "compare",
    "evaluate",
    "evaluate_textures",
    "explain",
    "explain_shear",
    "export",
    "export_lerobot",
    "export_mcap",
    "export_nwb",
    "extract",
    "fetch",
    "import_recording",
    "init_session",
    "inspect",
    "load_model",
    "neural",
    "record",
    "report",
    "reproduce",
    "samples",
    "simulate",
    "track",
    "train",
    "view",
]
