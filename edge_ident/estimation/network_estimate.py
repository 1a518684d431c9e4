"""The network's estimate: guess, image, network, residual, better guess.

This reconstructs the paper's loop, with a guard that the paper does not mention. The network is
applied to its own answer. That sharpens the answer and sometimes spoils it, so a step counts only
if the model's effort comes closer to the measured one. An inertia or friction below zero is set to
nearly zero before it is scored, so it counts only where the effort agrees.

A network may read from the remainder, which is the effort less the model's at the guess. Then the
first factor of the image stays that of the start. The image is linear in the remainder, and the
residual comes in shares of the remainder's scale. Each pass sharpens the answer, and the remainder
shows what the model lacks. The guard above does not serve here: the parameters that come closest
to a disturbed effort are not those of the drive. The loop ends where a pass moves the answer no
less than the pass before, and that one took next to nothing from the remainder: if it did, it was
that one which moved the answer too little.

Several recordings, such as the axes of one, are read together: each pass is one batch.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from edge_ident.errors import DataError, ModelError
from edge_ident.estimation.image import Subsampled, effort_scale
from edge_ident.estimation.manifest import Manifest
from edge_ident.estimation.network import Network
from edge_ident.estimation.trust import RESIDUAL_LIMIT
from edge_ident.model.model import BOARD_UNITS, POSITIVE, Array
from edge_ident.signals import one_period
from edge_ident.signals.metrics import compare, relative_residual
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board_identification import BoardAxis, CapturedCounts
from firmware_interface.registers import AXES, IdentificationReason

if TYPE_CHECKING:
    from firmware_interface.board_types import BoardIdentity

GOOD_ENOUGH: Final = 0.002
"""Relative residual at which the loop stops: below what any recording resolves."""
STEPS: Final = (1.0, 0.5, 0.25)
"""Parts of the network's residual that are tried; they cost no pass."""
SHRUNK: Final = 0.85
"""Scale of a remainder over that before, up to which the pass brought the answer closer. Where
noise or an effect is what is left, 996 of 1000 loops end with more."""
CONVERGED: Final = 1e-5
"""Change of the shares at which refinement stops."""
SMALLEST: Final = 1e-4
"""Share that stands for zero where physics requires a positive parameter."""
_TINY: Final = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class NetworkEstimate:
    """What the loop finds.

    Attributes
    ----------
    parameters, std : (4,) arrays
        SI, in the order of `PARAMETERS`.
    relative_residual, time_spectral : float
        Of the subsampled effort; see `edge_ident.signals.metrics.Metric`.
    passes : int
        Images that the network saw.
    trusted : bool
        Whether the parameters describe the effort; they are physical in any case.
    reason : str
        Why, or why not, in one sentence.
    """

    parameters: Array
    std: Array
    relative_residual: float
    time_spectral: float
    passes: int
    trusted: bool
    reason: str


@dataclass(frozen=True)
class _Guess:
    shares: Array
    residual: float


# Asks the network about both efforts of an image, gets the residual, and returns its best guess and
# the passes used.
_Loop = Generator[tuple[Array, Array], Array, tuple[_Guess, int]]


def estimate(
    regressor: Array,
    effort: Array,
    network: Network,
    *,
    seed: int = 0,
    passes: int = 8,
    stopwatch: Stopwatch | None = None,
) -> NetworkEstimate:
    """Estimate the parameters behind one subsampled recording.

    Parameters
    ----------
    regressor : (100, 4) array
        Subsampled, SI, at the phase of the network's motion.
    effort : (100,) array
        Subsampled, SI.
    network, seed, passes, stopwatch
        As in `estimate_together`.

    Raises
    ------
    DataError
        The effort is zero throughout.
    """
    seen = [Subsampled(regressor, effort)]
    return estimate_together(seen, network, seed=seed, passes=passes, stopwatch=stopwatch)[0]


def estimate_together(
    recordings: Sequence[Subsampled],
    network: Network,
    *,
    seed: int = 0,
    passes: int = 8,
    stopwatch: Stopwatch | None = None,
) -> list[NetworkEstimate]:
    """Estimate the parameters behind each of several recordings.

    Parameters
    ----------
    recordings : sequence of Subsampled
        At the phase of the network's motion.
    network : Network
    seed : int
        Of the random starting points of each, where the network does not have its own.
    passes : int
        Images at most of each, restarts included.
    stopwatch : Stopwatch, optional
        Gets the stages "image", which is what happens between two passes, and "network".

    Raises
    ------
    DataError
        An effort is zero throughout.
    """
    manifest, watch = network.manifest, stopwatch or Stopwatch()
    scales = [float(effort_scale(of.effort, manifest.normalization)) for of in recordings]
    if 0.0 in scales:
        raise DataError(
            "the effort is zero in every sample", "check the column that holds the effort"
        )
    scaled = [
        (of.regressor / manifest.motion.column_scales, of.effort / scale)
        for of, scale in zip(recordings, scales, strict=True)
    ]
    loops = [_loop(regressor, effort, manifest, seed, passes) for regressor, effort in scaled]
    ended = _run(loops, network, watch)
    return [
        _in_si(best, done, scale, network, compare(effort, regressor @ best.shares).time_spectral)
        for (regressor, effort), scale, (best, done) in zip(scaled, scales, ended, strict=True)
    ]


