"""Who wants to see how far a job is."""

from typing import Protocol


class Observer(Protocol):
    """Sees the progress of a job on a board."""

    def stage(self, title: str) -> None:
        """Call when a stage begins."""

    def samples(self, in_hand: int, expected: int) -> None:
        """Call as captured samples arrive."""

    def say(self, message: str) -> None:
        """Call with what the person at the machine should know."""
