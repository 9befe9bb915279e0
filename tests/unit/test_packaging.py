"""What is shipped: the wheel, built from a copy without git, and what the docs say of it."""

import json
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = [path.relative_to(ROOT) for path in sorted((ROOT / "scripts").glob("*.sh"))]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("setuptools_scm")
    away = tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, away)
    left_out = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / "src", away / "src", ignore=left_out)
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", "dist"]
    subprocess.run([*command, away], check=True, capture_output=True, cwd=away)
    (built,) = (away / "dist").iterdir()
    return built


@pytest.mark.system
def test_all_of_the_package_is_in_the_wheel_under_the_version_declared(wheel):
    declared = PROJECT["tool"]["setuptools_scm"]["fallback_version"]
    assert wheel.name == f"afferents-{declared}-py3-none-any.whl"
    with ZipFile(wheel) as archive:
        shipped = {name for name in archive.namelist() if name.startswith("afferents/")}
    files = (path for path in (ROOT / "src/afferents").rglob("*") if path.is_file())
    written = {path.relative_to(ROOT / "src").as_posix() for path in files}
    assert shipped == {name for name in written if "__pycache__" not in name}


@pytest.mark.system
def test_a_tag_is_the_version(tmp_path):
    pytest.importorskip("setuptools_scm")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    somebody = "-c user.name=A -c user.email=a@example.org"
    for command in ("init -q", "add .", f"{somebody} commit -qm A", "tag v9.8.7"):
        subprocess.run(["git", *command.split()], check=True, cwd=tmp_path)
    command = [sys.executable, "-m", "setuptools_scm"]
    said = subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path)
    assert said.stdout.strip() == "9.8.7"


def test_the_extras_are_those_that_the_docs_list():
    page = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `([\w-]+)` \|", page, flags=re.MULTILINE)
    assert sorted(listed) == sorted(PROJECT["project"]["optional-dependencies"])


@pytest.mark.parametrize("file", ["Makefile", "CONTRIBUTING.md", *SCRIPTS], ids=str)
def test_the_tests_that_are_named_are_there(file):
    named = re.findall(r"\btests/[\w./-]*\w", (ROOT / file).read_text(encoding="utf-8"))
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_dev_brings_all_the_other_extras():
    extras = dict(PROJECT["project"]["optional-dependencies"])
    del extras["view"]  # half a gigabyte, for a window that no test opens
    (brought,) = (line for line in extras.pop("dev") if line.startswith("afferents["))
    assert sorted(re.split(r"[\[\],]", brought)[1:-1]) == sorted(extras)


@pytest.mark.parametrize("constraints", ["constraints.txt", "constraints-lowest.txt"])
def test_every_direct_dependency_has_a_tested_version(constraints):
    lines = (ROOT / constraints).read_text(encoding="utf-8").splitlines()
    tested = {_plain(line.split("==")[0]) for line in lines if "==" in line}
    project = PROJECT["project"]
    asked = project["dependencies"] + project["optional-dependencies"]["lab"]
    needed = {_plain(re.split(r"[<>=]", line)[0]) for line in asked}
    assert needed <= tested


def test_codemeta_and_citation_say_what_the_project_says():
    about, project = (
        json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8")),
        PROJECT["project"],
    )
    assert [about[key] for key in ("name", "description", "keywords")] == [
        project[key] for key in ("name", "description", "keywords")
    ]
    assert about["license"] == f"https://spdx.org/licenses/{project['license']}"
    assert [one["name"] for one in about["author"]] == [one["name"] for one in project["authors"]]
    assert about["runtimePlatform"] == f"Python {project['requires-python']}"
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    said = dict(re.findall(r"^(version|license): (.+)$", citation, flags=re.MULTILINE))
    assert said == {"version": about["version"], "license": project["license"]}
    assert re.fullmatch(r"\d+\.\d+\.\d+", about["version"])
    assert project["dynamic"] == ["version"]  # of the git tag, v0.1.0


@pytest.mark.parametrize(
    ("licence", "binding"),
    [
        ("MIT", False),
        ("GNU Lesser General Public License v3 (LGPLv3)", False),
        ("LGPL-2.1-or-later", False),
        ("GPL-3.0-only OR BSD-3-Clause", False),
        ("GPL-3.0-or-later WITH GCC-exception-3.1", False),
        ("MIT AND GPL-2.0-or-later", True),
        ("GNU General Public License v3 (GPLv3)", True),
        ("GNU Affero General Public License v3", True),
        ("CC-BY-NC-4.0", True),
        ("", True),
    ],
)
def test_a_licence_that_binds_users_is_known(licence, binding):
    assert runpy.run_path(str(ROOT / "scripts/licences.py"))["binds"](licence) == binding


def test_each_benchmark_runs_in_short_or_says_why_not():
    page = runpy.run_path(str(ROOT / "benchmarks/all.py"))
    scripts = {path.stem for path in (ROOT / "benchmarks").glob("*.py")} - {"all"}
    assert {*page["SHORT"], *page["LEFT_OUT"]} == scripts


def _plain(name):
    """Spell a package's name as registries do."""
    return re.sub(r"[-_.]+", "-", name.strip().lower())
