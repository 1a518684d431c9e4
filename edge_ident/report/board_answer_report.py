"""What the board identified by itself, as part of a run's document."""

from typing import Any

from edge_ident.commissioning.board_answer import AxisAnswer
from edge_ident.commissioning.run import Outcome
from edge_ident.identification.result import AxisIdentification
from edge_ident.model.model import PARAMETERS
from firmware_interface.registers import IdentificationReason


def board_answer_document(outcome: Outcome) -> dict[str, Any] | None:
    """The field `board_identification` of schema edge-ident/run/1; null without a network."""
    answer = outcome.board
    if answer is None:
        return None
    return {
        "state": answer.state.name,
        "network": f"{answer.network:08x}",
        "axes": {
            name: _axis(axis, outcome.identification.axes[name])
            for name, axis in answer.axes.items()
        },
    }


def _axis(answer: AxisAnswer, own: AxisIdentification) -> dict[str, Any]:
    identified = answer.board.reason is IdentificationReason.NONE
    again = answer.recomputed
    return {
        "verdict": answer.verdict.value,
        "said": answer.sentence,
        "reason": answer.board.reason.name,
        "images": answer.board.images,
        "relative_residual": answer.board.relative_residual if identified else None,
        "deviations": answer.deviations if identified else None,
        "parameters": {
            name: {
                "value": answer.board.parameters[i],
                "std": None if answer.std is None else float(answer.std[i]),
                "difference": float(answer.difference[i]),
                "recomputed": None if again is None else float(again[i]),
                "unit": own.units[i],
            }
            for i, name in enumerate(PARAMETERS)
        }
        if identified
        else None,
    }
