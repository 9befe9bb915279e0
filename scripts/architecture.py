"""Draw the packages and their arrows from the imports: part of ``make results-pages``.

    python scripts/architecture.py

Writes `docs/images/architecture.svg`, and into `docs/architecture.md` what each package holds, by
the first sentence of its docstring. Rows are the layers of the import contract in pyproject.toml.
An arrow goes from a package to one that it imports, unless others that it imports lead there too.
"""

import ast
import re
import tomllib
from html import escape
from pathlib import Path

import grimp
from results_pages import DOCS, ROOT, fill, table

import afferents

PAGE, PICTURE = DOCS / "architecture.md", DOCS / "images" / "architecture.svg"
WIDTH, BOX, HEIGHT, PITCH, MARGIN = 860, 150, 32, 62, 24
INK, LINE, PALE, FILL, BASE = "#26323d", "#55636f", "#a9b6c2", "#eef3f8", "#f6f1e7"

Arrow = tuple[str, str]


def layers() -> list[list[str]]:
    """Return packages from the top layer down, as the import contract has them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    contract = next(one for one in contracts if one["type"] == "layers")
    return [
        [name.removeprefix("afferents.") for name in re.split(r" [|:] ", layer)]
        for layer in contract["layers"]
    ]


def imports() -> set[Arrow]:
    """Return which package imports which, without the lowest row, which all may import."""
    graph = grimp.build_graph("afferents", cache_dir=None)
    drawn = {name for layer in layers()[:-1] for name in layer}
    found = {
        (importer.split(".")[1], imported.split(".")[1])
        for importer in graph.modules - {"afferents"}
        for imported in graph.find_modules_directly_imported_by(importer) - {"afferents"}
    }
    return {(a, b) for a, b in found if a != b and {a, b} <= drawn}


def needed(arrows: set[Arrow]) -> list[Arrow]:
    """Return the arrows that no way over other arrows replaces."""

    def reached(start: str, without: Arrow) -> set[str]:
        seen: set[str] = set()
        ahead = [b for a, b in arrows if a == start and (a, b) != without]
        while ahead:
            here = ahead.pop()
            if here not in seen:
                seen.add(here)
                ahead += [b for a, b in arrows if a == here]
        return seen

    return sorted((a, b) for a, b in arrows if b not in reached(a, (a, b)))


def picture() -> str:
    """Return the picture, as SVG."""
    *rows, base = layers()
    place = {
        name: (WIDTH * (k + 1) / (len(row) + 1), MARGIN + PITCH * rank)
        for rank, row in enumerate(rows)
        for k, name in enumerate(row)
    }
    arrows = sorted(needed(imports()), key=lambda arrow: place[arrow[0]][1])
    lines = [_arrow(place[a], place[b], right=k % 2 == 0) for k, (a, b) in enumerate(arrows)]
    boxes = [_box(name, x, y, BOX, FILL) for name, (x, y) in place.items()]
    below = MARGIN + PITCH * len(rows)
    boxes.append(_box(", ".join(sorted(base)), WIDTH / 2, below, WIDTH - 2 * MARGIN, BASE))
    height = below + HEIGHT + MARGIN
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        f'font-family="sans-serif" font-size="14"><title>The packages of afferents</title>'
        f'<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" '
        f'markerHeight="8" orient="auto"><path d="M0 0L8 4L0 8z" fill="{LINE}"/></marker></defs>'
        f'<rect width="{WIDTH}" height="{height}" fill="white"/>'
    )
    return "\n".join([head, *lines, *boxes, "</svg>\n"])


def _arrow(start: tuple[float, float], stop: tuple[float, float], *, right: bool) -> str:
    """Draw an arrow to the next row straight, and one beyond it round what lies between."""
    (x, y), (to_x, to_y) = start, stop
    rows = round((to_y - y) / PITCH)
    across = rows == 1 or abs(to_x - x) > BOX
    aside = 0 if across else (1 if right else -1) * (115 + 12 * rows)
    begin, end = y + HEIGHT, to_y - 1
    bend = (end - begin) / 2
    colour, width = (LINE, 1.6) if rows == 1 else (PALE, 1.2)
    return (
        f'<path d="M{x:.0f} {begin:.0f}C{x + aside:.0f} {begin + bend:.0f} '
        f'{to_x + aside:.0f} {end - bend:.0f} {to_x:.0f} {end:.0f}" fill="none" '
        f'stroke="{colour}" stroke-width="{width}" marker-end="url(#tip)"/>'
    )


def _box(text: str, x: float, y: float, width: float, fill_with: str) -> str:
    """Draw a named box round a middle, from a height down."""
    return (
        f'<rect x="{x - width / 2:.0f}" y="{y}" width="{width:.0f}" height="{HEIGHT}" rx="6" '
        f'fill="{fill_with}" stroke="{INK}"/><text x="{x:.0f}" y="{y + HEIGHT / 2 + 5:.0f}" '
        f'text-anchor="middle" fill="{INK}">{escape(text)}</text>'
    )


def what_it_holds(name: str) -> str:
    """Return what a package's docstring says first, without importing it."""
    place = Path(afferents.__file__).parent / name
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    said = ast.get_docstring(ast.parse(file.read_text())) or ""
    return said.split("\n\n")[0].replace("\n", " ").removesuffix(".")


def page() -> str:
    """Return the page, with what each package above the lowest row holds."""
    rows = [[f"`{name}`", what_it_holds(name)] for layer in layers()[:-1] for name in layer]
    return fill(PAGE.read_text(), "packages", lambda _: table(["package", "what it holds"], rows))


if __name__ == "__main__":
    PICTURE.write_text(picture())
    PAGE.write_text(page())
