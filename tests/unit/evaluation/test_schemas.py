"""What lies in a results folder: each field is explained."""

import pytest
from pydantic import BaseModel

from afferents.evaluation import fold_files, results

PLAIN = {"Config", "Skipped", "WithIssues"}
"""Whose names of fields say all."""
WRITTEN = [
    kind
    for module in (results, fold_files)
    for kind in vars(module).values()
    if isinstance(kind, type)
    and issubclass(kind, BaseModel)
    and kind.__module__ == module.__name__
    and kind.__name__ not in PLAIN
]


@pytest.mark.parametrize("schema", WRITTEN)
def test_each_field_says_what_it_is(schema):
    """The tables of docs/results-format.md are made of it."""
    assert [name for name, field in schema.model_fields.items() if not field.description] == []
