"""Leave one speed out: folds, leakage, metrics and results on disk."""

from afferents.evaluation.calibration import best_weights, least_surprise, surprise, weighted
from afferents.evaluation.folds import (
    PLAN,
    FoldKey,
    check_results_folder,
    claim_results_folder,
    finished,
    finished_keys,
    predictions_table,
    save_fold,
)
from afferents.evaluation.leakage import Leaks, find_leaks, refuse_leaks
from afferents.evaluation.occlusion import Say, bands, losses, patches
from afferents.evaluation.splits import Fold, LeaveOneSpeedOut, number_in_recording
from afferents.evaluation.standing import (
    Standing,
    State,
    at_work,
    plan,
    planned_workers,
    seconds_left,
    standings,
)
from afferents.evaluation.summary import summarise
from afferents.evaluation.touches import between

__all__ = [
    "PLAN",
    "Fold",
    "FoldKey",
    "Leaks",
    "LeaveOneSpeedOut",
    "Say",
    "Standing",
    "State",
    "at_work",
    "bands",
    "best_weights",
    "between",
    "check_results_folder",
    "claim_results_folder",
    "find_leaks",
    "finished",
    "finished_keys",
    "least_surprise",
    "losses",
    "number_in_recording",
    "patches",
    "plan",
    "planned_workers",
    "predictions_table",
    "refuse_leaks",
    "save_fold",
    "seconds_left",
    "standings",
    "summarise",
    "surprise",
    "weighted",
]
