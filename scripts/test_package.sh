#!/bin/sh
# Build the wheel and the sdist, and test the wheel away from here: sh scripts/test_package.sh PYTHON
#
# The wheel is installed in an empty environment with nothing but what it asks for. The commands that
# need no extra are run there, where no other program is found (git, a compiler) and no display; then
# the live page from the wheel alone, by uvx; then the quick tests, in a folder in which nothing else
# lies. It says how many seconds lie between an empty environment and the first number.
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
"$away/tools/bin/pip" install --quiet --disable-pip-version-check build twine uv
rm -rf "$root/dist"
"$away/tools/bin/python" -m build --outdir "$root/dist" "$root"
"$away/tools/bin/twine" check --strict "$root"/dist/*
wheel=$(ls "$root"/dist/*.whl)

echo "== install in an empty environment"
began=$(date +%s)
"$python" -m venv "$away/venv"
"$away/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    -c "$constraints" "$wheel"
installed=$(($(date +%s) - began))
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
alone() {
    env -i HOME="$away/home" PATH="$away/venv/bin" "$@"
}
mkdir "$away/home"
alone afferents --help >help.txt
alone afferents --version
alone afferents live --help >help.txt
alone afferents simulate session --textures 0,g,6 --speeds 20,40,60 --seconds 3 --workers 1 --quiet
clip=$away/work/session/6/60/video.mp4
for times in first second; do
    began=$(date +%s)
    alone afferents track "$clip" "$times" --quiet
    took=$(($(date +%s) - began))
    echo "$times track: $took s"
    test "$times" = second || echo "from an empty environment to the first number: $((installed + took)) s"
done
afferents inspect session >inspected.txt
afferents extract session store.zarr --workers 1 --quiet
! python -c "import torch" 2>/dev/null
! afferents evaluate store.zarr --out results 2>needed.txt
grep -q "pip install 'afferents\[train\]'" needed.txt
! afferents live --video "$clip" --web 2>needed.txt
grep -q "pip install 'afferents\[lab\]'" needed.txt

echo "== the live page, by uvx"
UV_CACHE_DIR=$away/uv "$away/venv/bin/python" - "$away/tools/bin/uvx" --python "$away/venv/bin/python" \
    --constraints "$constraints" --from "afferents[lab] @ file://$wheel" \
    afferents live --video "$clip" --web --port 0 <<'EOF'
import subprocess, sys, time, urllib.request

began = time.monotonic()
live = subprocess.Popen(sys.argv[1:], stderr=subprocess.PIPE, text=True)
said = []
for line in live.stderr:
    said.append(line)
    if line.startswith("Page: "):
        break
else:
    sys.exit("".join(said))
with urllib.request.urlopen(line.split()[1]) as page:
    assert b"<html" in page.read()
print(f"the page of a clip, from nothing but the wheel: {time.monotonic() - began:.0f} s")
live.terminate()
live.wait()
EOF

echo "== with the extras lab and train"
python -m pip install --quiet --disable-pip-version-check -c "$constraints" \
    "afferents[lab,train] @ file://$wheel"
afferents evaluate store.zarr --out results --models sa-se,vib-te,ra-wave-vector \
    --protocol nested --preset quick --workers 1 --quiet
afferents report results --quiet
test -s results/report.html

echo "== tests"
python -m pip install --quiet --disable-pip-version-check -c "$constraints" \
    filelock pytest pytest-timeout hypothesis
cp -r "$root/tests" "$root/scripts" "$root/pyproject.toml" .
python -m pytest -q -p no:cacheprovider $tests
