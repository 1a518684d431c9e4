"""One axis whose effort is that of the base model alone."""

from dataclasses import dataclass

from edge_ident.model.model import Array, Term
from edge_ident.signals.conditioning import Signals


@dataclass(frozen=True)
class CompensatedAxis:
    """One axis, its effort compensated for known effects.

    Attributes
    ----------
    signals : Signals
        Their effort is that of the base model alone.
    effects_effort : (N,) array
        What the effects account for, filtered alike.
    effects : tuple of Term
    shift_s : float
        From a row's stamp to the middle of the interval in which its effort acted.
    position, effort : (N,) arrays
        On the even grid, as recorded; the effort less what the actuator withheld.
    effects_unfiltered : (N,) array
        What the effects account for along the motion, in step with the position.
    friction_line : (3,) array or None
        Viscous friction, Coulomb friction and offset of the line through what the effects add to
        the friction, over the samples in motion; None where they add nothing.
    tied_to_time : tuple of str
        Those of them that would act otherwise in a recording that begins later.
    """

    signals: Signals
    effects_effort: Array
    effects: tuple[Term, ...]
    shift_s: float
    position: Array
    effort: Array
    effects_unfiltered: Array
    tied_to_time: tuple[str, ...] = ()
    friction_line: Array | None = None
