"""Tasks on which models of texture are compared, and all entries.

A task is a data set, what of it is held out, and a seed: whoever runs it tests on the same samples.
"""

from afferents.benchmark.entries import Entry, read_entries, table
from afferents.benchmark.run import run
from afferents.benchmark.tasks import Task, all_tasks, find_task

__all__ = ["Entry", "Task", "all_tasks", "find_task", "read_entries", "run", "table"]
