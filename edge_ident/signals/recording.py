"""What a drive did: position and effort over time, per axis."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from edge_ident.errors import DataError
from edge_ident.model.model import inertia_unit
from edge_ident.support.rows import Readable
from edge_ident.support.words import listed

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sampling:
    """What the samples of an axis told before they were decimated.

    Attributes
    ----------
    period_s : float
        Mean sampling period of the recording.
    jitter : float
        Largest deviation of a time stamp from an even grid, in sampling periods.
    count : float
        Encoder resolution, 0 where there is none.
    position_noise, effort_noise : float
        Standard deviations of the white noise.
    cutoff_hz : float
        Of the filter of the identification.
    begin_s : float
        From the first sample of the recording to the first after decimation.
    unknown : (N,) array of bool
        Samples after decimation inside a gap of the time stamps, or with a clipped effort.
    """

    period_s: float
    jitter: float
    count: float
    position_noise: float
    effort_noise: float
    cutoff_hz: float
    begin_s: float
    unknown: NDArray[np.bool_]


@dataclass(frozen=True)
class AxisRecord:
    """One axis of a recording; every array has one value per time stamp.

    Attributes
    ----------
    position, effort : (N,) arrays
        In the units that `position_unit` and `effort_unit` name.
    position_unit : "rad" or "m"
    effort_unit : "N*m", "N", "A" or "V"
    reference, velocity, temperature_c : (N,) arrays or None
    sampling : Sampling or None
        Of samples that were decimated; None for those that were recorded.

    Examples
    --------
    >>> import edge_ident
    >>> axis = edge_ident.simulate().axes["x"]
    >>> axis.position_unit, axis.effort_unit
    ('rad', 'N*m')
    """

    position: Array
    effort: Array
    position_unit: str
    effort_unit: str
    reference: Array | None = None
    velocity: Array | None = None
    temperature_c: Array | None = None
    sampling: Sampling | None = None

    @property
    def units(self) -> tuple[str, str]:
        """Units of position and effort."""
        return self.position_unit, self.effort_unit

    @property
    def parameter_units(self) -> tuple[str, str, str, str]:
        """Units of inertia, viscous friction, Coulomb friction and offset."""
        effort, position = self.effort_unit, self.position_unit
        return inertia_unit(position, effort), f"{effort}*s/{position}", effort, effort


@dataclass(frozen=True)
class PassiveAxis:
    """An axis that no drive moves, such as a pendulum on a carriage: it acts on the others.

    Attributes
    ----------
    position : (N,) array
    position_unit : "rad" or "m"

    Examples
    --------
    >>> import edge_ident
    >>> import numpy as np
    >>> edge_ident.PassiveAxis(np.zeros(5000), "rad").position_unit
    'rad'
    """

    position: Array
    position_unit: str


@dataclass(frozen=True, repr=False)
class Recording(Readable):
    """A measured motion.

    `table` has a row for each axis.

    Attributes
    ----------
    time_s : (N,) array
        Increasing; uneven sampling is allowed.
    axes : mapping of axis name to AxisRecord
    source : str
        File or board that it came from, for messages.
    effort_shift_s : float
        Time from a row's stamp to the middle of the interval in which its effort acted.
    begin_s : float
        From the first sample of an earlier recording of the machine to its own, where what changes
        in the course of time goes on. Files do not hold it.
    stamp_jitter : float
        Rms of the jitter that was taken out of the time stamps, in sampling periods; 0 where they
        are those recorded (`edge_ident.signals.time_stamps`).
    lost_rows : int
        Rows that were found to be missing although the time stamps did not say so
        (`edge_ident.signals.time_stamps`).
    passive : mapping of axis name to PassiveAxis
        Axes without an effort.

    Examples
    --------
    >>> import edge_ident
    >>> import numpy as np
    >>> time_s = 0.002 * np.arange(5000)
    >>> axis = edge_ident.AxisRecord(np.sin(time_s), np.cos(time_s), "rad", "N*m")
    >>> edge_ident.Recording(time_s, {"x": axis}, "a test").source
    'a test'
    """

    time_s: Array
    axes: Mapping[str, AxisRecord]
    source: str
    effort_shift_s: float = 0.0
    begin_s: float = 0.0
    stamp_jitter: float = 0.0
    lost_rows: int = 0
    passive: Mapping[str, PassiveAxis] = field(default_factory=dict)

    @property
    def positions(self) -> dict[str, Array]:
        """Position (N,) of every axis, those that a drive moves first."""
        return {name: axis.position for name, axis in self._every.items()}

    @property
    def turning(self) -> frozenset[str]:
        """Axes whose positions are angles."""
        return frozenset(n for n, axis in self._every.items() if axis.position_unit == "rad")

    @property
    def _every(self) -> Mapping[str, AxisRecord | PassiveAxis]:
        return {**self.axes, **self.passive}


def driven_in(recordings: Iterable[Recording], names: Collection[str]) -> list[Recording]:
    """Those recordings in which all axes of these names are driven."""
    return [each for each in recordings if all(name in each.axes for name in names)]


def chosen_axes(source: str, every: Collection[str], wanted: Collection[str]) -> list[str]:
    """Names of the axes that are wanted, in that order; all of a recording where none is.

    Raises
    ------
    DataError
        The recording has no such axis.
    """
    unknown = [name for name in wanted if name not in every]
    if unknown:
        raise DataError(f"{source} has no axis {listed(unknown)}", f"it has {listed(every)}")
    return list(dict.fromkeys(wanted or every))
