"""State of a training run on disk."""

import csv
import io
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import torch

from edge_ident.errors import ModelError
from edge_ident.model.model import AxisModel, Model
from edge_ident.model.model_files import model_document, model_of
from export.configuration import Configuration
from export.motion import TrainingMotion
from export.network import ResidualNetwork

Weights = dict[str, torch.Tensor]

_KNOWN: Final = "known"  # name of the machine's axis in a checkpoint


class Loss(NamedTuple):
    """One point of the loss curves; `train` is the mean since the point before, or a resume."""

    stage: str
    step: int
    train: float
    test: float


@dataclass(frozen=True)
class Checkpoint:
    """All that a run needs to go on exactly as if it had never stopped.

    Attributes
    ----------
    configuration : Configuration
    motion : TrainingMotion
    stage : {"head", "dense", "network"}
    step : int
        Steps done in this stage.
    elapsed_s : float
        Time spent so far, over all sessions.
    network, head : dict
        Weights; `head` is empty once it has become part of the network.
    optimizer : dict
        Of this stage; empty before its first step.
    losses : tuple of Loss
        So far.
    """

    configuration: Configuration
    motion: TrainingMotion
    stage: str
    step: int
    elapsed_s: float
    network: Weights
    head: Weights
    optimizer: dict[str, Any]
    losses: tuple[Loss, ...]

    @property
    def complete(self) -> bool:
        """Whether nothing is left to train."""
        return self.stage == "network" and self.step >= self.configuration.steps


def save(checkpoint: Checkpoint, path: Path) -> None:
    """Write a checkpoint so that the file is always whole, the old one or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(path.name + ".part")
    content = {
        **vars(checkpoint),
        "configuration": asdict(checkpoint.configuration),
        "motion": {key: _stored(value) for key, value in vars(checkpoint.motion).items()},
        "losses": [tuple(loss) for loss in checkpoint.losses],
    }
    torch.save(content, beside)
    os.replace(beside, path)


def write_losses(losses: tuple[Loss, ...], path: Path) -> None:
    """Loss curves as a table: stage, step, train and test."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(Loss._fields)
    writer.writerows(losses)
    beside = path.with_name(path.name + ".part")
    beside.write_text(text.getvalue())
    os.replace(beside, path)


def load(path: Path) -> Checkpoint:
    """Read a checkpoint.

    Raises
    ------
    ModelError
        If it is missing, damaged or no checkpoint.
    """
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        motion = {name: _restored(value) for name, value in content.pop("motion").items()}
        return Checkpoint(
            configuration=Configuration(**content.pop("configuration")),
            motion=TrainingMotion(**motion),
            losses=tuple(Loss(*loss) for loss in content.pop("losses")),
            **content,
        )
    except FileNotFoundError as error:
        raise ModelError(
            f"{path}: no such checkpoint",
            "give the path of a checkpoint, or make one with edge-ident train",
        ) from error
    except Exception as error:  # torch raises whatever the broken file provokes
        raise ModelError(
            f"{path}: not a checkpoint of edge-ident train ({type(error).__name__}: {error})",
            "give the checkpoint.pt of a training, or train again",
        ) from error


def trained_network(path: Path) -> tuple[ResidualNetwork, Checkpoint]:
    """The network of a finished run.

    Raises
    ------
    ModelError
        If the checkpoint cannot be read or its run is not finished.
    """
    checkpoint = load(path)
    if not checkpoint.complete:
        raise ModelError(
            f"{path}: stopped in stage '{checkpoint.stage}' at step {checkpoint.step}",
            "resume the training until it is finished",
        )
    network = ResidualNetwork(checkpoint.configuration.points)
    network.load_state_dict(checkpoint.network)
    return network.eval(), checkpoint


def _stored(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, AxisModel):
        return model_document(Model({_KNOWN: value}))
    return torch.from_numpy(value) if isinstance(value, np.ndarray) else value


def _restored(value: Any) -> Any:
    if isinstance(value, dict):
        return model_of(value, "checkpoint").axes[_KNOWN]
    return value.numpy() if isinstance(value, torch.Tensor) else value
