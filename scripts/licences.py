"""Print the licences of what the package needs to run; fail where one would bind its users.

    python scripts/licences.py

That is the base and all extras but `dev` and `docs`, with what these need, as installed here. A
package's own words are taken. Some wheels carry libraries of other licences: those that are known
for it (`CARRIED`) are named below the table.
"""

import re
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
BINDING = re.compile(
    r"\bA?GPL(?!.*exception)|(?<!Lesser )General Public|non-?commercial|\bNC\b|SSPL|proprietary",
    re.IGNORECASE,
)
CARRIED = ("x264", "x265")
"""Libraries under the GPL that a wheel may carry, whatever it says of itself."""


READ = {"quantities": "BSD-3-Clause (read)", "skops": "MIT (read)"}
"""Of packages that name none: as their licence's text was read."""


def needed() -> list[Requirement]:
    """Return what pyproject.toml asks for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    asked = [line for name in extras if name not in ("dev", "docs") for line in extras[name]]
    return [Requirement(line) for line in project["dependencies"] + asked]


def with_theirs(asked: list[Requirement]) -> dict[str, Distribution | None]:
    """Return packages by name, with all that they need; None for those not installed here."""
    found: dict[str, Distribution | None] = {}
    seen, waiting = set(), list(asked)
    while waiting:
        one = waiting.pop()
        key = re.sub(r"[-_.]+", "-", one.name.lower()), *sorted(one.extras)
        if key in seen:
            continue
        seen.add(key)
        try:
            found[key[0]] = there = distribution(one.name)
        except PackageNotFoundError:
            found[key[0]] = None
            continue
        theirs = map(Requirement, there.requires or [])
        waiting += [need for need in theirs if _applies(need, ("", *one.extras))]
    return dict(sorted(found.items()))


def _applies(need: Requirement, extras: Iterable[str]) -> bool:
    return need.marker is None or any(need.marker.evaluate({"extra": name}) for name in extras)


def licence_of(there: Distribution) -> str:
    """Return a package's SPDX expression, else its classifiers, else a text's first line."""
    about = there.metadata
    classified = [
        line.rpartition(" :: ")[2]
        for line in about.get_all("Classifier", [])
        if line.startswith("License :: ") and not line.endswith("OSI Approved")
    ]
    expression, text = (
        "".join(about.get_all(key) or []).strip().partition("\n")[0]
        for key in ("License-Expression", "License")
    )
    return expression or "; ".join(classified) or text or READ.get(about["Name"], "")


def binds(licence: str) -> bool:
    """Tell whether a licence, each of those to choose from, binds users, or none is said."""
    choices = re.split(r"\s+OR\s+", licence)
    return not licence or all(BINDING.search(choice) for choice in choices)


def main() -> int:
    """Print the table; return 1 where a licence binds."""
    found = with_theirs(needed())
    here = {name: there for name, there in found.items() if there is not None}
    rows = [(name, there.version, licence_of(there)) for name, there in here.items()]
    bad = [name for name, _, licence in rows if binds(licence)]
    for name, version, licence in rows:
        print(f"{name:28}{version:16}{licence or 'not said'}")
    print(f"\n{len(rows)} packages; not installed here: {', '.join(found.keys() - here) or 'none'}")
    for name, there in here.items():
        carried = [lib for lib in CARRIED if any(f"lib{lib}" in str(f) for f in there.files or [])]
        if carried:
            print(f"{name}: its wheel carries {' and '.join(carried)}, under the GPL")
    if bad:
        print(f"licences: expected none that binds users, found {', '.join(bad)}", file=sys.stderr)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
