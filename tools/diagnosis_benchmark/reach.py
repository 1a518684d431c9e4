"""How much a hidden fault adds to the effort, and whether any test could tell it from noise.

The truth of the benchmark. It comes from the plant alone and shares no formula with the diagnosis.
A sound twin makes the same motion as the faulty drive, so the difference of their efforts is the
fault's effort, sample by sample, and nothing else: neither noise nor the chance of two runs. What
the base model can express of it is projected out, with every shift that the base model may have.

The twin's chain swings along with a motor that rattles in a gap, and takes torque for that. No
recording shows this torque, because the faulty drive never gave it. And nobody knows how stiff the
chain of a sound drive is. So the effort is compared with all sound drives from the rigid one to the
twin, and the nearest counts. Those between are mixtures of the two: to first order in the
compliance, the torque that a chain takes beyond a rigid one is in proportion to it.

The ideal test knows this waveform, the twin and the noise. It does not know the base parameters,
the shift, the stiffness of a sound chain, and the motion but for its record. Its statistic is
normal with variance one, and its mean is the detectability index d (the generalized matched filter
of S. M. Kay, 'Fundamentals of Statistical Signal Processing', volume 2, 1998): the norm of the
whitened waveform beyond the nearest sound drive. No test in the same band does better. A diagnosis
does worse: it has to find the waveform first, among many.

Rounding errors are taken as white. On slow motions, with a coarse encoder, they have up to 1.5
times that variance in the band, and d is up to a fifth too large.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

from firmware_interface.plant import COUNT_RAD, SAMPLE_S
from firmware_interface.plant.plant import STEPS_PER_SAMPLE

Array = NDArray[np.float64]

# Steps of the plant by which efforts may act after their stamps, or before: 1.5 periods, which
# belong to the base model.
_SHIFTS: Final = range(-15, 16)
_COARSE: Final = 5  # of them tried first
_MARGIN: Final = 3  # samples beside an unknown direction that a shift may mix with it
# Waveforms are compared up to here. Sound chains swing from 19 Hz on, and nobody knows the phase of
# such a swing. No band of `diagnose` is wider either.
_BAND_HZ: Final = 20.0
# Distance from a turning point within which the motor may creep while the table sticks: a sound
# chain winds up by less than a count to either side. On slow motions that lasts for a second.
_WOUND_UP: Final = 2.0 * COUNT_RAD
_BLOCK: Final = 200  # samples
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class MeasurementNoise:
    """Noise of one recording, white each.

    Attributes
    ----------
    effort_nm : float
        Standard deviation.
    count_rad : float
        Of the encoder; its rounding error is even over one count.
    inertia, viscous_friction : float
        By which that error enters the balance of torques.
    """

    effort_nm: float
    count_rad: float
    inertia: float
    viscous_friction: float

    def covariance(self, lag: NDArray[np.intp]) -> Array:
        """Of two samples so far apart of effort less that of the measured motion.

        The differences over two and three samples that make velocity and acceleration of rounding
        errors correlate samples up to two apart.
        """
        second = self.inertia / SAMPLE_S**2
        first = self.viscous_friction / (2 * SAMPLE_S)
        encoder = (6 * second**2 + 2 * first**2, -4 * second**2, second**2 - first**2)
        values = np.array([*encoder, 0.0]) * self.count_rad**2 / 12
        values[0] += self.effort_nm**2
        return np.asarray(values[np.minimum(np.abs(lag), 3)])


@dataclass(frozen=True)
class Trace:
    """What one axis did in truth.

    Attributes
    ----------
    effort : (N,) array
        As recorded, without noise.
    torque : (M,) array
        That a sound twin needs in every step of the plant.
    velocity : (M + 1,) array
        Before every step, and after the last.
    lead : int
        Steps before the first stamp; as many follow the last one at least.
    noise : MeasurementNoise
    """

    effort: Array
    torque: Array
    velocity: Array
    lead: int
    noise: MeasurementNoise

    @property
    def share(self) -> float:
        """Rms of what the fault adds beyond the base model, over the rms effort.

        Where the encoder does not show in which direction the table moves, friction may be
        anything, and nothing counts.
        """
        return self._sound_drive.left / float(np.linalg.norm(self.effort))

    @property
    def added(self) -> Array:
        """What the fault adds to the effort at every sample, (N,), beyond the same sound drive."""
        return np.asarray(self._columns(self._sound_drive.shift) @ self._sound_drive.weights)

    @property
    def detectability(self) -> float:
        """Mean of the ideal test's statistic, in its standard deviations."""
        kept = np.flatnonzero(self.known)
        bands = np.zeros((3, len(kept)))
        for band in range(3):
            lag = kept[band:] - kept[: len(kept) - band]
            bands[band, : len(lag)] = self.noise.covariance(lag)
        root = cholesky_banded(bands, lower=True)

        def whitened(columns: Array) -> Array:
            white = np.zeros_like(columns)
            white[kept] = solve_banded((2, 0), root, columns[kept])
            return _in_band(white)

        return self._nearest(whitened).left

    @cached_property
    def _sound_drive(self) -> "_SoundDrive":
        """The nearest one, seen in the band and where the direction is known."""
        kept = self.known[:, None]
        return self._nearest(lambda columns: _in_band(kept * columns))

    def _nearest(self, seen: Callable[[Array], Array]) -> "_SoundDrive":
        """The sound drive that is nearest to the effort, seen through a linear map."""

        @cache
        def fitted(shift: int) -> _SoundDrive:
            return _SoundDrive.fitted(shift, seen(self._columns(shift)))

        coarse = min(_SHIFTS[::_COARSE], key=lambda shift: fitted(shift).left)
        near = (fitted(shift) for shift in _SHIFTS if abs(shift - coarse) < _COARSE)
        return min(near, key=lambda drive: drive.left)

    def _columns(self, shift: int) -> Array:
        """Base regressor, torque of the twin and effort, (N, 6), if efforts act so many steps after
        their stamps.

        The twin's are means over one period about that moment.
        """
        first = self.lead + shift - STEPS_PER_SAMPLE // 2
        at = first + STEPS_PER_SAMPLE * np.arange(len(self.effort) + 1)
        speed, direction, torque = np.diff(self._sums[:, at]) / STEPS_PER_SAMPLE
        acceleration = np.diff(self.velocity[at]) / SAMPLE_S
        ones = np.ones(len(self.effort))
        return np.stack([acceleration, speed, direction, ones, torque, self.effort], axis=-1)

    @cached_property
    def _sums(self) -> Array:
        """Of speed, direction and torque over the steps before, (3, M + 1)."""
        speed = (self.velocity[1:] + self.velocity[:-1]) / 2
        steps = np.stack([speed, np.sign(speed), self.torque])
        return np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """Samples at which the encoder shows in which direction the table moves, (N,)."""
        stamps = self.lead + STEPS_PER_SAMPLE * np.arange(len(self.effort))
        direction = np.sign(self.velocity[stamps])
        angle = self._sums[0, stamps] * SAMPLE_S / STEPS_PER_SAMPLE
        unknown = direction == 0.0
        for turn in np.flatnonzero(np.diff(direction)):
            before, after = self._until_away(angle[turn::-1]), self._until_away(angle[turn:])
            unknown[turn - before + 1 : turn + after] = True
        return np.asarray(np.convolve(unknown, np.ones(2 * _MARGIN + 1), "same") < 0.5)

    def _until_away(self, angle: Array) -> int:
        """Samples until the table follows; looked at in blocks, because it soon does."""
        distance = max(self.noise.count_rad, _WOUND_UP)
        for first in range(0, len(angle), _BLOCK):
            away = np.abs(angle[first : first + _BLOCK] - angle[0]) > distance
            if np.any(away):
                return first + int(np.argmax(away))
        return len(angle)


