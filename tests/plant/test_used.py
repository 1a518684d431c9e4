"""Used machines: everything a little off, and clean ones of another simulation."""

import math
from functools import cache

import numpy as np
import pytest

import edge_ident
from edge_ident import identify, load_drive
from edge_ident.commissioning.capture import capture_motion
from edge_ident.drive.motions import named_trajectory
from edge_ident.identification.result import Identification
from firmware_interface.plant import EFFECTS, UNKNOWN, Hidden, Plant, draw_drives
from firmware_interface.plant.bristles import CHAIN_HZ, BristlePlant, Bristles
from firmware_interface.plant.drives import Array
from firmware_interface.plant.used import KINDS, Cable, departures

SEED = 5


def pushed(plant: Plant, samples: int = 800) -> Array:
    """What its encoders show where a known effort moves it to and fro, (T, 2)."""
    shown = []
    for row in range(samples):
        plant.advance([3.5 * math.sin(0.02 * row), 3.5 * math.cos(0.02 * row)])
        shown.append(plant.shown_rad)
    return np.array(shown)


@cache
def base_model(hidden: str, seed: int) -> Identification:
    """The default motion of a machine, by a rigid body with friction."""
    machine = Hidden.used(seed) if hidden == "used" else Hidden.rubbing(seed, hidden)  # type: ignore[arg-type]
    with edge_ident.connect("virtual", plant=machine.plant()) as board:
        board.enable()
        motion = named_trajectory(load_drive(), "sinusoid", 1)
        capture = capture_motion(board, motion, lambda done, of: None)
        board.finish()
    return identify(capture.recording, None, diagnose=False)


@pytest.mark.parametrize("seed", [2, 10])
def test_a_rigid_body_leaves_one_to_five_percent_of_a_used_machines_effort(seed: int) -> None:
    for axis in base_model("used", seed).axes.values():
        assert 0.007 < axis.adequacy.relative_residual < 0.05
        assert 0.9985 < axis.metric.time_spectral < 0.99995


def test_a_rigid_body_is_enough_for_a_clean_machine_of_another_simulation() -> None:
    truth = Hidden.rubbing(3, "lugre").drives.chain.rigid_body[0]
    found = base_model("lugre", 3)
    assert found.trusted
    for axis, true in zip(found.axes.values(), truth, strict=True):
        assert axis.model.parameters == pytest.approx(true, rel=0.02)


def test_a_number_draws_a_machine_and_the_wear_how_much_of_it_is_off() -> None:
    new, used, worn = (Hidden.used(SEED, wear) for wear in (0.0, 1.0, 2.0))
    assert new.drives.chain.rigid_body.tolist() == worn.drives.chain.rigid_body.tolist()
    assert new.drives.chain.rigid_body.tolist() != Hidden.used(6).drives.chain.rigid_body.tolist()
    assert not new.effects
    for one, two in zip(used.effects, worn.effects, strict=True):
        np.testing.assert_allclose(2.0 * one.size, two.size)
    clean = pushed(Plant(new.drives))
    np.testing.assert_array_equal(pushed(new.plant()), clean)
    apart = [np.abs(pushed(machine.plant()) - clean).max(axis=0) for machine in (used, worn)]
    assert np.all(apart[0] > 0.005)


def test_weights_are_held_by_friction_where_nothing_else_does() -> None:
    """A drive whose weight is larger would sink before the effort is on."""
    seed = next(n for n in range(99) if heavy(n))
    plant = Hidden.used(seed, 0.0).plant()
    for _ in range(400):
        plant.advance([0.0, 0.0])
    assert np.all(np.abs(plant.output_rad) < 1e-3)


def heavy(seed: int) -> bool:
    """Whether a drawn drive cannot hold its weight."""
    chain = draw_drives(1, seed).chain
    return bool(np.any(np.abs(chain.offset) > chain.coulomb.sum(axis=0)))


@pytest.mark.parametrize("kind", KINDS)
def test_each_departure_alone_moves_the_drive_otherwise(kind: type) -> None:
    drives = Hidden.used(SEED, 0.0).drives
    (effect,) = [effect for effect, _ in departures(drives, SEED, 1.0) if type(effect) is kind]
    assert effect.name not in EFFECTS + UNKNOWN
    apart = pushed(Plant(drives, (effect,), lead_in_s=0.0)) - pushed(Plant(drives))
    assert np.all(np.abs(apart).max(axis=0) > 2e-5)


