"""Which host holds the board, for how long still, and when it was last heard."""

from collections import deque
from collections.abc import Callable
from typing import Final

from firmware_interface.registers import SESSION_LEASE_S

FREE: Final = 0
"""No host's key."""
_STOPPED_REMEMBERED: Final = 8


class Session:
    """The holder's key, its lease, and the silence that the watchdog measures.

    Nobody else's frames count: neither a foreign host nor a mere reader keeps a motion alive.
    Whoever stops the machine ends the hold. The stopped host may know nothing of it yet, so its key
    holds the board no more; under another one it comes as a new host.

    Parameters
    ----------
    now_s : callable
        The clock of lease and watchdog.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._key = self._released = FREE
        self._stopped: deque[int] = deque(maxlen=_STOPPED_REMEMBERED)
        self._lease_s = self._heard_s = now_s()

    @property
    def key(self) -> int:
        """The holder's, or FREE."""
        return self._key if self.remaining_s > 0.0 else FREE

    @property
    def remaining_s(self) -> float:
        """What is left of the lease; 0 when nobody holds the board."""
        if self._key == FREE:
            return 0.0
        return max(self._lease_s + SESSION_LEASE_S - self._now_s(), 0.0)

    @property
    def silence_s(self) -> float:
        """Time since the holder was heard."""
        return self._now_s() - self._heard_s

    def may_claim(self, key: int, *, heartbeat: bool) -> bool:
        """Whether the board is free, or held by this key already, which nobody has stopped.

        A heartbeat of the host that let go last comes late.
        """
        late = heartbeat and key == self._released
        return self.key in (FREE, key) and key not in self._stopped and not late

    def heard(self, key: int) -> None:
        """The host of this key, which may claim the board, wrote it or a command."""
        self._key, self._released = key, FREE
        self._lease_s = self._heard_s = self._now_s()

    def keep(self) -> None:
        """Hold on while something guards what the host began, and will end it."""
        if self.key != FREE:
            self._lease_s = self._now_s()

    def stopped_by(self, key: int) -> None:
        """A host of this key stops the machine: the hold of another one ends, even one run out."""
        if self._key not in (FREE, key):
            self._stopped.append(self._key)
            self._key = FREE

    def release(self) -> None:
        """Nobody holds the board."""
        self._key, self._released = FREE, self._key
