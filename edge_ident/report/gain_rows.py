"""Gains as people read them: a row for each gain, and one for a whole table or a ripple."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Final

import numpy as np

from edge_ident.commissioning.gain_transfer import change_factor
from edge_ident.control.drive_gains import GainDesigns
from edge_ident.control.gain_design import GainDesign
from edge_ident.report.chart import Chart, Layer, across, around, of_axes
from edge_ident.report.view import Grid, Line, Part, ResultView
from edge_ident.support.rows import Cell, Table, table_of
from firmware_interface.gains import AxisGains, numbers_in_use

_RIPPLE: Final = "ripple_"


@dataclass(frozen=True)
class GainRow:
    """A gain, a table or a ripple of one or more banks.

    Attributes
    ----------
    name : str
        Field of `AxisGains`; `ripple 1` and so on for a ripple.
    entries : int
        Of a table; 0 for anything else.
    values : tuple of tuple of float
        Of each bank: one number, the entries of a table, or cosine, sine (N*m), period (rad) and
        fade speed (rad/s) of a ripple.
    """

    name: str
    entries: int
    values: tuple[tuple[float, ...], ...]

    @property
    def label(self) -> str:
        """The name in words, with the number of entries of a table."""
        words = gain_label(self.name)
        return f"{words} ({self.entries})" if self.entries else words

    def cells(self, digits: int) -> list[str]:
        """What each bank holds.

        Parameters
        ----------
        digits : int
            Of a number that stands alone; the ends of a table have two.
        """
        return [self._cell(numbers, digits) for numbers in self.values]

    def _cell(self, numbers: tuple[float, ...], digits: int) -> str:
        if self.entries:
            ends = dict.fromkeys((f"{min(numbers):.2g}", f"{max(numbers):.2g}"))
            return " to ".join(ends)
        if len(numbers) == 1:
            return f"{numbers[0]:.{digits}g}"
        amplitude = math.hypot(*numbers[:2])
        return f"{amplitude:.3g} N·m every {numbers[2]:.4g} rad" if amplitude else ""

    @property
    def change(self) -> str:
        """What the second bank changes: a factor, or the difference from zero; empty if nothing.

        Of a table the largest difference of an entry.
        """
        if len(self.values) < 2:
            return ""
        old, new = (np.array(numbers, np.float32) for numbers in self.values[:2])
        if np.array_equal(old, new):
            return ""
        if self.entries:
            return f"by up to {np.max(np.abs(new - old)):.2g}"
        return "changed" if len(old) > 1 else _factor(float(old[0]), float(new[0]))


def gain_label(name: str) -> str:
    """A gain's name in words, its unit in brackets where the name holds it."""
    for ending, unit in (("_rad_s", "rad/s"), ("_rad", "rad"), ("_s", "s")):
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")


def _factor(old: float, new: float) -> str:
    factor = change_factor(old, new)
    if math.isinf(factor):
        return f"{new - old:+.3g}"
    return f"× {factor:.3g}" if new > old else f"/ {factor:.3g}"


def gain_rows(banks: Sequence[AxisGains]) -> list[GainRow]:
    """Rows of all that the banks use.

    Parameters
    ----------
    banks : sequence of AxisGains
        Of several axes, or of one axis at several times.
    """
    used = {name.partition("[")[0] for name in numbers_in_use(banks)}
    names = [of.name for of in fields(AxisGains) if of.name in used]
    rows = [_row(name, banks) for name in names if not name.startswith(_RIPPLE)]
    ripples = sorted({k for bank in banks for k in bank.ripples})
    return rows + [GainRow(f"ripple {k + 1}", 0, _ripples(banks, k)) for k in ripples]


def _row(name: str, banks: Sequence[AxisGains]) -> GainRow:
    values = [getattr(bank, name) for bank in banks]
    if isinstance(values[0], tuple):
        return GainRow(name, len(values[0]), tuple(values))
    return GainRow(name, 0, tuple((value,) for value in values))


