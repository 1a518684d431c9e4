"""Errors that a user can act on, base of the tree drawn in `edge_ident.errors`.

EdgeIdentError
├── LinkError         the line between host and board failed (exit code 3)
│   ├── NoReplyError        no answer in time; a write may or may not have reached the board
│   └── ChangedWordError    a word came out as another one
└── BoardError        the board refused a command or is in fault (exit code 4)
    ├── ValueRefusedError   a value is outside its register's range
    ├── MotionRefusedError  a motion would leave the board's limits; nothing has moved
    ├── BusyError           another host controls the board, or an axis moves
    ├── OvertakenError      a command of another host came right after this host's
    ├── StoppedError        another host stopped this one, or used the board meanwhile
    ├── SilentError         the board heard nothing of this host during a motion
    └── RestartedError      it was off since it was asked before
"""


class EdgeIdentError(Exception):
    """Something the user can put right.

    Parameters
    ----------
    cause : str
        One line: what went wrong, with the name, number or place that shows it.
    next_step : str
        One line: what to do about it.

    Attributes
    ----------
    exit_code : int
        Of a command that it ends.
    code : str
        What failed, for scripts.
    """

    exit_code = 1
    code = "other"

    def __init__(self, cause: str, next_step: str) -> None:
        super().__init__(cause)
        self.cause = cause
        self.next_step = next_step

    def __str__(self) -> str:
        """Both lines, as a traceback shows them."""
        return f"{self.cause}\nnext step: {self.next_step}"


class LinkError(EdgeIdentError):
    """The link is at fault: no port, no answer, a broken frame, a lost page."""

    exit_code = 3
    code = "link"


class NoReplyError(LinkError):
    """The link stayed silent: whether a write was carried out must be read back."""


class BoardError(EdgeIdentError):
    """The board is at fault, or right to refuse: wrong map, wrong state, latched fault."""

    exit_code = 4
    code = "board"


class ValueRefusedError(BoardError):
    """A value is outside its register's range."""


class MotionRefusedError(BoardError):
    """A motion would leave the limits of travel, speed, acceleration or effort."""


class BusyError(BoardError):
    """Another host holds the board, or it moves and does not take this now."""


class OvertakenError(BoardError):
    """The board says what became of another host's command, and no longer of this host's.

    Parameters
    ----------
    command : str
    """

    def __init__(self, command: str) -> None:
        super().__init__(
            f"what became of {command} is not known: a command of another host came right after it",
            "make sure that no other host uses the board, then try again",
        )


class StoppedError(BoardError):
    """Another host stopped this one, or used the board while this one's hold had run out.

    Parameters
    ----------
    cause : str
    """

    def __init__(self, cause: str) -> None:
        super().__init__(cause, "find out who, and why, before you start again")


class SilentError(BoardError):
    """The board's watchdog ended a motion, because its host fell silent."""

    def measured(self, held_up_s: float, longest_reply_s: float, damaged: int = 0) -> None:
        """Say what this host measured meanwhile, and what to do about the worse of the two.

        Parameters
        ----------
        held_up_s : float
            Longest time that its process did not run when it was due.
        longest_reply_s : float
            Longest time of a request.
        damaged : int
            Requests after which bytes came that were no reply.
        """
        self.cause += (
            f"; this process did not run for {held_up_s:.2f} s at a time, and the slowest request "
            f"took {longest_reply_s:.2f} s"
        )
        self.cause += f"; {damaged} replies came damaged" if damaged else ""
        self.args = (self.cause,)
        if held_up_s > longest_reply_s and not damaged:
            self.next_step = (
                "close programs that load this computer, then run edge-ident clear-fault"
            )
        else:
            self.next_step = (
                "check cable, adapter and whatever stands between host and board, then run "
                "edge-ident clear-fault"
            )


class ChangedWordError(LinkError):
    """A word came out as another one, where no checksum covers it.

    Parameters
    ----------
    shows : str
        In what it shows.
    """

    def __init__(self, shows: str) -> None:
        super().__init__(
            f"{shows}: the line changes words",
            "check cable, shield and ground, and that nobody moves an axis by hand; then start the "
            "command again",
        )


class RestartedError(BoardError):
    """The board was off since it was asked before, or is another one.

    Parameters
    ----------
    nonce : int
        The number that it drew at its power-up.
    """

    def __init__(self, nonce: int) -> None:
        super().__init__(
            "the board has restarted, or another one answers in its place",
            "check its power supply, then start again; gains that were not stored are lost. If it "
            "is another board, the axes of the first one may still produce effort: use its wired "
            "emergency stop",
        )
        self.nonce = nonce
