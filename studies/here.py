"""Where the studies keep numbers, pages and pictures; puts `scripts` on the path of imports.

    python studies/here.py

draws the tables of the pages here from `studies/data`, as `make results-pages` does in `docs`.
"""

import sys
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
DATA = HERE / "data"
IMAGES = HERE / "images"
sys.path.append(str(HERE.parent / "scripts"))


def pages() -> dict[Path, str]:
    """Return the text of each page of the studies, with its tables as the data have them."""
    import results_pages

    part = partial(results_pages.part, data=DATA)
    every = sorted(HERE.glob("*.md"))
    return {page: results_pages.fill(page.read_text(), "results", part) for page in every}


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text)
