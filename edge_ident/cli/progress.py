"""Progress of a command on stderr."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class ProgressBars:
    """Stages and their counts as bars, one for each stage."""

    def __init__(self, progress: "Progress") -> None:
        self._progress = progress
        self._task: TaskID | None = None
        self._title = ""

    def stage(self, title: str) -> None:
        """End the last stage, begin another."""
        self.end()
        self._title = title
        self._task = self._progress.add_task(title, total=None, note="")

    def samples(self, in_hand: int, expected: int) -> None:
        """Show how far the stage is."""
        if self._task is not None:
            self._progress.update(self._task, completed=in_hand, total=expected)

    def say(self, message: str) -> None:
        """Print a message above the bars."""
        self._progress.console.print(message, highlight=False, markup=False, soft_wrap=True)

    def note(self, text: str) -> None:
        """Show a remark beside the bar."""
        if self._task is not None:
            self._progress.update(self._task, note=text)

    def show(self, stage: str, done: int, total: int) -> None:
        """Show how far a stage is, and begin it where it is not the one that is shown."""
        if stage != self._title:
            self.stage(stage)
        self.samples(done, total)

    def end(self) -> None:
        """Complete the stage that is shown."""
        for task in self._progress.tasks[-1:]:
            total = task.total or 1
            self._progress.update(task.id, total=total, completed=total)


@contextmanager
def shown_progress() -> Iterator[ProgressBars]:
    """Show progress on stderr while the body runs."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:24}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        bars = ProgressBars(progress)
        yield bars
        bars.end()


@contextmanager
def progress_if_any() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress from the first call on; most jobs are over before there is any."""
    with ExitStack() as stack:
        shown: list[ProgressBars] = []

        def show(stage: str, done: int, total: int) -> None:
            if not shown:
                shown.append(stack.enter_context(shown_progress()))
            shown[0].show(stage, done, total)

        yield show