def _run(loops: Sequence[_Loop], network: Network, watch: Stopwatch) -> list[tuple[_Guess, int]]:
    """Run all loops to their end, each pass in one batch."""
    ended: dict[int, tuple[_Guess, int]] = {}
    answers: dict[int, Array | None] = dict.fromkeys(range(len(loops)))
    while answers:
        asked = {}
        with watch.stage("image"):
            for number, answer in answers.items():
                loop = loops[number]
                try:
                    asked[number] = next(loop) if answer is None else loop.send(answer)
                except StopIteration as end:
                    ended[number] = end.value
        if not asked:
            break
        model, measured = (np.stack(efforts) for efforts in zip(*asked.values(), strict=True))
        with watch.stage("network"):
            residuals = network.residuals_of(model, measured)
        answers = dict(zip(asked, residuals, strict=True))
    return [ended[number] for number in range(len(loops))]


def _in_si(
    best: _Guess, passes: int, scale: float, network: Network, time_spectral: float
) -> NetworkEstimate:
    manifest, share_scales = network.manifest, network.manifest.motion.column_scales
    unexplained = manifest.parameter_std_per_residual * best.residual
    std = np.hypot(manifest.parameter_std[network.variant], unexplained)
    trusted, reason = _trusted(best, passes)
    return NetworkEstimate(
        parameters=best.shares * scale / share_scales,
        std=std * scale / share_scales,
        relative_residual=best.residual,
        time_spectral=time_spectral,
        passes=passes,
        trusted=trusted,
        reason=reason,
    )


def _loop(regressor: Array, measured: Array, manifest: Manifest, seed: int, passes: int) -> _Loop:
    """The loop that the network was trained for."""
    if manifest.start_shares is not None:
        return _refine(regressor, measured, manifest, manifest.start_shares, passes)
    return _search(regressor, measured, np.random.default_rng(seed), passes)


def motion_mismatch(regressor: Array, network: Network) -> float:
    """How far a recording's motion is from the one the network was trained for.

    Parameters
    ----------
    regressor : (100, 4) array
        Subsampled, SI.
    network : Network

    Returns
    -------
    float
        Largest ‖difference‖/‖column‖ among the columns.
    """
    known = network.manifest.motion.regressor
    difference = np.linalg.norm(regressor - known, axis=0)
    return float(np.max(difference / np.linalg.norm(known, axis=0)))


def _refine(
    regressor: Array, measured: Array, manifest: Manifest, start: Array, passes: int
) -> _Loop:
    """Read from the remainder until a pass no longer changes the answer.

    The network gives residuals in shares of the remainder's scale, so each pass adds as many digits
    as the first. They belong to the network's motion and are mapped to the recording's own, whose
    amplitude may differ.
    """
    nominal = manifest.motion.regressor / manifest.motion.column_scales
    mapping = np.linalg.lstsq(nominal, regressor, rcond=None)[0]
    here, change, before = start, np.inf, np.inf
    for done in range(1, passes + 1):
        remainder = measured - regressor @ here
        scale = max(float(effort_scale(remainder, manifest.normalization)), _TINY)
        residual = scale * (yield nominal @ start, remainder / scale)
        step = np.linalg.solve(mapping, residual)
        if np.linalg.norm(step) > change and scale > SHRUNK * before:
            return _physical(here, regressor, measured), done  # about what the network can resolve
        here, change, before = here - step, float(np.linalg.norm(step)), scale
        if change <= CONVERGED:
            break
    return _physical(here, regressor, measured), done


def _physical(shares: Array, regressor: Array, measured: Array) -> _Guess:
    """Score shares, with unphysical ones set to nearly zero."""
    shares = np.where(POSITIVE, np.maximum(shares, SMALLEST), shares)
    return _Guess(shares, relative_residual(measured, regressor @ shares))


def _search(regressor: Array, measured: Array, rng: "np.random.Generator", passes: int) -> _Loop:
    """Best guess within the passes, and the passes used."""
    here = best = _physical(_random_start(rng), regressor, measured)
    for done in range(1, passes + 1):
        residual = yield regressor @ here.shares, measured
        reached = min(
            (_physical(here.shares - step * residual, regressor, measured) for step in STEPS),
            key=lambda guess: guess.residual,
        )
        best = min(best, reached, key=lambda guess: guess.residual)
        if best.residual <= GOOD_ENOUGH:
            return best, done
        sharper = reached.residual < here.residual
        here = reached if sharper else _physical(_random_start(rng), regressor, measured)
    return best, passes


