"""What a person says of a file, beyond what stands in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real

from edge_ident.support.given import check_type


@dataclass(frozen=True)
class ReadOptions:
    """What a person says of a file, beyond what stands in it.

    Attributes
    ----------
    columns : mapping of str to str
        From a column's heading, with or without its unit, to its name in the contract.
    units : mapping of str to str
        From a column's heading to its unit, or to what one step of it stands for: `mm`,
        `1/8192 turn`.
    period_s : float or None
        Sampling period, which takes the place of a column of time.
    resolution : str or None
        Encoder counts per turn or length: `8192/turn`, `1000/mm`.
    rated_effort : str or None
        Effort that 100 % stands for: `2.4 Nm`.
    torque_constant : float or None
        In N·m/A. With it a current becomes a torque.
    delimiter : str or None
        comma, semicolon, tab or blanks; found out where it is None.
    decimal : str or None
        comma or point; found out where it is None.
    topic : str or None
        Of a bag, the topic to read; not needed where one alone has efforts.
    effort_encoding : str or None
        How the effort's numbers hold their sign (`edge_ident.signals.effort_encoding`): `uint16`
        for two's complement that was read without a sign, or `sign-magnitude`.
    effort_shift_s : float
        Time from a row's position to when its effort acted.
    axes : sequence of str
        Axes to read, all where it is empty; the others' columns may hold anything.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.ReadOptions({"pos": "x_position_m"}, units={"pos": "mm"}).units
    {'pos': 'mm'}
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    period_s: float | None = None
    resolution: str | None = None
    rated_effort: str | None = None
    torque_constant: float | None = None
    delimiter: str | None = None
    decimal: str | None = None
    topic: str | None = None
    effort_encoding: str | None = None
    effort_shift_s: float = 0.0
    axes: Sequence[str] = ()

    def __post_init__(self) -> None:
        for name in ("columns", "units"):
            check_type(getattr(self, name), Mapping, f'give {name}={{"heading": "..."}}')
        for name in ("period_s", "torque_constant"):
            if getattr(self, name) is not None:
                check_type(getattr(self, name), Real, f"give a number for {name}")
