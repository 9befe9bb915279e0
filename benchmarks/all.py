"""Run the benchmarks one after the other, in their short form, and write one page.

    python benchmarks/all.py [PAGE] [--only tracking,live]     # PAGE: out/benchmarks.md

Each has a process of its own; what it prints becomes a section. A short run shows that something
has become much slower, not by how much: for that, run the benchmark alone, on a quiet machine.
"""

import argparse
import platform
import subprocess
import sys
import time
from pathlib import Path

from afferents import __version__
from afferents.doctor import diagnose
from afferents.files import write_text

HERE = Path(__file__).parent
SHORT = {
    "tracking": ["--rounds", "1", "--seconds", "5"],
    "pictures": ["--rounds", "1", "--frames", "20"],
    "rig_speed": ["1"],
    "training_speed": ["--repeats", "1"],
    "engine_speed": ["--jobs", "2", "--repeats", "1"],
    "live": [],
    "spikes": [],
    "recording": ["5"],
    "devices": [],
    "taps": ["4"],
    "calls": [],
}
"""Arguments that make each short."""
LEFT_OUT = {
    "evaluate_memory": "takes ten minutes and 5 GB",
    "many_recordings": "takes an hour and more",
    "lessons": "takes half an hour",
    "object_storage": "needs a server and packages that nothing else needs",
}
"""Why the others don't run here."""


def main() -> int:
    """Run, write, and return 1 where a benchmark failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("page", nargs="?", type=Path, default=Path("out/benchmarks.md"))
    parser.add_argument("--only", default=",".join(SHORT))
    arguments = parser.parse_args()
    sections, failed = [], []
    for name in arguments.only.split(","):
        print(f"{name} ...", flush=True)
        section, went_well = run(name)
        sections.append(section)
        failed += [] if went_well else [name]
    arguments.page.parent.mkdir(parents=True, exist_ok=True)
    write_text(arguments.page, "\n\n".join([machine(), *sections, left_out()]) + "\n")
    print(f"{arguments.page}" + (f"; failed: {', '.join(failed)}" if failed else ""))
    return 1 if failed else 0


def run(name: str) -> tuple[str, bool]:
    """Return a benchmark's section, and whether it came to its end."""
    command = [sys.executable, str(HERE / f"{name}.py"), *SHORT[name]]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - start
    title = f"## `{' '.join(['benchmarks/' + name + '.py', *SHORT[name]])}`, {seconds:.0f} s"
    if done.returncode == 0:
        return f"{title}\n\n{done.stdout.strip()}", True
    return f"{title}\n\nFailed:\n\n```\n{done.stderr.strip()[-2000:]}\n```", False


def machine() -> str:
    """Return the page's head: where and with what it was measured."""
    found = {name: one for its in diagnose()[0].values() for name, one in its.items()}
    said = [f"{what}: {found[what]}" for what in ("processor", "memory", "torch build")]
    with_what = f"afferents {__version__}, Python {platform.python_version()}"
    return f"# Benchmarks, short\n\n{with_what}; {'; '.join(said)}."


def left_out() -> str:
    """Return the page's end: what did not run."""
    lines = (f"- `{name}.py` {why}." for name, why in LEFT_OUT.items())
    return "## Not run\n\n" + "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
