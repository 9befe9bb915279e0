"""Leave one speed out: folds, leakage, metrics and results on disk."""

from afferents.evaluation.folds import (
    FoldKey,
    check_results_folder,
    claim_results_folder,
    finished,
    finished_keys,
    predictions_table,
    save_fold,
)
from afferents.evaluation.leakage import Leaks, find_leaks, refuse_leaks
from afferents.evaluation.splits import Fold, LeaveOneSpeedOut, number_in_recording
from afferents.evaluation.summary import summarise

__all__ = [
    "Fold",
    "FoldKey",
    "Leaks",
    "LeaveOneSpeedOut",
    "check_results_folder",
    "claim_results_folder",
    "find_leaks",
    "finished",
    "finished_keys",
    "number_in_recording",
    "predictions_table",
    "refuse_leaks",
    "save_fold",
    "summarise",
]
