#!/bin/sh
# Test the camera for LeRobot with LeRobot itself: sh scripts/test_lerobot.sh PYTHON
#
# PYTHON has afferents with all that it needs; a new environment sees that, and adds LeRobot and the
# camera. LeRobot asks for older versions of PyTorch, PyAV and others than those: of all that it
# asks for, only what its cameras import is installed.
#
#   LEROBOT=lerobot==0.4.4   another version than the newest for this Python
set -eu

root=$(cd "$(dirname "$0")/.." && pwd)
python=$(command -v "$1")
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT

echo "== install"
"$python" -m venv "$away/venv"
added() {
    "$away/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        --no-warn-conflicts "$@"
}
seen=$("$away/venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/seen.pth
echo "$root/src" >"$seen"
"$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))' >>"$seen"
cp -r "$root/plugins/lerobot_camera_afferents" "$away/plugin"
added --no-deps "${LEROBOT:-lerobot}" "$away/plugin"
"$away/venv/bin/python" - >"$away/imported.txt" <<'EOF'
from importlib.metadata import requires

for line in requires("lerobot"):
    if line.startswith(("draccus", "huggingface-hub")) and "extra" not in line:
        print(line)
EOF
added -r "$away/imported.txt"
"$away/venv/bin/python" -c 'import lerobot, lerobot.cameras; print("lerobot", lerobot.__version__)'

echo "== test"
cd "$away/plugin"
"$away/venv/bin/python" -m pytest -q -p no:cacheprovider tests
