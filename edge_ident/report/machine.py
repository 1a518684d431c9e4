"""A machine and its board: description, hidden faults, registers, and the latency of a run."""

import dataclasses
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from edge_ident.commissioning import described_drive, latency, register_access
from edge_ident.drive.description import drive_text
from edge_ident.report.view import Grid, Line, Parts
from edge_ident.support.documents import atomic_write
from firmware_interface import board_types, received
from firmware_interface.plant.hiding import Fault
from firmware_interface.register import Register

# A drive description as a document.


def drive_document(made: described_drive.DescribedDrive, file: Path) -> dict[str, Any]:
    """Schema edge-ident/drive/1: under `drive` the tables and keys of the file.

    Parameters
    ----------
    made : DescribedDrive
    file : Path
        Where the description was written.
    """
    return {
        "schema": "edge-ident/drive/1",
        "file": str(file),
        "drive": tomllib.loads(drive_text(made.drive, made.origins)),
        "assumed": list(made.assumed),
    }


# Faults that were hidden in a virtual drive: what they are in truth.


def fault_documents(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Field `hidden` of a document."""
    return [{**dataclasses.asdict(fault), "values": dict(fault.values)} for fault in faults]


def fault_lines(faults: Sequence[Fault]) -> list[str]:
    """One line for each fault."""
    return [f"hidden in {fault.axis}: {fault.effect}, {_size(fault)}" for fault in faults]


def _size(fault: Fault) -> str:
    """Size of a fault as it was given, and in its unit where that is another."""
    given = f"{fault.strength:.3g} {fault.measure}"
    if fault.unit in (fault.measure, "1"):
        return given
    return f"{given} ({fault.size:.3g} {fault.unit.replace('*', '·')})"


# The register map and the values of a board, as a document and as lines of text.

Values = Mapping[str, tuple[float, ...]]


def registers_document(
    chosen: Sequence[Register], values: Values, map_version: int
) -> dict[str, Any]:
    """Schema edge-ident/registers/1.

    Parameters
    ----------
    chosen : sequence of Register
    values : mapping of register name to tuple of float
        What a board answered; empty without a board.
    map_version : int
    """
    return {
        "schema": "edge-ident/registers/1",
        "map_version": map_version,
        "map_crc": board_types.MAP_CRCS[map_version],
        "registers": [_row(register, values.get(register.name)) for register in chosen],
    }


def register_lines(chosen: Sequence[Register], values: Values, map_version: int) -> Iterator[str]:
    """One line a register, after one line with the map's version.

    Of a board: name, value with unit, and what it is. Of the map alone: columns separated by tabs.
    """
    yield f"map version {map_version}, CRC {board_types.MAP_CRCS[map_version]:08x}"
    if not values:
        yield from ("\t".join(_line(register)) for register in chosen)
        return
    shown = {of.name: _shown(of, values[of.name]) for of in chosen if of.name in values}
    names, texts = (max(map(len, each), default=0) for each in (shown, shown.values()))
    for register in chosen:
        if (text := shown.get(register.name)) is not None:
            yield f"{register.name:<{names}}  {text:<{texts}}  {register.description}".rstrip()


def values_text(values: Sequence[float]) -> str:
    """Values as text."""
    return " ".join(f"{value:.9g}" for value in values)


def _row(register: Register, values: tuple[float, ...] | None) -> dict[str, Any]:
    row = asdict(register)
    if values is not None:
        row["values"] = [value if math.isfinite(value) else None for value in values]
        row["believable"] = _valid(register, values)
    return row


def _shown(register: Register, values: tuple[float, ...]) -> str:
    """The values as a person reads them, with their unit, and whether a board may not send them."""
    code = register_access.code_name(register, values[0]) if register.count == 1 else None
    whole = register.type != "f32" and register.scale == 1.0
    digits = ".0f" if whole else ".6g"
    text = code or " ".join(f"{value:{digits}}" for value in values)
    unit = f" {register.unit}" if register.unit else ""
    return text + unit + ("" if _valid(register, values) else " (invalid)")


def _line(register: Register) -> list[str]:
    """The columns of a register in the map."""
    kind = register.type if register.count == 1 else f"{register.type}[{register.count}]"
    limits = "" if register.minimum is None else f"{register.minimum:g}…{register.maximum:g}"
    line = [f"{register.address:#06x}", register.name, kind, f"{register.scale:g}", register.unit]
    return [*line, register.access, limits, register.description]


def _valid(register: Register, values: tuple[float, ...]) -> bool:
    """Whether the board may send this; what a host has yet to write may be anything."""
    return register.access == "rw" or all(received.valid_value(register, value) for value in values)


# The stages of a latency profile as a waterfall: each begins where the median of the last ends.

_WHOLE: Final = "total"
_CELLS: Final = 24
_ROW, _TITLE = 20, 40  # pixels
_BARS: Final = 620  # pixels of the longest run


@dataclass(frozen=True)
class Bar:
    """One stage: where it begins, and how long it takes.

    Attributes
    ----------
    stage : str
    begin_ms : float
        Sum of the medians before it.
    times : Spread
    """

    stage: str
    begin_ms: float
    times: latency.Spread

    @property
    def slow_end_ms(self) -> float:
        """Where it ends in 99 of 100 repetitions."""
        return self.begin_ms + self.times.p99


def bars(run: latency.ProfileRun) -> list[Bar]:
    """The stages of a run one after the other, without their sum."""
    found, begin_ms = [], 0.0
    for stage, times_ms in run.stages_ms.items():
        if stage != _WHOLE:
            found.append(Bar(stage.replace("_", " "), begin_ms, latency.spread(times_ms)))
            begin_ms += found[-1].times.p50
    return found


def bar_texts(run: latency.ProfileRun) -> Iterator[str]:
    """For each stage but the sum, its place in the whole as characters: the median dark, the rest
    to p99 light."""
    every = bars(run)
    per_ms = _CELLS / max(bar.slow_end_ms for bar in every)
    for bar in every:
        begin, middle, end = (
            round(per_ms * ms)
            for ms in (bar.begin_ms, bar.begin_ms + bar.times.p50, bar.slow_end_ms)
        )
        yield " " * begin + "█" * max(middle - begin, 1) + "░" * (end - max(middle, begin + 1))


def save_waterfall(profile: latency.Profile, file: Path) -> None:
    """Write the waterfalls of all runs of a profile, one below the other, as an SVG picture."""
    from edge_ident.report.page.rendering import picture  # loads jinja2

    runs, top = [], 0
    for run in profile.runs:
        every, whole = bars(run), latency.spread(run.stages_ms[_WHOLE])
        title = (
            f"{run.start}, {run.precision}: {whole.p50:.1f} ms in the median, "
            f"{whole.p99:.1f} ms in 99 of 100 repetitions"
        )
        runs.append((top + _TITLE, title, _BARS / max(bar.slow_end_ms for bar in every), every))
        top += _TITLE + _ROW * len(every)
    with atomic_write(file) as partial:
        partial.write_text(picture("waterfall", runs, top + _ROW), encoding="utf-8")


# A latency profile as tables.


def profile_view(profile: latency.Profile) -> Parts:
    """Percentiles of every stage, a table for each start and precision, and the verdict."""
    return (
        Line(f"{profile.device}; {profile.machine}; {profile.repetitions} repetitions"),
        *(_stages(run) for run in profile.runs),
        Line(profile.ways),
        Line(f"{profile.verdict} (target {latency.TARGET_MS:.0f} ms)"),
    )


def _stages(run: latency.ProfileRun) -> Grid:
    rows = []
    for (stage, times), bar in zip(run.stages_ms.items(), [*bar_texts(run), ""], strict=True):
        of_stage = latency.spread(times)
        values = (of_stage.p50, of_stage.p95, of_stage.p99, of_stage.maximum)
        rows.append((stage.replace("_", " "), *(f"{value:.2f}" for value in values), bar))
    title = f"{run.start}, {run.precision}, {run.graph.replace('_', '-')} graph (ms)"
    return Grid(title, ("stage", "p50", "p95", "p99", "max", "█ p50, ░ p99"), rows)
