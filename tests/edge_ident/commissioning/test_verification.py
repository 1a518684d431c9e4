"""What is said of new gains that were rolled back for a doubt."""

from dataclasses import replace

from edge_ident.commissioning.verification import GainChange, Tracking, Verification, error_fall

FINE = Tracking(1e-3, 0.3e-3, 0.05e-3, 0.02e-3)
GREW = 1.05e-3
MAY_BE_CHANCE = Tracking(1e-3, GREW, 0.1e-3, 0.02e-3)
WORSE = Tracking(1e-3, GREW, 0.03e-3, 0.02e-3)
CHANGED = Tracking(1e-3, 0.9e-3, 0.05e-3, 0.02e-3, machine_changed=0.07)


def rolled_back(**others: Tracking) -> GainChange:
    """Fine on the motion of the identification, and as told on others."""
    return GainChange(
        confirmed=False,
        verification=Verification({"x": FINE, "z": FINE}),
        others={motion: Verification({"x": FINE, "z": of}) for motion, of in others.items()},
        diagnosed={"x": (), "z": ("backlash",)},
    )


def test_what_is_worse_contradicts_the_diagnosis() -> None:
    change = rolled_back(multisine=WORSE)
    assert not change.in_doubt
    assert change.contradicted == {"z": ("backlash",)}
    assert "increased the tracking error on the multisine and were rolled back" in change.conclusion
    assert change.next_step.startswith("take the diagnosis as open")


def test_what_may_be_chance_says_so_and_contradicts_nothing() -> None:
    change = rolled_back(multisine=MAY_BE_CHANCE)
    assert change.in_doubt
    assert change.contradicted == {}
    assert "on the multisine, perhaps by chance, and were rolled back" in change.conclusion
    assert change.next_step == "try again, along a longer motion"


def test_a_machine_that_changed_is_named_with_its_share() -> None:
    change = rolled_back(multisine=CHANGED)
    assert change.contradicted == {}
    assert "the machine itself changed during the trial (axis z by 7% of its effort)" in (
        change.conclusion
    )
    assert change.next_step.startswith("leave the machine as it is")


def test_a_roll_back_without_a_diagnosis_says_where_to_look() -> None:
    change = replace(rolled_back(multisine=WORSE), diagnosed={"x": (), "z": ()})
    assert change.next_step.startswith("look for play or a resonance of axis z;")
    assert replace(change, confirmed=True).next_step == ""
    assert GainChange(False).next_step == ""


def test_an_axis_without_a_difference_is_not_said_to_follow_better() -> None:
    same = Tracking(1e-3, 1.01e-3, 0.1e-3, 0.02e-3)
    assert same.verdict == "equal"
    conclusion = GainChange(True, verification=Verification({"x": same, "z": FINE})).conclusion
    assert (
        "fell: z from 1 mrad to 0.3 mrad, 3.33 times smaller; x: unchanged within its repeatability"
    ) in conclusion
    both = GainChange(True, verification=Verification({"x": FINE, "z": FINE}))
    assert "unchanged" not in both.conclusion


def test_worse_on_one_axis_outweighs_a_doubt_on_another() -> None:
    both = Verification({"x": CHANGED, "z": WORSE})
    assert both.verdict == "worse"
    assert not both.keeps


def test_a_loop_that_is_too_lively_is_not_kept_however_small_its_error() -> None:
    lively = replace(FINE, liveliness=1.5)
    assert lively.verdict == "too lively"
    change = rolled_back(multisine=lively)
    assert change.blamed == ["z"]
    assert "made axis z too lively and were rolled back" in change.conclusion


def test_a_ratio_is_said_only_of_errors_above_what_rounding_makes() -> None:
    count = 0.75e-3
    assert error_fall(82e-3, 1.3e-3, count) == "from 82 mrad to 1.3 mrad, 63.1 times smaller"
    assert error_fall(82e-3, 0.2e-3, count) == (
        "from 82 mrad to below one encoder count (0.75 mrad)"
    )
    both = "from 0.3 mrad to 0.2 mrad, both below one encoder count"
    assert error_fall(0.3e-3, 0.2e-3, count) == both
    assert "times" not in error_fall(2e-3, 1.5e-3, count)