def _ripples(banks: Sequence[AxisGains], k: int) -> tuple[tuple[float, ...], ...]:
    return tuple(
        (
            bank.ripple_cosine[k],
            bank.ripple_sine[k],
            bank.ripple_period_rad[k],
            bank.ripple_fade_speed_rad_s[k],
        )
        for bank in banks
    )


# Designs of all axes of a drive.


def designs_view(designs: GainDesigns) -> ResultView:
    """What is shown of designed gains."""
    return ResultView(
        partial(designs_table, designs),
        partial(designs_parts, designs.axes),
        partial(_charts, designs),
    )


def designs_parts(designs: Mapping[str, GainDesign]) -> Iterator[Part]:
    """Bandwidth, margins and gains, a column per axis; below, what became of each effect."""
    rows = _design_rows(list(designs.values()))
    headings = ("", *(f"axis {name}" for name in designs))
    yield Grid("gains, in N·m, rad and s", headings, list(rows))
    for name, design in designs.items():
        yield from (Line(f"  axis {name}: {of.effect}: {of.sentence}") for of in design.used)
    for name, design in designs.items():
        for unused in design.unused:
            yield Line(f"  axis {name}: {unused.effect} is not used: {unused.reason}")


def _design_rows(designs: Sequence[GainDesign]) -> Iterator[tuple[str, ...]]:
    yield "bandwidth (rad/s)", *(f"{d.bandwidth_rad_s:.4g}" for d in designs)
    yield "phase margin (°)", *(f"{d.phase_margin_deg:.4g}" for d in designs)
    yield "gain margin", *(f"{d.gain_margin:.4g}" for d in designs)
    for row in gain_rows([d.gains for d in designs]):
        yield row.label, *row.cells(4)


def designs_table(designs: GainDesigns) -> Table:
    """A row for each number of each axis's design: bandwidth, margins and gains."""

    def rows() -> Iterator[tuple[Cell, ...]]:
        for name, design in designs.axes.items():
            yield name, "bandwidth", 0, design.bandwidth_rad_s, "rad/s"
            yield name, "phase_margin", 0, design.phase_margin_rad, "rad"
            yield name, "gain_margin", 0, design.gain_margin, "1"
            for of in fields(design.gains):
                value = getattr(design.gains, of.name)
                numbers = value if isinstance(value, tuple) else (value,)
                for place, entry in enumerate(numbers):
                    yield name, of.name, place, float(entry), _unit(of.name)

    return table_of(("axis", "quantity", "place", "value", "unit"), rows())


def _unit(gain: str) -> str | None:
    """The unit that a gain's name holds."""
    label = gain_label(gain)
    return label.rpartition("(")[2].rstrip(")") if label.endswith(")") else None


# The designed loops in the frequency domain.


def _charts(designs: GainDesigns) -> list[list[Chart]]:
    """The open loop of every axis: magnitude above, phase below."""
    return of_axes({name: _loop_charts(name, designs) for name in designs.axes})


def _loop_charts(name: str, designs: GainDesigns) -> tuple[Chart, Chart]:
    design, loop = designs.axes[name], designs.loops[name]
    omega, magnitude = loop.omega_rad_s, np.abs(loop.response)
    phase = np.degrees(np.unwrap(np.angle(loop.response)))
    x, y = across(omega, "log"), across(magnitude, "log")
    across_it, ends = ("frequency", "rad/s"), np.array([x.low, x.high])
    one, half_turn = (Layer("line", "edge", ends, np.full(2, at)) for at in (1.0, -180.0))
    margins = (
        f"phase margin {design.phase_margin_deg:.0f}°",
        f"gain margin {design.gain_margin:.3g}",
    )
    curves = (Layer("line", "extended", omega, of) for of in (magnitude, phase))
    return (
        Chart("", ", ".join(margins), "", across_it, ("open loop, magnitude", ""), x, y,
              (one, next(curves))),
        Chart("", "", "", across_it, ("phase", "°"), x, around(np.append(phase, -180.0)),
              (half_turn, next(curves))),
    )  # fmt: skip
