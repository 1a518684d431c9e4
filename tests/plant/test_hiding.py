"""Faults by name, size and axis, or drawn by a number, in the drive behind a virtual board."""

from pathlib import Path

import numpy as np
import pytest

from firmware_interface.plant import EFFECTS, UNKNOWN, Plant
from firmware_interface.plant.effect import Effect
from firmware_interface.plant.feed_drive import FEED_DRIVE, feed_drive
from firmware_interface.plant.hiding import Hidden, default_strength


def test_the_truth_is_what_the_drive_has() -> None:
    (fault,) = Hidden.of(["stribeck_friction=0.5"], "z").faults
    assert (fault.effect, fault.axis, fault.strength) == ("stribeck_friction", "z", 0.5)
    assert fault.size == pytest.approx(0.5 * FEED_DRIVE["z"].coulomb_friction)
    assert (fault.unit, set(fault.values)) == ("N*m", {"speed"})
    hidden = Hidden.of(["backlash=0.02", "payload_change"])
    assert [effect.hit.tolist() for effect in hidden.effects] == [[[True, False]]] * 2
    assert hidden.faults[0].size == 0.02


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_more_than_coulomb_friction_holds_a_drive_with_stribeck_friction(direction: float) -> None:
    z = FEED_DRIVE["z"]
    effort = z.offset + direction * 1.3 * z.coulomb_friction
    sound, faulty = Plant(feed_drive()), Hidden.of(["stribeck_friction=0.5"], "z").plant()
    for _ in range(400):
        sound.advance([0.0, effort])
        faulty.advance([0.0, effort])
    assert direction * sound.output_rad[1] > 0.1
    assert abs(faulty.output_rad[1]) < 0.002


@pytest.mark.parametrize("name", EFFECTS + UNKNOWN)
def test_every_effect_has_a_size_that_acts_and_spares_the_other_axis(name: str) -> None:
    """Without a size, pushed to and fro by a known effort; the sound drive is pushed likewise."""
    hidden = Hidden.of([name], "x")
    drives = hidden.plant(), Plant(feed_drive())
    for plant in drives:
        plant._time_s = 0.0
    difference = np.zeros(2)
    for row in range(8742):
        command = [3.5 * np.sin(0.006 * row), 3.0 * np.cos(0.006 * row)]
        seen = [np.array([*p.shown_rad, *p.recorded_nm(command)]) for p in drives]
        apart = abs(seen[0] - seen[1]).reshape(2, 2).max(axis=0)
        difference = np.maximum(difference, apart)
        if row > 400 and difference[0] > 1e-3:
            break
        for plant in drives:
            plant.advance(command)
    assert difference[0] > 1e-3
    assert difference[1] == 0.0


def test_a_number_draws_one_or_two_effects_and_always_the_same() -> None:
    drawn = [Hidden.drawn(seed).faults for seed in range(60)]
    assert {len(faults) for faults in drawn} == {1, 2}
    assert {fault.axis for faults in drawn for fault in faults} == {"x", "z"}
    assert len({fault.effect for faults in drawn for fault in faults}) > len(EFFECTS) / 2
    assert Hidden.drawn(7).faults == drawn[7]
    assert {fault.axis for fault in Hidden.drawn(7, "z").faults} == {"z"}
    for fault in (fault for faults in drawn for fault in faults):
        faint, strong = Effect.kinds[fault.effect].span
        assert (faint * strong) ** 0.5 <= abs(fault.strength) <= strong


def test_what_a_size_leaves_open_is_drawn_by_the_number() -> None:
    speeds = [
        Hidden.of(["stribeck_friction=0.5"], seed=seed).faults[0].values["speed"]
        for seed in (1, 1, 2)
    ]
    assert speeds[0] == speeds[1] != speeds[2]


@pytest.mark.parametrize(
    ("wish", "reason"),
    [
        ("backlsh", "did you mean backlash"),
        ("backlash=wide", "'wide' is not a number"),
        ("backlash=0_1", "'0_1' is not a number"),
        ("backlash=0", "but not 0"),
        ("backlash=-0.01", "from 0 to 0.3"),
        ("backlash=1", "from 0 to 0.3"),
        ("time_delay=-0.01", "from 0"),
        ("warm_up=nan", "from 0"),
    ],
)
def test_a_wish_that_cannot_be_met_says_why(wish: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Hidden.of([wish])


def test_an_effect_is_there_once() -> None:
    with pytest.raises(ValueError, match="backlash is there twice"):
        Hidden.of(["backlash", "backlash=0.02"])


def test_the_page_lists_every_effect_with_its_measure_and_sizes() -> None:
    page = (Path(__file__).parents[2] / "docs" / "virtual_board.md").read_text("utf-8")
    listed = [line for line in page.splitlines() if line.startswith("| `") and " to " in line]
    expected = [
        f"| `{name}` | {kind.measure} | {default_strength(name):.2g} "
        f"| {kind.span[0]:.3g} to {kind.span[1]:.3g} |"
        for name, kind in ((name, Effect.kinds[name]) for name in EFFECTS + UNKNOWN)
    ]
    assert listed == expected


def test_what_a_board_records_is_not_hidden_in_a_machine_alone() -> None:
    with pytest.raises(ValueError, match="acts in a board's record"):
        Hidden.of(["time_delay"], of_machine=True)
    drawn = [Hidden.drawn(seed, of_machine=True).faults for seed in range(100)]
    assert "time_delay" not in {fault.effect for faults in drawn for fault in faults}
    every = [Hidden.drawn(seed).faults for seed in range(100)]
    assert "time_delay" in {fault.effect for faults in every for fault in faults}
