"""Training: the warm start's head, the dense layers, then the whole network."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import torch
from torch import Tensor, nn

from edge_ident.errors import ModelError
from export.checkpoint import Checkpoint, Loss, load, save, write_losses
from export.configuration import Configuration
from export.data import Batches, tensor
from export.losses import LOSSES
from export.motion import TrainingMotion
from export.network import ResidualNetwork
from export.processor import checked_device, set_fastest_threads
from export.time_left import TimeLeft
from export.warm_start import Features, Head, compute_features, join, look_linear

SAVE_EVERY_S: Final = 10.0
REPORT_EVERY_S: Final = 0.5
CURVE_POINTS: Final = 100
"""Points of the loss curves, per stage."""
TEST_EXAMPLES: Final = 512
HEAD_BATCH: Final = 512
DENSE_BATCH: Final = 512
HEAD_RATE: Final = 3e-3
DENSE_RATE: Final = 5e-4
"""Learning rates of those stages, for layers with 100 inputs."""
WARM_UP: Final = 0.05
"""Part of a stage in which the learning rate rises."""
LAST_RATE: Final = 0.01
"""Learning rate at the end over its peak."""
CLIP: Final = 1.0
"""Largest norm of a gradient."""


@dataclass(frozen=True)
class TrainingProgress:
    """Where a run stands.

    Attributes
    ----------
    stage : {"recordings", "head", "features", "dense", "network"}
    step, steps : int
        Of this stage.
    loss : float or None
        Of the last step, where there is one.
    elapsed_s : float
        Over all sessions of the run.
    left_s : float or None
        Estimate for all stages that are left; None before anything is done.
    """

    stage: str
    step: int
    steps: int
    loss: float | None
    elapsed_s: float
    left_s: float | None


def train(
    configuration: Configuration,
    motion: TrainingMotion,
    output: Path,
    *,
    resume: bool,
    accelerator: str | None,
    on_progress: Callable[[TrainingProgress], None],
) -> Path:
    """Train a network and leave its checkpoint at `output`, with the loss curves beside it.

    The checkpoint is written every ten seconds and at the end of each stage, always whole; an
    interrupted run loses what came after the last one, and resumed gives the same network as one
    that was never interrupted.

    Parameters
    ----------
    configuration : Configuration
    motion : TrainingMotion
        A resumed run goes on with its own.
    output : Path
    resume : bool
        Go on from the checkpoint at `output`, or begin where there is none yet.
    accelerator : str or None
        Torch device; None is a GPU where there is one, else the processor.

    Raises
    ------
    ModelError
        If there is a checkpoint and the run is not to resume, if it is another configuration's,
        or if torch cannot use the accelerator.
    """
    if not resume and output.exists():
        raise ModelError(f"{output}: already exists", "resume it or name another file")
    device = checked_device(accelerator)
    checkpoint = _resumed(configuration, output) if output.exists() else None
    if checkpoint:
        motion = checkpoint.motion
        if checkpoint.complete:
            return output
    set_fastest_threads()
    return _Run(configuration, motion, output, device, on_progress, checkpoint).finish()


def _resumed(configuration: Configuration, path: Path) -> Checkpoint:
    checkpoint = load(path)
    if checkpoint.configuration != configuration:
        raise ModelError(
            f"{path}: belongs to configuration '{checkpoint.configuration.name}' as it was then",
            "resume with that configuration or train to another file",
        )
    return checkpoint


class _Run:
    """One session of a training run."""

    def __init__(
        self,
        configuration: Configuration,
        motion: TrainingMotion,
        output: Path,
        device: str,
        on_progress: Callable[[TrainingProgress], None],
        checkpoint: Checkpoint | None,
    ) -> None:
        self.began_s = time.perf_counter()
        self.checkpoint = checkpoint
        self.earlier_s = checkpoint.elapsed_s if checkpoint else 0.0
        self.time_left = TimeLeft(configuration, checkpoint)
        self.configuration = configuration
        self.motion = motion
        self.output = output
        self.device = device
        self.on_progress = on_progress
        torch.manual_seed(configuration.seed)
        self.network = ResidualNetwork(configuration.points)
        self.batches = Batches(configuration, motion, on_progress=self._made("recordings"))
        held_out = Batches(configuration, motion, held_out=True)
        self.test = held_out.batch("test", 0, TEST_EXAMPLES)
        if configuration.head_steps:
            self.head = Head(self.network, self.batches, self.batches.basis())
            look_linear(self.network)
            # its kernels only have to pass the image on, and half of a step's time would be theirs
            self.network.first.requires_grad_(False)

    def finish(self) -> Path:
        """Go through the stages that are left."""
        configuration = self.configuration
        state = self.checkpoint or self._start()
        self.network.load_state_dict(state.network)
        if state.stage == "head":
            self.head.load_state_dict(state.head)
            state = self._descend(state, self.head, configuration.head_steps, self._head_output)
            state = replace(state, stage="dense", step=0, optimizer={}, head={})
        if state.stage == "dense":
            state = self._train_dense(state)
            state = replace(state, stage="network", step=0, optimizer={})
        self.network.to(self.device)
        self._descend(state, self.network, configuration.steps, self._output)
        return self.output

    def _start(self) -> Checkpoint:
        first = "head" if self.configuration.head_steps else "network"
        head = self.head.state_dict() if first == "head" else {}
        weights = self.network.state_dict()
        return Checkpoint(self.configuration, self.motion, first, 0, 0.0, weights, head, {}, ())

    def _train_dense(self, state: Checkpoint) -> Checkpoint:
        """The dense layers on stored features, which the convolutions do not change."""
        count = self.configuration.dense_examples
        made = self._made("features")
        features = compute_features(self.network, self.head, self.batches, count, made)
        if state.step == 0:
            join(self.network, self.head, features)
        dense = self.network.dense

        def output(step: int | None) -> tuple[Tensor, Tensor]:
            if step is None:
                return self._output(None)
            chosen = _chosen(features, self.configuration.seed, step)
            return self.network.dense_layers(features.values[chosen])[-1], features.residual[chosen]

        return self._descend(state, dense, self.configuration.dense_steps, output)

    def _descend(
        self,
        state: Checkpoint,
        module: nn.Module,
        steps: int,
        output: Callable[[int | None], tuple[Tensor, Tensor]],
    ) -> Checkpoint:
        """Take the stage's remaining gradient steps.

        `output` gives what was found and what was wanted in a step, or of the test examples.
        """
        optimizer = self._optimizer(module, state.stage)
        if state.optimizer:
            optimizer.load_state_dict(state.optimizer)
        saved_s = reported_s = time.perf_counter()
        losses, since, every = list(state.losses), [0.0, 0], max(1, steps // CURVE_POINTS)
        for step in range(state.step, steps):
            for group in optimizer.param_groups:
                group["lr"] = group["peak"] * self._rate(step / steps)
            loss = self._loss(*output(step))
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(module.parameters(), CLIP)
            optimizer.step()
            since = [since[0] + loss.item(), since[1] + 1]
            now_s, last = time.perf_counter(), step + 1 == steps
            if last or (step + 1) % every == 0:
                with torch.no_grad():
                    test = self._loss(*output(None)).item()
                losses.append(Loss(state.stage, step + 1, since[0] / since[1], test))
                since = [0.0, 0]
            if last or now_s - reported_s > REPORT_EVERY_S:
                reported_s = now_s
                self._report(state.stage, step + 1, steps, loss.item())
            if last or now_s - saved_s > SAVE_EVERY_S:
                saved_s = now_s
                state = self._save(state, step + 1, optimizer, losses)
        return state

    def _optimizer(self, module: nn.Module, stage: str) -> torch.optim.Optimizer:
        rate = self.configuration.learning_rate
        trained = [parameter for parameter in module.parameters() if parameter.requires_grad]
        if self.configuration.optimizer == "sgd":
            return torch.optim.SGD([{"params": trained, "peak": rate}], lr=rate)
        if stage == "head":
            group = {"params": trained, "peak": HEAD_RATE}
            return torch.optim.Adam([group], betas=(0.9, 0.99))
        if stage == "dense":
            rate = DENSE_RATE
        # Adam moves every weight alike, so a unit's output moves by the number of its inputs
        groups = [
            {"params": [p], "peak": rate * (100.0 / p[0].numel() if p.ndim > 1 else 1.0)}
            for p in trained
        ]
        return torch.optim.Adam(groups)

    def _rate(self, done: float) -> float:
        """Learning rate over its peak, after a part of the stage."""
        if self.configuration.optimizer == "sgd":
            return 1.0
        cosine = 0.5 * (1.0 + math.cos(math.pi * done))
        return min(1.0, done / WARM_UP) * (LAST_RATE + (1.0 - LAST_RATE) * cosine)

    def _head_output(self, step: int | None) -> tuple[Tensor, Tensor]:
        batch = self.test if step is None else self.batches.batch("head", step, HEAD_BATCH)
        return self.head(self.head.known(batch)), tensor(batch.residual)

    def _output(self, step: int | None) -> tuple[Tensor, Tensor]:
        size = self.configuration.batch
        batch = self.test if step is None else self.batches.batch("network", step, size)
        device = next(self.network.parameters()).device
        factors = (factor.to(device) for factor in batch.factors)
        return self.network.residuals(*factors), tensor(batch.residual).to(device)

    def _loss(self, found: Tensor, wanted: Tensor) -> Tensor:
        return LOSSES[self.configuration.loss](found, wanted)

    def _made(self, stage: str) -> Callable[[int, int], None]:
        return lambda done, total: self._report(stage, min(done, total), total, None)

    def _report(self, stage: str, step: int, steps: int, loss: float | None) -> None:
        passed_s = time.perf_counter() - self.began_s
        left_s = self.time_left.after(stage, step, passed_s)
        elapsed_s = passed_s + self.earlier_s
        self.on_progress(TrainingProgress(stage, step, steps, loss, elapsed_s, left_s))

    def _save(
        self, state: Checkpoint, step: int, optimizer: torch.optim.Optimizer, losses: list[Loss]
    ) -> Checkpoint:
        state = replace(
            state,
            step=step,
            elapsed_s=time.perf_counter() - self.began_s + self.earlier_s,
            network=self.network.state_dict(),
            head=self.head.state_dict() if state.stage == "head" else {},
            optimizer=optimizer.state_dict(),
            losses=tuple(losses),
        )
        save(state, self.output)
        write_losses(state.losses, self.output.with_name("losses.csv"))
        return state


def _chosen(features: Features, seed: int, step: int) -> Tensor:
    """The examples of a step."""
    generator = torch.Generator().manual_seed(hash((seed, step)))
    return torch.randint(len(features.values), (DENSE_BATCH,), generator=generator)
