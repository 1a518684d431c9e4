"""Training: the warm start's head, then the whole network."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import torch
from torch import Tensor, nn

from edge_ident.errors import ModelError
from export.checkpoint import Checkpoint, load, save
from export.configuration import Configuration
from export.data import Batches, tensor
from export.network import ResidualNetwork
from export.warm_start import HEAD_BATCH, HEAD_LEARNING_RATE, Head, head_batch, join, look_linear

SAVE_EVERY_S: Final = 30.0
REPORT_EVERY_S: Final = 0.5
SMALL: Final = 0.02
"""Residual below which the relative loss counts the error itself."""
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
    stage : {"head", "network"}
    step, steps : int
        Of this stage.
    loss : float
        Of the last step.
    examples : int
        Seen in this stage.
    elapsed_s : float
        Over all sessions of the run.
    """

    stage: str
    step: int
    steps: int
    loss: float
    examples: int
    elapsed_s: float


def train(
    configuration: Configuration,
    output: Path,
    *,
    resume: bool,
    accelerator: str | None,
    on_progress: Callable[[TrainingProgress], None],
) -> Path:
    """Train a network and leave its checkpoint at `output`.

    The checkpoint is written every half minute and at the end of each stage, always whole; an
    interrupted run loses what came after the last one, and resumed gives the same network as one
    that was never interrupted.

    Parameters
    ----------
    configuration : Configuration
    output : Path
    resume : bool
        Go on from the checkpoint at `output`.
    accelerator : str or None
        Torch device; None is the processor.

    Raises
    ------
    ModelError
        If there is a checkpoint and the run is not to resume, or it is another configuration's.
    """
    return _Run(configuration, output, accelerator or "cpu", on_progress).finish(resume)


def _start(configuration: Configuration) -> Checkpoint:
    torch.manual_seed(configuration.seed)
    network = ResidualNetwork()
    head = {}
    if configuration.head_steps > 0:
        head = Head(network).state_dict()
        look_linear(network)
    stage = "head" if head else "network"
    return Checkpoint(configuration, stage, 0, 0.0, network.state_dict(), head, {})


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
        output: Path,
        device: str,
        on_progress: Callable[[TrainingProgress], None],
    ) -> None:
        self.configuration = configuration
        self.output = output
        self.device = device
        self.on_progress = on_progress
        self.network = ResidualNetwork()
        self.head = Head(self.network)

    def finish(self, resume: bool) -> Path:
        if not resume and self.output.exists():
            raise ModelError(f"{self.output}: exists already", "resume it or name another file")
        configuration, started_s = self.configuration, time.perf_counter()
        state = _resumed(configuration, self.output) if resume else _start(configuration)
        self.began_s = started_s - state.elapsed_s
        self.network.load_state_dict(state.network)
        batches = Batches(configuration)
        if state.stage == "head":
            self.head.load_state_dict(state.head)
            self._descend(state, self.head, configuration.head_steps, self._head_loss)
            join(self.network, self.head, batches)
            state = replace(state, stage="network", step=0, optimizer={}, head={})
        self.network.to(self.device)
        self._descend(
            state, self.network, configuration.steps, lambda step: self._loss(batches, step)
        )
        return self.output

    def _descend(
        self, state: Checkpoint, module: nn.Module, steps: int, loss_at: Callable[[int], Tensor]
    ) -> None:
        """Take the stage's remaining gradient steps."""
        optimizer = self._optimizer(module, state.stage)
        if state.optimizer:
            optimizer.load_state_dict(state.optimizer)
        saved_s = reported_s = time.perf_counter()
        for step in range(state.step, steps):
            for group in optimizer.param_groups:
                group["lr"] = group["peak"] * self._rate(step / steps)
            loss = loss_at(step)
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(module.parameters(), CLIP)
            optimizer.step()
            now_s, last = time.perf_counter(), step + 1 == steps
            if last or now_s - reported_s > REPORT_EVERY_S:
                reported_s = now_s
                self._report(state.stage, step + 1, steps, loss.item())
            if last or now_s - saved_s > SAVE_EVERY_S:
                saved_s = now_s
                self._save(state, step + 1, optimizer)

    def _optimizer(self, module: nn.Module, stage: str) -> torch.optim.Optimizer:
        rate = self.configuration.learning_rate
        if self.configuration.optimizer == "sgd":
            return torch.optim.SGD([{"params": list(module.parameters()), "peak": rate}], lr=rate)
        if stage == "head":
            group = {"params": list(module.parameters()), "peak": HEAD_LEARNING_RATE}
            return torch.optim.Adam([group], betas=(0.9, 0.99))
        # Adam moves every weight alike, so a unit's output moves by the number of its inputs
        groups = [
            {"params": [p], "peak": rate * (100.0 / p[0].numel() if p.ndim > 1 else 1.0)}
            for p in module.parameters()
        ]
        return torch.optim.Adam(groups)

    def _rate(self, done: float) -> float:
        """Learning rate over its peak, after a part of the stage."""
        if self.configuration.optimizer == "sgd":
            return 1.0
        cosine = 0.5 * (1.0 + math.cos(math.pi * done))
        return min(1.0, done / WARM_UP) * (LAST_RATE + (1.0 - LAST_RATE) * cosine)

    def _head_loss(self, step: int) -> Tensor:
        known, residual = head_batch(self.configuration.seed, step)
        return relative_loss(self.head(known), residual)

    def _loss(self, batches: Batches, step: int) -> Tensor:
        batch = batches.batch(step)
        arrays = (batch.model_effort, batch.measured_effort, batch.bias, batch.residual)
        model, measured, bias, residual = (tensor(array).to(self.device) for array in arrays)
        found = self.network.residuals(model, measured, bias)
        if self.configuration.loss == "sigmoid":
            return sigmoid_loss(found, residual)
        return relative_loss(found, residual)

    def _report(self, stage: str, step: int, steps: int, loss: float) -> None:
        batch = HEAD_BATCH if stage == "head" else self.configuration.batch
        elapsed_s = time.perf_counter() - self.began_s
        self.on_progress(TrainingProgress(stage, step, steps, loss, step * batch, elapsed_s))

    def _save(self, state: Checkpoint, step: int, optimizer: torch.optim.Optimizer) -> None:
        save(
            replace(
                state,
                step=step,
                elapsed_s=time.perf_counter() - self.began_s,
                network=self.network.state_dict(),
                head=self.head.state_dict() if state.stage == "head" else {},
                optimizer=optimizer.state_dict(),
            ),
            self.output,
        )


def sigmoid_loss(found: Tensor, residual: Tensor) -> Tensor:
    """½·Σ(target - output)² of the residuals' sigmoids (reconstruction of the paper's)."""
    error = torch.sigmoid(found) - torch.sigmoid(residual)
    return 0.5 * error.square().sum(dim=1).mean()


def relative_loss(found: Tensor, residual: Tensor) -> Tensor:
    """Σ(found - residual)² / (Σresidual² + small²), mean over the batch."""
    size = residual.square().sum(dim=1) + SMALL**2
    return ((found - residual).square().sum(dim=1) / size).mean()
