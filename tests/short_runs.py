"""A drive whose motions are short, and observers of a job that nobody watches."""

from dataclasses import replace

from edge_ident.drive.description import Drive, load_drive


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


def brief_drive(shorter: float = 4.0) -> Drive:
    """The built-in drive on a part of its default motion, in the same part of the time.

    Parameters
    ----------
    shorter : float
        A quarter is long enough for the default motion, a half for a multisine.
    """
    drive = load_drive()
    return replace(
        drive,
        angular_frequency_rad_s=shorter * drive.angular_frequency_rad_s,
        lead_in_s=2.0,
        axes={
            name: replace(axis, amplitude_rad=axis.amplitude_rad / shorter)
            for name, axis in drive.axes.items()
        },
    )
