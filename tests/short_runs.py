"""A drive whose motions are short, and observers of a job that nobody watches."""

from dataclasses import replace
from typing import Final

from edge_ident.drive.description import Drive, load_drive

_SHORTER: Final = 4.0


class Silent:
    """Observer of a job that nobody watches."""

    def stage(self, title: str) -> None: ...

    def samples(self, in_hand: int, expected: int) -> None: ...

    def say(self, message: str) -> None: ...


class Listening(Silent):
    """Keeps what was said."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def say(self, message: str) -> None:
        self.said.append(message)


def brief_drive() -> Drive:
    """The built-in drive on a quarter of its default motion, in a quarter of the time."""
    drive = load_drive()
    return replace(
        drive,
        angular_frequency_rad_s=_SHORTER * drive.angular_frequency_rad_s,
        lead_in_s=2.0,
        axes={
            name: replace(axis, amplitude_rad=axis.amplitude_rad / _SHORTER)
            for name, axis in drive.axes.items()
        },
    )
