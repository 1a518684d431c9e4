"""No sequence of operations on the virtual board breaks anything; and what would is found."""

import pytest
from explored import BrokenError, explore

from firmware_interface.registers import Fault, State
from firmware_interface.virtual.machine import Machine
from firmware_interface.virtual.settings import GainBanks
from tests.repetitions import a_few


@pytest.mark.parametrize("depth", a_few([3, 4], [3]))
def test_no_sequence_of_operations_breaks_anything(depth: int) -> None:
    found = explore(depth)
    assert found.sequences > 24 * depth
    assert set(found.states) >= {*State} - {State.DONE}


def test_effort_that_a_fault_leaves_on_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def coast(machine: Machine) -> None:
        machine.state = State.FAULT

    monkeypatch.setattr(Machine, "coast", coast)
    with pytest.raises(BrokenError, match="effort under STO, after: ENABLE, "):
        explore(3)


def test_a_roll_back_that_does_not_come_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(GainBanks, "expired", lambda banks, now_s: False)
    with pytest.raises(BrokenError, match=r"no roll-back came, after: COMMIT, silence of 12 s"):
        explore(2)


def test_a_host_that_is_silent_in_a_motion_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a watchdog a motion ends by itself, and waits for its last page to be fetched."""
    monkeypatch.setattr(Machine, "_abandoned", False)
    with pytest.raises(BrokenError, match="an end, after: ENABLE, ARM, 25 ms, START, silence"):
        explore(2)


@pytest.mark.thorough
def test_a_fault_that_takes_no_gains_back_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    latch = Machine._latch

    def forgetful(machine: Machine, fault: Fault) -> None:
        latch(machine, fault)
        machine.roll_back_due = False

    monkeypatch.setattr(Machine, "_latch", forgetful)
    with pytest.raises(BrokenError, match="a stop or a fault, after: COMMIT, stop"):
        explore(3)
