"""Write docs/discrepancies.md from the list in the package: ``python scripts/discrepancies.py``."""

from pathlib import Path

from afferents.reporting.discrepancies import to_page

PAGE = Path(__file__).parents[1] / "docs" / "discrepancies.md"

if __name__ == "__main__":
    PAGE.write_text(to_page(), encoding="utf-8")