def test_a_cable_takes_energy_on_every_way_to_and_fro() -> None:
    drives = Hidden.used(SEED, 0.0).drives
    (cable,) = [e for e, _ in departures(drives, SEED, 1.0) if isinstance(e, Cable)]
    way = 3.0 * np.sin(np.linspace(0.0, 6.0 * np.pi, 6001))

    class Seen:
        angle = (0.0, 0.0, 0.0)

    own, force = cable.of_axis(0, 0), []
    for angle in way.tolist():
        Seen.angle = (angle, angle, angle)
        force.append(own.table_torque(Seen))  # type: ignore[arg-type]
    turns = [slice(2000, 4001), slice(4000, 6001)]
    spent = [float(np.trapezoid(np.array(force)[turn], way[turn])) for turn in turns]
    assert spent[0] == pytest.approx(spent[1], rel=1e-3)
    assert spent[0] > 0.1 * 12.0 * abs(own.size)


def rubbing(friction: str, rise: float) -> BristlePlant:
    """A machine without viscous friction and weight, with known bristles."""
    drives = Hidden.used(SEED, 0.0).drives
    drives.chain.viscous[:] = 0.0
    drives.chain.offset[:] = 0.0
    lugre = float(friction == "lugre")
    given = (5e-3, rise * lugre, 0.05, 0.4 * lugre)
    return BristlePlant(drives, Bristles(*(np.full(2, value) for value in given)))


@pytest.mark.parametrize(("friction", "holds"), [("lugre", 1.2), ("dahl", 1.0)])
def test_bristles_hold_up_to_their_static_friction(friction: str, holds: float) -> None:
    coulomb = Hidden.used(SEED, 0.0).drives.chain.coulomb.sum(axis=0)[0]
    for share, moves in ((0.85, False), (1.05, True)):
        plant = rubbing(friction, 0.2)
        for row in range(1600):
            rise = min(row / 800.0, 1.0)
            plant.advance((share * holds * rise * coulomb).tolist())
        assert [abs(angle) > 0.03 for angle in plant.output_rad] == [moves, moves]


def test_bristles_bend_back_after_a_small_push_and_bear_coulomb_friction_in_motion() -> None:
    plant = rubbing("dahl", 0.0)
    coulomb = Hidden.used(SEED, 0.0).drives.chain.coulomb.sum(axis=0)[0]
    turns = []
    for share in (*np.linspace(0.0, 0.3, 800), *np.linspace(0.3, 0.0, 800)):
        turns.append(np.array(plant.output_rad))
        plant.advance((share * coulomb).tolist())
    bent = turns[800]
    assert np.all(bent > 1e-3)
    assert np.all(np.abs(plant.output_rad) < 0.4 * bent)
    inertia = Hidden.used(SEED, 0.0).drives.chain.inertia.sum(axis=0)[0]
    speeds = []
    for row in range(600):
        plant.advance((2.0 * coulomb).tolist())
        if row in (199, 599):
            speeds.append(np.array(plant.output_rad_s))
    assert speeds[1] - speeds[0] == pytest.approx(coulomb / inertia, rel=1e-2)


def test_motor_and_table_swing_at_60_hz_against_each_other() -> None:
    plant = rubbing("dahl", 0.0)
    apart = []
    for row in range(400):
        plant.advance([20.0 * (row == 0)] * 2)
        apart.append(plant.output_rad[0] - plant.table_rad[0])
    spectrum = np.abs(np.fft.rfft(apart[10:], 4096))
    found = np.fft.rfftfreq(4096, 2.5e-3)[np.argmax(spectrum)]
    assert found == pytest.approx(CHAIN_HZ, rel=0.05)


def test_a_jam_stops_the_motor_and_a_broken_coupling_frees_the_motor() -> None:
    plant = rubbing("lugre", 0.1)
    for n in range(600):
        plant.advance([6.0, 6.0])
        if n == 300:
            plant.jam(0)
            plant.break_coupling(1)
            begin = np.array([plant.output_rad, plant.table_rad])
    moved = np.array([plant.output_rad, plant.table_rad]) - begin
    assert moved[0, 0] == 0.0
    assert abs(moved[1, 0]) < 0.1
    assert moved[0, 1] > 1.5 * abs(moved[1, 1])
