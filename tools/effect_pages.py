"""Writes docs/effects.md, the catalogue of effects, from the effects' own files.

python -m tools.effect_pages            write the page
python -m tools.effect_pages --check    write nothing; exit code 1 when the page is out of date
"""

import inspect
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from edge_ident.model.effect import Effect, Parameter
from edge_ident.model.effects import catalogue
from edge_ident.model.model_files import unit_of
from tools.generated_page import write_or_check

PAGE: Final = Path(__file__).parents[1] / "docs" / "effects.md"
_UNBOUNDED: Final = 1e6  # bounds from here on say no more than that a number is finite
_TINY: Final = 1e-6
_INTRODUCTION: Final = """\
<!-- Generated from edge_ident/model/effects/*.py by tools/effect_pages.py; do not edit. -->
# The catalogue of effects

The base model of an axis is effort = inertia·a + viscous_friction·v + coulomb_friction·sign(v) +
offset. Each effect adds to it, and is one file under `edge_ident/model/effects`. The position x,
the velocity v, the acceleration a and the effort are those of the axis, in units of rad and N·m. A
parameter marked * is nonlinear: the diagnosis searches it over a grid.
"""


def main(arguments: list[str]) -> int:
    """Write the page, or check it."""
    return write_or_check(arguments, PAGE, render(), "tools.effect_pages")


def render() -> str:
    """The page's text."""
    return "\n".join([_INTRODUCTION, *_overview(), *_sections()]) + "\n"


def _overview() -> Iterator[str]:
    yield "| effect | how it shows |"
    yield "| --- | --- |"
    for name, effect in catalogue().items():
        yield f"| {_link(name)} | {effect.search.signature} |"
    yield ""


def _sections() -> Iterator[str]:
    for name, effect in catalogue().items():
        title, _, physics = (inspect.getdoc(inspect.getmodule(type(effect))) or "").partition("\n")
        yield f"## {name}"
        yield ""
        yield f"**{title}**"
        yield ""
        yield physics.strip().replace("\nSource:", "\n\nSource:")
        yield ""
        yield from _parameters(effect)
        yield f"- Looks like: {', '.join(map(_link, effect.search.alternatives))}."
        yield f"- Motion that shows it: {effect.search.experiment}."
        yield f"- Where to look: {effect.advice.part}. {effect.advice.action}"
        yield f"- Gains: {_compensation(effect)}."
        yield ""


def _parameters(effect: Effect) -> Iterator[str]:
    yield "| parameter | meaning | unit, range |"
    yield "| --- | --- | --- |"
    for parameter in effect.parameters:
        unit = unit_of(parameter, "rad", "N*m").replace("*", "·")
        mark = "" if parameter.name in effect.search.linear else " *"
        measure = ", ".join(filter(None, (unit, _range(parameter))))
        yield f"| `{parameter.name}`{mark} | {parameter.description} | {measure} |"
    yield ""


def _compensation(effect: Effect) -> str:
    compensation = effect.compensation
    used = []
    if compensation.feedforward:
        used.append("feed-forward of " + ", ".join(f"`{p}`" for p in compensation.feedforward))
    if compensation.over == "speed":
        bent = "where it bends, " if compensation.feedforward else ""
        used.append(f"{bent}a curve over speed, each way, as far as it was seen")
    if compensation.over == "position":
        used.append("a table over position, as far as it was seen")
    if compensation.resonance or compensation.series_resonance:
        used.append("the margins bear its resonance")
    if compensation.loop_delay:
        used.append("the margins bear its delay")
    if compensation.at_end:
        used.append("they fit the machine as it was at the end of the recording")
    if compensation.limit:
        used.append("feed-forward stays below its limit, and the design says what motion fits")
    if compensation.note:
        used.append(compensation.note)
    return "; ".join(used) or f"do not use it: {compensation.without}"


def _range(parameter: Parameter) -> str:
    low, high = parameter.low, parameter.high
    if low <= -_UNBOUNDED and high >= _UNBOUNDED:
        return ""
    if high >= _UNBOUNDED:
        return "> 0" if 0.0 < low <= _TINY else f"≥ {low:g}"
    return f"{low:g} to {high:g}"


def _link(name: str) -> str:
    return f"[{name}](#{name})"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
