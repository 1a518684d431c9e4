"""Whether the base model is enough for an axis: asked of every recording, in milliseconds.

Two things tell that it is not: what the model leaves is more than noise, or its parameters depend
on the regime of the motion more than noise makes them. Both are judged on signals in which noise is
small (`edge_ident.identification.compared_signals`). These leave out what is near a reversal, so a
third thing is asked of all samples: does the model leave more than gains may be designed from? A
wrong 'no' costs a diagnosis, a wrong 'yes' is a wrong answer, so the limits lean towards the
diagnosis.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.diagnosis.select.thresholds import STRUCTURE
from edge_ident.diagnosis.tolerance import TOLERANCE
from edge_ident.estimation.model_error import SMALLEST_EXCESS
from edge_ident.estimation.trust import RESIDUAL_LIMIT
from edge_ident.identification.compared_signals import ComparedSignals
from edge_ident.model.model import PARAMETERS
from edge_ident.signals.metrics import rms

Array = NDArray[np.float64]

LARGEST_MOVE: Final = 0.026
"""Relative move between regimes from which parameters were found to be off by 5 %."""
SIGNIFICANT: Final = 5.0
"""Deviations by noise from which a move counts: quantization makes tails."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class Adequacy:
    """How the base model does on an axis.

    Attributes
    ----------
    relative_residual : float
        In the band of the comparison.
    noise_ratio : float
        Residual over noise.
    spread : tuple of str
        Parameters that depend on the regime of the motion.
    largest_move : float
        Largest relative move of one of them.
    cutoff_hz : float
        Of the comparison. Nothing is said about what lies above it.
    everywhere : float
        Relative residual of least squares on all samples of the identification.
    """

    relative_residual: float
    noise_ratio: float
    spread: tuple[str, ...]
    largest_move: float
    cutoff_hz: float
    everywhere: float = 0.0

    @property
    def leaves_structure(self) -> bool:
        """Whether the residual is more than noise."""
        beyond = 1.0 - min(1.0, self.noise_ratio**-2)
        excess = self.relative_residual * float(np.sqrt(beyond))
        return self.noise_ratio > STRUCTURE.value and excess > SMALLEST_EXCESS

    @property
    def adequate(self) -> bool:
        """Whether nothing speaks against the base model."""
        return not (self.leaves_structure or self.spread or self._poor_fit)

    @property
    def tolerable(self) -> bool:
        """Whether the base model leaves less than a diagnosis would call worth naming."""
        return self.relative_residual < TOLERANCE and not self._poor_fit

    @property
    def _poor_fit(self) -> bool:
        return self.everywhere > RESIDUAL_LIMIT

    @property
    def reason(self) -> str:
        """What speaks against it, or for it, in words."""
        parts = []
        if self.leaves_structure:
            parts.append(
                f"the base model leaves {self.relative_residual:.2%} of the effort, "
                f"{self.noise_ratio:.1f} times the noise"
            )
        if self.spread:
            names = ", ".join(name.replace("_", " ") for name in self.spread)
            parts.append(
                f"without a part of the motion, the estimates of {names} move by up to "
                f"{self.largest_move:.1%}"
            )
        if self._poor_fit:
            parts.append(
                f"with the samples near reversals, the base model leaves {self.everywhere:.1%} of "
                "the effort"
            )
        noise = f"up to {self.cutoff_hz:.3g} Hz, what the base model leaves is noise"
        return "; ".join(parts) or noise


def judge(compared: ComparedSignals) -> Adequacy:
    """Judge the base model."""
    unit, length, found = compared.columns.unit, compared.columns.length, compared.parameters
    left, scale = rms(compared.residual), max(rms(compared.effort), _TINY)
    noise = float(np.sqrt(compared.noise[0] + found[0] ** 2 * compared.noise[1]))
    normal = unit.T @ unit + 1e-10 * np.eye(len(PARAMETERS))
    std = noise * np.sqrt(np.diag(np.linalg.inv(normal))) / length
    spread = compared.moves.beyond(std)
    relative = spread.largest_move / np.maximum(np.abs(found), _TINY)
    moved = (relative > LARGEST_MOVE) & (spread.significance > SIGNIFICANT)
    names = tuple(name for name, far in zip(PARAMETERS[:3], moved[:3], strict=True) if far)
    return Adequacy(
        left / scale,
        left / max(noise, _TINY),
        names,
        float(np.max(relative[:3], initial=0.0, where=moved[:3])),
        compared.band.cutoff_hz,
    )
