"""The tool that measures what an early end of the motion saves, and costs."""

from tools.early_answer import row, table


def test_a_sound_drive_is_identified_from_both_motions() -> None:
    one = row("sound", 2, "sinusoid", 1, 0.05)
    assert one["whole"]["share"] == 1.0
    assert not one["whole"]["reached"]
    assert one["until"]["reached"]
    assert 7.0 / 12.0 < one["until"]["share"] < 1.0
    told = table([one])
    assert "1 drives, 0 that the board stopped; 1 motions ended early" in told
    for axis in one["until"]["axes"].values():
        assert max(axis["errors"][:3]) < 0.05, "the bound that was asked for"


def test_a_fault_that_only_the_whole_motion_shows_is_counted() -> None:
    def seen(adequate: bool, reached: bool) -> dict:
        axes = {"x": {"adequate": adequate, "trusted": True}}
        return {"share": 0.9 if reached else 1.0, "reached": reached, "axes": axes}

    rows = [
        {"kind": "single", "seed": 7, "whole": seen(False, False), "until": seen(True, True)},
        {"kind": "single", "seed": 8, "whole": seen(False, False), "until": seen(False, False)},
        {"kind": "single", "seed": 9, "error": "fault FOLLOWING_ERROR"},
    ]
    assert "2 whole motions show" in table(rows)
    assert "1 ended early: 7" in table(rows)
