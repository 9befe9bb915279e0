"""Limits of the system that tests run into on purpose."""

import resource
from contextlib import contextmanager


@contextmanager
def files_no_larger_than(n_bytes):
    """Let no file grow beyond this, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
