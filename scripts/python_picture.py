"""Draw docs/images/python.png: what the page on Python draws, by its own code.

python scripts/python_picture.py docs/python.md docs/images/python.png
"""

import contextlib
import re
import sys
import tempfile
from pathlib import Path

DRAWN = "responses.png"


def main(page: Path, out: Path) -> None:
    """Run the page's examples up to the one that writes the picture."""
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.DOTALL)
    names: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for block in blocks:
            exec(block, names)
            if Path(DRAWN).is_file():
                out.write_bytes(Path(DRAWN).read_bytes())
                return


if __name__ == "__main__":
    main(*(Path(argument).resolve() for argument in sys.argv[1:]))
