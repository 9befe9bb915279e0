"""Leave one group out, by default a speed: folds, leakage, metrics and results on disk."""

from afferents.evaluation.bootstrap import Accuracy, bootstrap_interval, paired_difference
from afferents.evaluation.course import read_course
from afferents.evaluation.folds import (
    PLAN,
    FoldKey,
    check_results_folder,
    claim_results_folder,
    digest_of,
    finished,
    finished_keys,
    predictions_table,
    save_fold,
)
from afferents.evaluation.job_status import (
    JobStatus,
    State,
    at_work,
    has_failed,
    job_statuses,
    plan,
    planned_workers,
    seconds_left,
)
from afferents.evaluation.leakage import Leaks, find_leaks, refuse_leaks
from afferents.evaluation.occlusion import Predict, bands, losses, neighbourhoods, patches
from afferents.evaluation.reliability import Reliability, reliability, reliability_of
from afferents.evaluation.shares import (
    Moving,
    Shares,
    moving,
    plane_basis,
    variance_shares,
)
from afferents.evaluation.splits import LeaveOneGroupOut, LeaveOneSpeedOut, number_in_recording
from afferents.evaluation.steadiness import APART, steadiness, steadiness_of
from afferents.evaluation.summary import summarise
from afferents.evaluation.touches import inside_speeds
from afferents.evaluation.unknown import auroc, recordings_of, share_unknown, summarise_unknown

__all__ = [
    "APART",
    "PLAN",
    "Accuracy",
    "FoldKey",
    "JobStatus",
    "Leaks",
    "LeaveOneGroupOut",
    "LeaveOneSpeedOut",
    "Moving",
    "Predict",
    "Reliability",
    "Shares",
    "State",
    "at_work",
    "auroc",
    "bands",
    "bootstrap_interval",
    "check_results_folder",
    "claim_results_folder",
    "digest_of",
    "find_leaks",
    "finished",
    "finished_keys",
    "has_failed",
    "inside_speeds",
    "job_statuses",
    "losses",
    "moving",
    "neighbourhoods",
    "number_in_recording",
    "paired_difference",
    "patches",
    "plan",
    "plane_basis",
    "planned_workers",
    "predictions_table",
    "read_course",
    "recordings_of",
    "refuse_leaks",
    "reliability",
    "reliability_of",
    "save_fold",
    "seconds_left",
    "share_unknown",
    "steadiness",
    "steadiness_of",
    "summarise",
    "summarise_unknown",
    "variance_shares",
]
