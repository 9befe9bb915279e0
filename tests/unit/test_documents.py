"""Whatever stands in a file of JSON or TOML: its content, or one sentence."""

import json
import os

import pytest
from pydantic import BaseModel, Field

from afferents.documents import as_form, parse_json, read_checked, read_json, read_toml
from afferents.errors import InputError


class Inner(BaseModel):
    share: float = Field(ge=0, le=1)


class Outer(BaseModel):
    name: str
    size: tuple[int, int] = (1, 1)
    inner: Inner = Inner(share=0.5)


@pytest.fixture
def write(tmp_path):
    def write(content):
        path = tmp_path / "a"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def sentence(call, *arguments):
    with pytest.raises(InputError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ("", "a damaged file, no JSON"),
        ("[]", "JSON that is no object"),
        ('{"a": 1', "a damaged file, no JSON"),
        (b"\xff\xfe", "a damaged file, no JSON ('utf-8' codec can't decode byte 0xff"),
        ("[" * 100_000, "lists and tables that lie too deep"),
        ('{"a": ' + "9" * 5000 + "}", "a damaged file, no JSON"),
        ('{"a": {"b": [0, NaN]}}', "a damaged file, no JSON (NaN, no finite number)"),
        ('{"a": -Infinity}', "a damaged file, no JSON (-Infinity, no finite number)"),
        ('{"a": 1e999}', "a damaged file, no JSON (1e999, no finite number)"),
    ],
)
def test_json_that_is_refused(write, content, found):
    path = write(content)
    assert f"{path}: expected a plan, found {found}" in sentence(read_json, path, "a plan")


@pytest.mark.parametrize(
    ("content", "found"),
    [
        ("a = = 1", "a damaged file, no TOML"),
        (b"a = '\xff'", "a damaged file, no TOML ('utf-8' codec can't decode byte 0xff"),
        ("a = " + "[" * 100_000, "lists and tables that lie too deep"),
        (".".join("a" * 100_000) + " = 1", "lists and tables that lie too deep"),
        ("a = " + "9" * 5000, "a damaged file, no TOML"),
        ("a = 2026-13-01", "a damaged file, no TOML"),
        ("a.b = nan", "a damaged file, no TOML (nan, no finite number)"),
        ("#" * (1 << 20) + "\n", "more than 1 MiB"),
    ],
)
def test_toml_that_is_refused(write, content, found):
    path = write(content)
    assert f"{path}: expected a sensor, found {found}" in sentence(read_toml, path, "a sensor")


def test_what_is_fine_is_read(write):
    assert read_json(write(b'\xef\xbb\xbf{"a": [1, 2.5, "\xc3\xa9"]}'), "x") == {"a": [1, 2.5, "é"]}
    numbers = ", ".join("[1.5, 2.5]" for _ in range(1000))
    toml = f"# {'.' * 100}\nmarkers = [{numbers}]\n"
    assert len(read_toml(write(toml), "x")["markers"]) == 1000
    assert parse_json("[1, null]", "a", "x") == [1, None]


def test_what_is_no_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "loop").symlink_to("loop")
    for path in (tmp_path, tmp_path / "fifo", "/dev/zero"):
        said = sentence(read_json, tmp_path / path, "a plan", "remove it")
        assert "found something that is no file; remove it" in said
    for path in ("none", "loop", "x" * 300):
        assert f"{path}: expected a plan, found" in sentence(read_json, tmp_path / path, "a plan")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({}, "expected a form with the key 'name', found none; mend it"),
        ({"name": 1}, "expected a form with name: a valid string, found 1; mend it"),
        ({"name": "a", "size": [1, True]}, "size.1: a valid integer, found True"),
        ({"name": "a", "size": [1]}, "the key 'size.1', found none"),
        ({"name": "a", "inner": {"share": 5}}, "inner.share: less than or equal to 1, found 5"),
        ({"name": "a", "inner": {"share": True}}, "inner.share: a valid number, found True"),
        ({"name": "a", "inner": []}, "inner: an object, found []"),
        ({"name": "a", "inner": ["x" * 1000]}, "x..."),
    ],
)
def test_a_fault_names_file_and_key(write, content, said):
    path = write(json.dumps(content))
    found = sentence(read_checked, path, Outer, "a form", "mend it")
    assert found.startswith(f"{path}: expected ")
    assert said in found
    assert len(found) < 300


def test_what_has_passed_is_as_it_stands_in_the_file(write):
    content = {"name": "\udcff", "size": [1, 2], "more": [1]}
    assert read_checked(write(json.dumps(content)), Outer, "a form") == content
    assert as_form(content, Outer, "a", "a form").size == (1, 2)
