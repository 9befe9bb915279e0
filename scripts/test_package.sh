#!/bin/sh
# Build the wheel and the sdist, and test the wheel away from here: sh scripts/test_package.sh PYTHON
#
# The wheel is installed in an empty environment with nothing but what it asks for. The commands that
# need no extra are run there, then the quick tests, both in a folder in which nothing else lies.
#
#   CONSTRAINTS=constraints-lowest.txt   other versions than those of constraints.txt
#   TESTS="tests/unit/store tests/golden" other tests
set -eu

root=$(cd "$(dirname "$0")/.." && pwd)
constraints=$root/${CONSTRAINTS:-constraints.txt}
tests=${TESTS:-tests/unit/cli tests/unit/store tests/unit/channels \
    tests/unit/encodings tests/unit/models tests/unit/evaluation}
python=$(command -v "$1")
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT

echo "== build"
"$python" -m venv "$away/tools"
"$away/tools/bin/pip" install --quiet --disable-pip-version-check build twine
rm -rf "$root/dist"
"$away/tools/bin/python" -m build --outdir "$root/dist" "$root"
"$away/tools/bin/twine" check --strict "$root"/dist/*

echo "== install in an empty environment"
"$python" -m venv "$away/venv"
"$away/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    -c "$constraints" "$root"/dist/*.whl
PATH=$away/venv/bin:$PATH
"$away/venv/bin/python" -m pip check

echo "== what needs no extra"
mkdir "$away/work"
cd "$away/work"
python - "$root" <<'EOF'
import subprocess, sys
from pathlib import Path
import afferents

here, root = Path(afferents.__file__).parent, Path(sys.argv[1])
assert "site-packages" in here.parts, here
tracked = ["git", "-C", str(root / "src/afferents"), "ls-files"]
files = subprocess.run(tracked, capture_output=True, text=True, check=True).stdout.split()
missing = [name for name in files if not (here / name).is_file()]
assert not missing, f"not in the wheel: {missing}"
print(f"afferents {afferents.__version__} in {here}: all of {len(files)} files")
EOF
afferents --help >help.txt
afferents --version
afferents simulate session --textures 0,g,6 --speeds 20,40,60 --seconds 3 --workers 1 --quiet
afferents inspect session >inspected.txt
afferents extract session store.zarr --workers 1 --quiet
! python -c "import torch" 2>/dev/null
! afferents evaluate store.zarr --out results 2>needed.txt
grep -q "pip install 'afferents\[train\]'" needed.txt

echo "== with the extra train"
python -m pip install --quiet --disable-pip-version-check -c "$constraints" \
    "afferents[train] @ file://$(ls "$root"/dist/*.whl)"
afferents evaluate store.zarr --out results --models sa-se,vib-te,ra-wave-vector \
    --protocol nested --preset quick --workers 1 --quiet
afferents report results --quiet
test -s results/report.html

echo "== tests"
python -m pip install --quiet --disable-pip-version-check -c "$constraints" \
    filelock pytest pytest-timeout hypothesis
cp -r "$root/tests" "$root/scripts" "$root/pyproject.toml" .
python -m pytest -q -p no:cacheprovider $tests
