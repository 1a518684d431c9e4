"""What a survey found: a row for each recording, and how its units compare."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from edge_ident.diagnosis.result import Kind
from edge_ident.support.rows import Readable


@dataclass(frozen=True)
class Found:
    """A file of the folder.

    Attributes
    ----------
    path : Path
    name : str
        Path inside the folder, with slashes.
    unit : str
    """

    path: Path
    name: str
    unit: str


@dataclass(frozen=True)
class Value:
    """A number with its standard deviation, None where that is unknown, and its unit."""

    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class SurveyedCause:
    """A cause that the diagnosis of a recording found.

    Attributes
    ----------
    effect : str
    kind : {"supported", "suspected", "minor"}
    share, share_std : float
        Of the rms effort, with its standard deviation.
    parameters : mapping of name to Value
    alternatives : tuple of str
        Effects that this recording does not separate from it.
    evidence : str
    """

    effect: str
    kind: Kind
    share: float
    share_std: float
    parameters: Mapping[str, Value]
    alternatives: tuple[str, ...]
    evidence: str


@dataclass(frozen=True)
class SurveyedAxis:
    """What one recording says of an axis.

    Attributes
    ----------
    parameters : mapping of name to Value
        Friction is the line through the friction curve, `effective` of `identify --json`;
        deviations include the model error.
    source : str
        Which estimate they are: `parameters_from` of `identify --json`.
    trusted : bool
    verdict : {"adequate", "explained", "partly_explained", "unexplained"} or None
        None where the base model is not adequate and there was no diagnosis, and where the data
        contradict themselves, as with a wrong sign of the effort.
    relative_residual : float
    causes : tuple of SurveyedCause
        Supported ones first.
    not_testable : tuple of str
        Effects that this motion does not excite.
    warnings : mapping of code to (message, next step)
    """

    parameters: Mapping[str, Value]
    source: str
    trusted: bool
    verdict: str | None
    relative_residual: float
    causes: tuple[SurveyedCause, ...]
    not_testable: tuple[str, ...]
    warnings: Mapping[str, tuple[str, str]]


@dataclass(frozen=True)
class Failed:
    """Why a recording has no result, and what to do.

    Attributes
    ----------
    code : str
        As in the error documents: "data", "model", "file", "internal"; "ended" where the process
        that analysed it did.
    cause, next_step : str
    """

    code: str
    cause: str
    next_step: str


@dataclass(frozen=True)
class SurveyedRecording:
    """One recording of the folder.

    Attributes
    ----------
    file : str
        Path inside the folder.
    unit : str
        Whose recording it is: the name of its subfolder, else of the file.
    sha256 : str
        Of the file; empty where it could not be read.
    axes : mapping of axis name to SurveyedAxis
        Empty where it failed.
    failed : Failed or None
    duration_s : float
        That the analysis took.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "machines/first.csv")
    >>> (recording,) = edge_ident.survey("machines", jobs=1).recordings
    >>> recording.unit, recording.axes["x"].trusted, recording.failed
    ('first', True, None)
    """

    file: str
    unit: str
    sha256: str
    axes: Mapping[str, SurveyedAxis]
    failed: Failed | None
    duration_s: float


@dataclass(frozen=True)
class UnitValue:
    """A unit's value of a compared quantity.

    Attributes
    ----------
    value, std : float
    distance : float or None
        From the other units, in deviations of the difference; None with too few units.
    stands_out : bool
    """

    value: float
    std: float
    distance: float | None
    stands_out: bool


@dataclass(frozen=True)
class Comparison:
    """One quantity of all units.

    Attributes
    ----------
    axis : str
    quantity : str
        A parameter, or effects that the recordings do not separate, joined by "/".
    of_effect : bool
        Whether the quantity is an effect's share of the rms effort.
    unit : str
    centre, between : float or None
        Of the units that do not stand out, with the deviation of their true values; None with too
        few units.
    units : mapping of unit to UnitValue
    """

    axis: str
    quantity: str
    of_effect: bool
    unit: str
    centre: float | None
    between: float | None
    units: Mapping[str, UnitValue]


@dataclass(frozen=True)
class StandsOut:
    """A unit that stands out in a quantity."""

    unit: str
    comparison: Comparison

    @property
    def found(self) -> UnitValue:
        """Its value."""
        return self.comparison.units[self.unit]

    @property
    def deviations(self) -> float:
        """Distance from the other units, in deviations of the difference."""
        return abs(self.found.distance or 0.0)


@dataclass(frozen=True, repr=False)
class Survey(Readable):
    """What was found out about the recordings of a folder.

    `table` has a row for each axis of each recording, and one for each recording that failed.

    Attributes
    ----------
    recordings : tuple of SurveyedRecording
        By file name.
    comparisons : tuple of Comparison
        Each parameter of each axis, and each effect that was found anywhere.
    left_out : tuple of str
        Files that are no recordings by their ending.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.save_recording(edge_ident.simulate(), "machines/first.csv")
    >>> found = edge_ident.survey("machines", jobs=1)
    >>> [recording.unit for recording in found.recordings]
    ['first']
    >>> found.trusted, found.standing_out
    (True, ())
    """

    recordings: tuple[SurveyedRecording, ...]
    comparisons: tuple[Comparison, ...]
    left_out: tuple[str, ...]

    @property
    def failed(self) -> tuple[SurveyedRecording, ...]:
        """Recordings without a result."""
        return tuple(recording for recording in self.recordings if recording.failed)

    @property
    def units(self) -> tuple[str, ...]:
        """Names of the units that have a result."""
        return tuple(dict.fromkeys(r.unit for r in self.recordings if not r.failed))

    @property
    def trusted(self) -> bool:
        """Whether every recording has a result, and every axis is trusted."""
        return not self.failed and all(
            axis.trusted for recording in self.recordings for axis in recording.axes.values()
        )

    @property
    def standing_out(self) -> tuple[StandsOut, ...]:
        """Units that stand out, with the quantity; the most distant first."""
        found = [
            StandsOut(unit, comparison)
            for comparison in self.comparisons
            for unit, value in comparison.units.items()
            if value.stands_out
        ]
        return tuple(sorted(found, key=lambda one: -one.deviations))