@dataclass(frozen=True)
class _SoundDrive:
    """One that is fitted to the effort.

    Attributes
    ----------
    shift : int
        Steps by which efforts act after their stamps.
    weights : (6,) array
        Of the columns of such a trace, which leave of the effort what this drive does not need.
    left : float
        Norm of that, as it is seen.
    """

    shift: int
    weights: Array
    left: float

    @classmethod
    def fitted(cls, shift: int, columns: Array) -> Self:
        """The nearest one to columns (K, 6), as they are seen: base regressor, chain and effort."""
        length = np.linalg.norm(columns[:, :4], axis=0)
        base, others = columns[:, :4] / length, columns[:, 4:]
        parameters = np.linalg.lstsq(base, others)[0]
        chain, effort = (others - base @ parameters).T
        compliance = float(chain @ effort) / max(float(chain @ chain), _TINY)
        mixture = np.array([-min(max(compliance, 0.0), 1.0), 1.0])
        left = np.linalg.norm(mixture @ [chain, effort])
        weights = np.concatenate([-(parameters @ mixture) / length, mixture])
        return cls(shift, weights, float(left))


def _in_band(columns: Array) -> Array:
    """Fourier coefficients (2 K, C) of columns (N, C) up to the band's end; norms are kept."""
    count = int(_BAND_HZ * SAMPLE_S * len(columns)) + 1
    found = np.fft.rfft(columns, axis=0, norm="ortho")[:count]
    found[1:] *= np.sqrt(2.0)
    return np.concatenate([found.real, found.imag])
