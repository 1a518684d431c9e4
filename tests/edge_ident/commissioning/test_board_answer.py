"""The board's answer beside this host's: what it means where they agree, and where they do not."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import edge_ident
from edge_ident.commissioning.board_answer import (
    LONGEST_WAIT_S,
    BoardAnswer,
    Verdict,
    board_answer,
    counts_of,
)
from edge_ident.errors import LinkError
from edge_ident.estimation.network import load_network
from edge_ident.estimation.network_estimate import (
    BoardNetwork,
    NetworkEstimate,
    why_not_on_a_board,
)
from edge_ident.identification.result import Identification
from edge_ident.signals.recording import Recording
from firmware_interface.board_identification import BoardAxis, BoardIdentification, network_code
from firmware_interface.board_types import BoardIdentity
from firmware_interface.registers import AXES, IdentificationReason, IdentificationState

IDENTITY = BoardIdentity("2.0", 1, 1, 0.0025, 0.0005, 8400, float(np.float32(0.004)))
NETWORK = load_network("int8")
CODE = network_code(NETWORK.sha256)


@cache
def recording() -> Recording:
    return edge_ident.simulate()


@cache
def said() -> dict[str, tuple[BoardAxis, NetworkEstimate | None]]:
    """What a board says that computes as it should."""
    return BoardNetwork(NETWORK).estimates(counts_of(recording(), IDENTITY, AXES), IDENTITY)


@pytest.fixture(scope="module")
def found() -> Identification:
    return edge_ident.identify(recording())


def asked(
    axes: dict[str, BoardAxis],
    found: Identification,
    network: int = CODE,
    state: IdentificationState = IdentificationState.DONE,
) -> BoardAnswer:
    """What comes of a board that says this."""

    class Saying:
        identity = IDENTITY

        def identification(self, longest_s: float) -> BoardIdentification:
            assert longest_s == LONGEST_WAIT_S
            return BoardIdentification(state, 1, network, axes)

    board: Any = Saying()
    answer = board_answer(board, recording(), found, None)
    assert answer is not None
    return answer


def true_axes() -> dict[str, BoardAxis]:
    return {name: axis for name, (axis, _) in said().items()}


def moved(deviations: float) -> dict[str, BoardAxis]:
    """The board's answer with another inertia of x, in standard deviations of its network."""
    axis, estimate = said()["x"]
    assert estimate is not None
    inertia = axis.parameters[0] + deviations * float(estimate.std[0])
    return true_axes() | {"x": replace(axis, parameters=(inertia, *axis.parameters[1:]))}


def test_a_board_that_computes_as_it_should_agrees(found: Identification) -> None:
    answer = asked(true_axes(), found)
    for name, axis in answer.axes.items():
        assert axis.verdict is Verdict.AGREES
        own = found.axes[name].estimate.parameters
        np.testing.assert_array_equal(axis.difference, np.array(axis.board.parameters) - own)
        assert "agrees with this host" in axis.sentence
    assert answer.sentences[0].startswith("axis x: the board's own network finds inertia 0.4")


def test_rounding_is_no_error_of_the_firmware(found: Identification) -> None:
    assert asked(moved(0.5), found).axes["x"].verdict is Verdict.AGREES


def test_a_firmware_that_computes_otherwise_is_told_from_a_method_that_does(
    found: Identification,
) -> None:
    answer = asked(moved(2.0), found)
    assert answer.axes["x"].verdict is Verdict.COMPUTES_OTHERWISE
    assert "check the firmware's build" in answer.axes["x"].sentence
    assert answer.axes["z"].verdict is Verdict.AGREES


def test_a_difference_beyond_what_is_explained_is_said(found: Identification) -> None:
    """This host's least squares put elsewhere, as by an effect: the network is where it was."""
    axis = found.axes["x"]
    apart = 10.0 * np.hypot(axis.estimate.std, said()["x"][1].std)  # type: ignore[union-attr]
    estimate = replace(axis.estimate, parameters=axis.estimate.parameters + apart)
    elsewhere = replace(found, axes={**found.axes, "x": replace(axis, estimate=estimate)})
    answer = asked(true_axes(), elsewhere).axes["x"]
    assert answer.verdict is Verdict.DIFFERS
    assert answer.deviations == pytest.approx(10.0, abs=1.0)
    assert "finds the same with its network" in answer.sentence
    adequacy = replace(axis.adequacy, everywhere=1.0)
    inadequate = replace(axis, estimate=estimate, adequacy=adequacy)
    assert not adequacy.adequate
    answer = asked(true_axes(), replace(found, axes={**found.axes, "x": inadequate})).axes["x"]
    assert "the base model, which is all that the board knows" in answer.sentence


def test_another_network_is_not_judged(found: Identification) -> None:
    answer = asked(true_axes(), found, network=5)
    for axis in answer.axes.values():
        assert axis.verdict is Verdict.UNKNOWN_NETWORK
        assert axis.std is axis.recomputed is None


def test_a_reason_is_passed_on_with_its_next_step(found: Identification) -> None:
    axes = dict.fromkeys(AXES, BoardAxis(IdentificationReason.STANDSTILL))
    answer = asked(axes, found, state=IdentificationState.FAILED)
    assert answer.axes["x"].verdict is Verdict.NOT_IDENTIFIED
    assert "the axis stood still; next: look whether the axis is blocked" in answer.sentences[0]


def test_a_board_that_is_slow_is_not_waited_for(found: Identification) -> None:
    answer = asked({}, found, state=IdentificationState.RUNNING)
    assert answer.sentences == ["the board's own network had no answer after 4 s"]


def test_no_network_and_no_answer_are_no_failure(found: Identification) -> None:
    class Silent:
        identity = IDENTITY

        def identification(self, longest_s: float) -> BoardIdentification | None:
            raise LinkError("no", "none")

    board: Any = Silent()
    assert board_answer(board, recording(), found, None) is None


def test_networks_that_no_board_can_run_are_told() -> None:
    manifest = NETWORK.manifest
    assert why_not_on_a_board(manifest) == ""
    assert "random starts" in why_not_on_a_board(replace(manifest, start_shares=None))
    linear = replace(manifest.motion, position_unit="m", effort_unit="N")
    assert "m and N" in why_not_on_a_board(replace(manifest, motion=linear))
    known = replace(manifest.motion, effects=("backlash",))
    assert "backlash" in why_not_on_a_board(replace(manifest, motion=known))
