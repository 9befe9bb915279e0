"""Progress bars with remaining time, on stderr; silent for scripts."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Protocol, Self, TypeVar

from rich import progress as bars
from rich.console import Console

from afferents.core.streams import unfailing_stderr

T = TypeVar("T")


class Mark(Protocol):
    """Sets how much of a task is done and what is being worked on."""

    def __call__(self, completed: float, text: str = "") -> None:
        """Show `completed` of the task's total, and `text` beside it."""
        ...


class Progress:
    """Bars for the work of a command; use as a context manager.

    Parameters
    ----------
    quiet
        Show nothing but notes, and those without colour: for logs and scripts.
    """

    def __init__(self, quiet: bool = False) -> None:
        console = Console(file=unfailing_stderr(), no_color=quiet, highlight=False, soft_wrap=True)
        self._bars = bars.Progress(
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.TaskProgressColumn(),
            bars.TimeElapsedColumn(),
            bars.TextColumn("left"),
            bars.TimeRemainingColumn(),
            bars.TextColumn("{task.fields[text]}"),
            console=console,
            disable=quiet,
        )

    def __enter__(self) -> Self:
        """Drawing starts with the first task."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop drawing."""
        self._bars.stop()

    def note(self, text: str) -> None:
        """Print a line above the bars."""
        self._bars.console.print(text, markup=False)

    def track(self, items: Iterable[T], label: str, total: int) -> Iterator[T]:
        """Yield the items, a step of the bar each."""
        with self.task(label, total) as mark:
            for done, item in enumerate(items):
                mark(done)
                yield item
                mark(done + 1)

    @contextmanager
    def task(self, label: str, total: float) -> Iterator[Mark]:
        """Show a bar while the block runs; call what it yields to move it."""
        self._bars.start()
        task = self._bars.add_task(label, total=total, text="")

        def mark(completed: float, text: str = "") -> None:
            self._bars.update(task, completed=completed, text=text)

        yield mark
