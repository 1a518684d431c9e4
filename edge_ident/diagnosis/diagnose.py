"""Diagnose recordings of one machine: the whole procedure."""

from collections.abc import Callable, Sequence

from edge_ident.diagnosis.result import Diagnosis
from edge_ident.model import Model
from edge_ident.recording import Recording


def diagnose(
    recordings: Sequence[Recording],
    *,
    model: Model | None = None,
    validate: Recording | None = None,
    on_progress: Callable[[str, int, int], None] = lambda stage, done, of: None,
) -> Diagnosis:
    """Find what the base model gets wrong.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the same axes; fitted together.
    model : Model, optional
        Effects to start from.
    validate : Recording, optional
        Scored with the models that were fitted to the others.
    on_progress : callable
        Told the stage, and how much of it is done.

    Raises
    ------
    DataError
        An axis moves too little to say anything.
    """
    raise NotImplementedError
