"""How long a training run still takes."""

from collections.abc import Mapping
from typing import Final

from export.checkpoint import Checkpoint
from export.configuration import Configuration

STEP_S: Final[Mapping[str, float]] = {
    "recordings": 0.36, "head": 0.014, "features": 0.0007, "dense": 0.016, "network": 0.06,
}  # fmt: skip
"""What a motion, an example or a step of each stage takes on one core, in their order. It serves to
compare them: how fast this machine is follows from what it has done."""


class TimeLeft:
    """The time left of a run, from what this session has done of it.

    Parameters
    ----------
    configuration : Configuration
    checkpoint : Checkpoint or None
        Where the session goes on; None: it begins.
    """

    def __init__(self, configuration: Configuration, checkpoint: Checkpoint | None) -> None:
        warm = configuration.head_steps > 0
        self._end = {
            "recordings": configuration.motions if configuration.drives == "mixture" else 0,
            "head": configuration.head_steps,
            "features": configuration.dense_examples if warm else 0,
            "dense": configuration.dense_steps if warm else 0,
            "network": configuration.steps,
        }
        self._begin = dict.fromkeys(self._end, 0)
        if checkpoint is not None:  # recordings are made again, and so are features for the dense
            self._begin["head"] = self._end["head"]
            if checkpoint.stage == "network":
                self._begin |= {stage: self._end[stage] for stage in ("features", "dense")}
            self._begin[checkpoint.stage] = checkpoint.step

    def after(self, stage: str, step: int, passed_s: float) -> float | None:
        """Seconds left after a step; None before anything is done.

        Parameters
        ----------
        stage : str
        step : int
            Steps done in this stage, over all sessions.
        passed_s : float
            Since the session began.
        """
        stages = list(STEP_S)
        before, later = stages[: stages.index(stage)], stages[stages.index(stage) + 1 :]
        done_s = (step - self._begin[stage]) * STEP_S[stage] + sum(map(self._stage_s, before))
        left_s = (self._end[stage] - step) * STEP_S[stage] + sum(map(self._stage_s, later))
        return passed_s * left_s / done_s if done_s > 0.0 else None

    def _stage_s(self, stage: str) -> float:
        return (self._end[stage] - self._begin[stage]) * STEP_S[stage]
