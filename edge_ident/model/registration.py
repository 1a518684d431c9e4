"""What an effect's file must hold: checked when the catalogue is loaded.

The rest of the project relies on these rules and does not check them again.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import fields, replace
from string import Formatter
from typing import Final

import numpy as np

from edge_ident.errors import ModelError
from edge_ident.model.effect import Effect, Over, no_draw
from edge_ident.model.model import PARAMETERS
from edge_ident.model.motion import Array, Motion
from edge_ident.model.search import Excitation, Form, Span
from edge_ident.support.given import check_type
from firmware_interface.gains import AxisGains

_UNITS: Final = {"effort": "N*m", "position": "rad", "inertia": "kg*m^2"}
# Hooks, and those of the other direction of which each requires one.
_TOGETHER: Final = (
    ("true_motion", "reading"),
    ("reading", "true_motion"),
    ("command", "torque", "transmitted"),
    ("torque", "command"),
    ("transmitted", "command"),
    ("withheld", "torque"),
)
# Hooks through one of which an effect acts.
_ACTING: Final = (
    "load", "friction", "inertia", "cross_inertia", "resistance", "reading", "torque",
    "transmitted", "recorded",
)  # fmt: skip
_GAINS: Final = frozenset(field.name for field in fields(AxisGains))
_LINEAR: Final = 1e-9  # relative deviation from proportionality that rounding explains
# Excitation by the motion along which linearity is checked.
_PROBE: Final = Excitation(
    lowest=-1.5,
    travel=3.0,
    speed=2.0,
    typical_speed=1.0,
    acceleration=4.0,
    effort=5.0,
    resolution=1e-4,
    duration_s=2.0,
    cutoff_hz=8.0,
    sampling_s=1e-3,
    base=np.array([0.5, 1.0, 1.0, 0.1]),
    spans=(Span(0, 0.0, 2.0),),
)


def check_effect(name: str, effect: object, catalogue: Collection[str]) -> None:
    """Check one effect of the catalogue.

    Parameters
    ----------
    name : str
        Of its file.
    effect : object
        What the file calls EFFECT.
    catalogue : collection of str
        Names of all effects.

    Raises
    ------
    ModelError
        The effect breaks rules of `RULES` or `OF_THE_CATALOGUE`; the message names the file and
        all that it breaks.
    """
    next_step = f"correct edge_ident/model/effects/{name}.py"
    if not isinstance(effect, Effect):
        raise _refusal(name, ["it holds no EFFECT, an instance of a subclass of Effect"], next_step)
    if effect.name != name:
        raise _refusal(name, [f"the class of its EFFECT is that of {effect.name}"], next_step)
    faults = _faults(effect, catalogue)
    if faults := faults or [fault for rule in OF_THE_CATALOGUE for fault in rule(effect)]:
        raise _refusal(name, faults, next_step)


def check_own_effect(effect: object, catalogue: Collection[str]) -> Effect:
    """Check an effect of a user's own: its physics, and how it is searched for.

    Raises
    ------
    ModelError
        It is no effect, or breaks rules of `RULES`; the message names all that it breaks.
    """
    if isinstance(effect, type) and issubclass(effect, Effect):
        name = effect.__name__
        raise ModelError(
            f"{name} is a class, and no effect yet", f"give {name}(search=SearchSpec(...))"
        )
    check_type(effect, Effect, "give an instance of your subclass of Effect")
    assert isinstance(effect, Effect)
    faults = _faults(effect, catalogue)
    if faults:
        raise _refusal(effect.name, faults, f"correct the class {type(effect).__name__}")
    return effect


def _faults(effect: Effect, catalogue: Collection[str]) -> list[str]:
    """All that an effect lacks to be searched for. What computes with it waits for the rest."""
    found = [fault for rule in RULES for fault in rule(effect)]
    found += [
        f"its alternative {other!r} is no other effect"
        for other in effect.search.alternatives
        if other == effect.name or other not in catalogue
    ]
    if found:
        return found
    try:
        return [*_grid(effect), *_linearity(effect)]
    except Exception as error:  # of the user's own code: anything
        return [f"its physics fails on a test motion: {type(error).__name__}: {error}"]


def _refusal(name: str, faults: Sequence[str], next_step: str) -> ModelError:
    return ModelError(f"effect {name}: {'; '.join(faults)}", next_step)


def _parameters(effect: Effect) -> Iterator[str]:
    """Parameters have names of their own, bounds, a unit that can be written, a valid default."""
    if not getattr(effect, "parameters", ()):
        yield "it has no parameters: parameters = (Parameter(name, unit, low, high, text), ...)"
        return
    names = [parameter.name for parameter in effect.parameters]
    if not names or len(set(names)) < len(names):
        yield "one of its parameters has no name, or two have the same"
    for parameter in effect.parameters:
        if not -np.inf < parameter.low < parameter.high < np.inf:
            yield f"parameter {parameter.name} has no finite bounds, the lower one first"
        if parameter.default is not None and not (
            parameter.low <= parameter.default <= parameter.high
        ):
            yield f"the default of parameter {parameter.name} is outside its bounds"
        try:
            parameter.unit.format(**_UNITS)
        except (KeyError, ValueError, IndexError):
            yield f"the unit of parameter {parameter.name} is no template over {', '.join(_UNITS)}"


def _search(effect: Effect) -> Iterator[str]:
    """The search has forms, which name parameters that there are."""
    search, known = effect.search, set(getattr(effect, "parameters", ()) and effect.bounds)
    if not search.forms:
        yield "its search has no form: SearchSpec(forms=(Form(linear, nonlinear),), grid=...)"
    nonlinear = {name for form in search.forms for name in form.nonlinear}
    named = {*search.linear, *nonlinear, *search.open_ended, *search.between_recordings}
    for name in sorted({*named, *search.essential} - known):
        yield f"its search names {name}, which is no parameter"
    for name in sorted(search.linear & nonlinear):
        yield f"{name} is linear in one form and nonlinear in another"
    if any(form.coupled for form in search.forms) and not (
        effect.needs_source or effect.takes_source
    ):
        yield "a form is coupled, and the effect takes no source axis"


def _grid(effect: Effect) -> Iterator[str]:
    """A grid has values for every nonlinear parameter."""
    search = effect.search
    grids = [f(_PROBE) for f in (search.grid, *(form.grid for form in search.forms)) if f]
    if any(len({len(values) for values in grid.values()}) > 1 for grid in grids):
        yield "the arrays of its grid differ in length"
    grid = {name for part in grids for name in part}
    for name in sorted(grid - set(effect.bounds)):
        yield f"its grid names {name}, which is no parameter"
    for name in sorted({name for form in search.forms for name in form.nonlinear} - grid):
        yield f"its grid has no values for {name}"


def _texts_and_draws(effect: Effect) -> Iterator[str]:
    """What a person reads of it, and random values for training."""
    search = effect.search
    if not (search.signature and search.experiment and search.alternatives):
        yield "its search lacks a signature, alternatives or an experiment"
    if effect.draw is no_draw:
        yield "it draws no random values for training"


def _hooks(effect: Effect) -> Iterator[str]:
    """Hooks come in pairs: what one direction does, the other undoes."""
    if not any(map(effect.overrides, _ACTING)):
        yield f"it overrides no hook, and does nothing: override one of {', '.join(_ACTING)}"
    for hook, *others in _TOGETHER:
        if effect.overrides(hook) and not any(map(effect.overrides, others)):
            missing = " or ".join(others)
            yield f"it overrides {hook} and not {missing}: both directions are one physics"
    if effect.overrides("cross_inertia") and not (effect.needs_source or effect.takes_source):
        yield "it overrides cross_inertia and takes no source axis"
    for name in sorted(set(effect.changes_base) - set(PARAMETERS)):
        yield f"changes_base names {name}, which is no base parameter"
    delay = effect.effort_delay
    if delay and (delay not in effect.bounds or not effect.overrides("recorded")):
        yield f"effort_delay names {delay}: that must be a parameter, and recorded must shift by it"


def _memory(effect: Effect) -> Iterator[str]:
    """An effect with memory has equations in both directions, and one scale where it resists."""
    if not effect.memory_size:
        if effect.memory_scale or effect.overrides("rates"):
            yield "it has a memory_scale or rates, and no memory_size"
        return
    if not effect.overrides("rates"):
        yield "it has memory and does not override rates"
    if effect.overrides("transmitted"):
        return
    if not effect.overrides("resistance"):
        yield "it has memory and overrides neither resistance nor transmitted"
    if effect.follows_base or effect.needs_source or effect.takes_source:
        yield "it has memory, and may then depend on neither the base parameters nor another axis"
    if any(form.linear != (effect.memory_scale,) for form in effect.search.forms):
        yield f"it has memory: every form must be linear in {effect.memory_scale or 'memory_scale'}"


def _linearity(effect: Effect) -> Iterator[str]:
    """The effort of an additive effect is linear in the linear parameters of each form."""
    if effect.additive:
        for form in effect.search.forms:
            if form.linear and not _is_linear(effect, form):
                yield f"its effort is not linear in {', '.join(form.linear)}"


def _is_linear(effect: Effect, form: Form) -> bool:
    """Whether the efforts of all linear parameters together, at twice their size, are twice the sum
    of their efforts alone."""
    motion, values = _probe_motion(), _probe_values(effect)
    alone = [effect.resistance(motion, {**values, name: np.ones(1)}) for name in form.linear]
    twice = effect.resistance(motion, {**values, **dict.fromkeys(form.linear, np.full(1, 2.0))})
    size = np.max(np.abs(alone))
    return bool(size > 0.0 and np.max(np.abs(twice - 2.0 * sum(alone))) <= _LINEAR * size)


def _probe_values(effect: Effect) -> dict[str, Array]:
    """Values to check an effect with: linear ones zero, nonlinear ones the first of the grid."""
    values = {
        p.name: np.full(1, 0.0 if p.default is None else p.default) for p in effect.parameters
    }
    values |= dict.fromkeys(effect.search.linear, np.zeros(1))
    return values | {name: grid[:1] for name, grid in effect.search.grid(_PROBE).items()}


def _probe_motion() -> Motion:
    """Two seconds to and fro, the other axis at another frequency."""
    time_s = np.linspace(0.0, _PROBE.duration_s, 100)

    def swing(rate: float) -> tuple[Array, Array, Array]:
        sine, cosine = np.sin(rate * time_s + 0.3), np.cos(rate * time_s + 0.3)
        return 1.5 * sine, 1.5 * rate * cosine, -1.5 * rate**2 * sine

    other = Motion.known(time_s, *swing(5.0))
    return Motion(**{**vars(Motion.known(time_s, *swing(4.0))), "source": other})


def _compensation(effect: Effect) -> Iterator[str]:
    """Gains use parameters that there are, or a reason says why they use none. Feed-forward ranks
    several terms of an effect by their linear parameters."""
    compensation = effect.compensation
    if compensation.used == bool(compensation.without):
        yield "its compensation must say what gains do about it, or why they do nothing"
    for name in sorted(compensation.parameters - set(effect.bounds)):
        yield f"its compensation names {name}, which is no parameter"
    if compensation.feedforward and effect.search.repeats and not effect.search.linear:
        yield "its feed-forward has no linear parameter, by which terms could be ranked"
    fed = {*compensation.feedforward.values(), *compensation.takes_over.values()}
    for gain in sorted(fed - _GAINS):
        yield f"its feed-forward names {gain}, which is no gain of the board's law"
    factors = {factor for factor in compensation.times.values() if isinstance(factor, str)}
    for name in sorted(factors - set(PARAMETERS)):
        yield f"its feed-forward is multiplied by {name}, which is no base parameter"
    if len(compensation.resonance) not in (0, 3):
        yield "its resonance must name an inertia, a rate and a damping ratio"
    if len(compensation.series_resonance) not in (0, 2):
        yield "its series_resonance must name one over its square, and a damping ratio"
    if compensation.at_end and not effect.changes_base:
        yield "its compensation follows base parameters in time, and it changes none"
    if compensation.over and not _depends_only(effect, compensation.over):
        yield f"its effort depends on more than {compensation.over} and direction"


def _depends_only(effect: Effect, over: Over) -> bool:
    """Whether the effort stays, along a motion that keeps the speed, or the position, alone."""
    if effect.memory_size or not effect.additive:
        return False
    motion, values = replace(_probe_motion(), source=None), _probe_values(effect)
    values |= dict.fromkeys(effect.search.linear, np.ones(1))
    other = replace(motion, time_s=motion.time_s + 3.0, acceleration=-2.0 * motion.acceleration)
    if over == "speed":
        other = replace(other, position=0.4 - 2.0 * motion.position)
    else:
        other = replace(other, velocity=1.7 * motion.velocity)
    effort = effect.resistance(motion, values)
    change = effect.resistance(other, values) - effort
    return bool(np.max(np.abs(change)) <= _LINEAR * np.max(np.abs(effort)))


def _advice(effect: Effect) -> Iterator[str]:
    """A person at the machine is told what it is, where to look, and what to do."""
    advice = effect.advice
    if not (advice.in_words and advice.part and advice.action):
        yield "its advice lacks everyday words, a part of the machine or an action"
    names = {name for _, name, _, _ in Formatter().parse(advice.size) if name is not None}
    for name in sorted(names - set(effect.bounds)):
        yield f"the size of its advice names {name}, which is no parameter"


RULES: Final[tuple[Callable[[Effect], Iterator[str]], ...]] = (
    _parameters,
    _search,
    _hooks,
    _memory,
)
"""Each yields the faults of an effect, in words. What computes with it comes after these."""
OF_THE_CATALOGUE: Final[tuple[Callable[[Effect], Iterator[str]], ...]] = (
    _texts_and_draws,
    _compensation,
    _advice,
)
"""What the effects of this project have as well."""