def _random_start(rng: "np.random.Generator") -> Array:
    """The paper's: in [0, 1], and [-1, 1] where either sign is physical."""
    return rng.uniform(np.where(POSITIVE, 0.0, -1.0), 1.0)


def _trusted(best: _Guess, passes: int) -> tuple[bool, str]:
    after = f"{passes} pass" if passes == 1 else f"{passes} passes"
    if not best.residual <= RESIDUAL_LIMIT:
        return False, (
            f"the network leaves {best.residual:.1%} of the effort unexplained after {after} "
            f"(limit {RESIDUAL_LIMIT:.0%})"
        )
    return True, f"the network leaves {best.residual:.2%} of the effort unexplained after {after}"


# The network as a board runs it: one period of one motion, in int8, without least squares.
#
# `edge-ident export --c` and a firmware built with it do what this file says, number by number
# (docs/chip.md). A virtual board calls this file itself, and `run` asks it what the board should
# have said.

FEWEST_MOVING: Final = 0.5
"""Share of the period in which an axis has to move: the rest is bridged by straight lines."""


def why_not_on_a_board(manifest: Manifest) -> str:
    """Why a board cannot identify with a network, empty where it can."""
    motion = manifest.motion
    if manifest.start_shares is None or manifest.normalization != "effort-scale":
        return "it was trained for random starts"
    if motion.effects:
        return f"it was trained for drives with {', '.join(motion.effects)}"
    if (motion.position_unit, motion.effort_unit) != BOARD_UNITS:
        return f"it was trained for {motion.position_unit} and {motion.effort_unit}"
    return ""


@dataclass(frozen=True)
class BoardNetwork:
    """A network on a board.

    Parameters
    ----------
    network : Network
        In int8.

    Raises
    ------
    ModelError
        No board could run this network.
    """

    network: Network

    def __post_init__(self) -> None:
        reason = why_not_on_a_board(self.network.manifest)
        if reason:
            raise ModelError(
                f"a board cannot identify with this network: {reason}",
                "train a network for the motion, without --configuration paper",
            )

    def identify(self, captured: CapturedCounts, board: "BoardIdentity") -> dict[str, BoardAxis]:
        """What the board says of each axis."""
        return {name: axis for name, (axis, _) in self.estimates(captured, board).items()}

    def estimates(
        self, captured: CapturedCounts, board: "BoardIdentity"
    ) -> dict[str, tuple[BoardAxis, NetworkEstimate | None]]:
        """The same, with the network's estimate where it was asked."""
        period_s, sampling_s = self.network.manifest.motion.period_s, board.sample_period_s
        samples = one_period.period_samples(period_s, sampling_s, len(captured.position))
        if not samples:
            return dict.fromkeys(AXES, (BoardAxis(IdentificationReason.TOO_SHORT), None))
        return {
            axis: self._axis(
                one_period.Blocks.of(captured.position[:samples, n], captured.effort[:samples, n]),
                samples * sampling_s,
                board,
            )
            for n, axis in enumerate(AXES)
        }

    def _axis(
        self, blocks: one_period.Blocks, period_s: float, board: "BoardIdentity"
    ) -> tuple[BoardAxis, NetworkEstimate | None]:
        seen = self._conditioned(blocks, period_s, board)
        why_not = self._illegible(seen, board.effort_per_count_nm)
        if why_not:
            return BoardAxis(why_not), None
        found = estimate_together([Subsampled(seen.regressor, seen.effort)], self.network)[0]
        if not found.trusted:
            return BoardAxis(IdentificationReason.UNEXPLAINED, found.passes), found
        parameters = tuple(map(float, found.parameters))
        return (
            BoardAxis(IdentificationReason.NONE, found.passes, parameters, found.relative_residual),
            found,
        )

    def _conditioned(
        self, blocks: one_period.Blocks, period_s: float, board: "BoardIdentity"
    ) -> one_period.Period:
        return one_period.condition_period(
            blocks,
            one_period.KnownMotion.of(self.network.manifest.motion.regressor),
            unit=board.encoder_resolution_rad,
            effort_unit=board.effort_per_count_nm,
            sampling_s=board.sample_period_s,
            period_s=period_s,
            effort_shift_s=board.control_delay_s + 0.5 * board.sample_period_s,
        )

    def _illegible(self, seen: one_period.Period, count: float) -> IdentificationReason:
        """Why the network cannot read what an axis did."""
        manifest = self.network.manifest
        if seen.moving_share < FEWEST_MOVING:
            return IdentificationReason.STANDSTILL
        if not motion_mismatch(seen.regressor, self.network) <= manifest.mismatch_limit:
            return IdentificationReason.OTHER_MOTION
        if not effort_scale(seen.effort, manifest.normalization) > count:
            return IdentificationReason.NO_EFFORT
        return IdentificationReason.NONE
