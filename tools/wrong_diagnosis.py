"""What a wrong diagnosis costs: gains from wrong models, tried on the independent plant's machines.

    python -m tools.wrong_diagnosis --runs 500 --seed 5000

Each machine has a hidden effect, and soft gains or gains that are tuned. The model that its gains
are designed from is wrong: another effect with values drawn at random, the values' signs turned,
or wrong base parameters. The trial of the gains is that of `run`: forecast, two motions, verdict.
Counted are confirmed gains with which the machine truly follows worse by more than 2 % on one of
these motions, and apart from them on a third motion, which nobody was told of.
"""

import argparse
import time
from collections import Counter
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.commissioning.drawn_loads import Grounds
from edge_ident.commissioning.further_motions import NamedMotion, second_motion, within_limits
from edge_ident.commissioning.gain_change import MotionBefore, check_change, put_in_force
from edge_ident.control.gain_design import design
from edge_ident.drive.motions import named_trajectory
from edge_ident.errors import EdgeIdentError
from edge_ident.identification.identify import identify
from edge_ident.model.effect import scale_of
from edge_ident.model.effects import catalogue, random_term
from edge_ident.model.model import AxisModel, Estimate, Model, Term, base_axis, effect_names
from firmware_interface.motion import reference
from tests.short_runs import Silent, brief_drive
from tools.judged_machines import JudgedMachine, judged_machine, third_motion, why, worse_by

Array = NDArray[np.float64]

_WORSE: Final = 0.02
_WRONG: Final = ("effect", "signs", "base", "effect and base")
_SPREAD: Final = 0.3  # deviation of the logarithm of wrong base parameters


@dataclass(frozen=True)
class Run:
    """One trial.

    Attributes
    ----------
    end : str
    kind : str
        How the model was wrong, and the gains before.
    judged, third : float
        Largest relative growth of a true error with confirmed gains, on the two motions that judge
        and on the third.
    """

    end: str
    kind: str
    judged: float = -1.0
    third: float = -1.0


def main() -> None:
    """Print the counts as they come."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=5000)
    options = parser.parse_args()
    runs: list[Run] = []
    began = time.monotonic()
    for seed in range(options.seed, options.seed + options.runs):
        runs.append(_run(seed))
        if runs[-1].judged > _WORSE or runs[-1].third > _WORSE:
            print(f"seed {seed}: {runs[-1]}", flush=True)
        if len(runs) % 20 == 0:
            _print(runs, time.monotonic() - began)
    _print(runs, time.monotonic() - began)


def _run(seed: int) -> Run:
    rng = np.random.default_rng([seed, 21])
    wrong, tuned = str(rng.choice(_WRONG)), bool(rng.random() < 0.7)
    kind = f"{wrong}, {'tuned' if tuned else 'soft'} before"
    try:
        return _tried(judged_machine(seed, tuned=tuned), seed, wrong, kind, rng)
    except EdgeIdentError as error:
        return Run(why(error), kind)


def _tried(
    machine: JudgedMachine, seed: int, wrong: str, kind: str, rng: np.random.Generator
) -> Run:
    board, drive = machine.board, machine.drive
    board.enable()
    third, first = third_motion(drive, seed), named_trajectory(drive, "sinusoid", 1)
    capture, _ = machine.move(first)
    found = identify(capture.recording, None, diagnose=False)
    model = Model({name: _spoilt(axis.model, wrong, rng) for name, axis in found.axes.items()})
    diagnosed = {name: effect_names(axis) for name, axis in model.axes.items()}
    grounds = Grounds(model, Grounds.of(found).timing, diagnosed)
    active, hardware = board.active_gains(), machine.hardware
    wanted = {name: design(axis, hardware[name]).gains for name, axis in model.axes.items()}
    check_change(board, active, wanted, large_steps=True)
    second = second_motion(drive, "sinusoid")
    before = MotionBefore(capture, NamedMotion("sinusoid", first), second, grounds)
    change = put_in_force(board, wanted, before, Silent())
    if not change.confirmed:
        broken = "not worth a write" if change.unchanged else "rolled back"
        return Run(broken, kind)
    shown = within_limits(second, model, active, board.limits()).trajectory
    after = [machine.move(motion)[1] for motion in (first, shown, third)]
    board.stage_gains(active)
    board.commit()
    old = [machine.move(motion)[1] for motion in (first, shown, third)]
    board.confirm()
    grown = [worse_by(*both) for both in zip(old, after, strict=True)]
    return Run("confirmed", kind, max(grown[:2]), grown[2])


def _spoilt(axis: AxisModel, wrong: str, rng: np.random.Generator) -> AxisModel:
    parameters = axis.parameters.copy()
    std = np.array([axis.terms[0].std[name] for name in axis.terms[0].values])
    if "base" in wrong:
        parameters *= np.exp(_SPREAD * rng.normal(size=4))
    model = base_axis(Estimate(parameters, np.minimum(std, 0.2 * np.abs(parameters))))
    if wrong == "base":
        return model
    term = _drawn(parameters, rng)
    if wrong == "signs":
        term = replace(term, values={n: _turned(term.effect, n, v) for n, v in term.values.items()})
    return replace(model, terms=(*model.terms, term))


def _turned(effect: str, name: str, value: float | Array) -> float:
    low, _ = catalogue()[effect].bounds[name]
    return -float(value) if low < 0.0 else float(value)


def _drawn(parameters: Array, rng: np.random.Generator) -> Term:
    """An effect that gains make use of, with random values."""
    used = [e for e in catalogue().values() if e.compensation.used and not e.needs_source]
    effect = used[rng.integers(len(used))]
    time_s = np.asarray(0.0025 * np.arange(2186), dtype=np.float64)
    motion = named_trajectory(brief_drive(), "sinusoid", 1).axes["x"]
    way = reference(motion, time_s, 2.0, 0.0)
    scale = scale_of(
        parameters, time_s, way.position_rad, way.velocity_rad_s, way.acceleration_rad_s2
    )
    drawn = random_term(effect.name, rng, scale)
    return replace(drawn, values={name: float(value) for name, value in drawn.values.items()})


def _print(runs: list[Run], spent_s: float) -> None:
    ends = Counter(run.end for run in runs)
    print(f"\n{len(runs)} runs in {spent_s:.0f} s: {dict(ends.most_common())}")
    for kind in sorted({run.kind for run in runs}):
        of_kind = [run for run in runs if run.kind == kind]
        kept = [run for run in of_kind if run.end == "confirmed"]
        better = np.median([run.judged for run in kept]) if kept else float("nan")
        print(
            f"{kind:32} {len(of_kind):4d} runs, {len(kept):4d} confirmed (median growth of the "
            f"worst error {better:+.0%}), worse on a judging motion "
            f"{sum(run.judged > _WORSE for run in kept)}, on the third motion "
            f"{sum(run.third > _WORSE for run in kept)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
