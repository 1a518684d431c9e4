"""Next steps are whole commands, without what was done already."""

from edge_ident.support.next_step import PAGE, Done, whole_step

SEEN = f"see where: {PAGE}; check units"


def test_a_command_has_the_files_and_how_they_are_read() -> None:
    done = Done(("my drive.csv",), ("--column", "pos=x_position_rad"))
    assert whole_step(SEEN, done) == (
        "see where: edge-ident diagnose 'my drive.csv' --column pos=x_position_rad "
        "--output 'my drive-diagnosis'; check units"
    )
    model = Done(("a.csv",), model="old model.json")
    assert whole_step("edge-ident gains FILE --output gains.json", model) == (
        "edge-ident gains a.csv --model 'old model.json' --output gains.json"
    )
    assert whole_step("edge-ident import FILE shows them", model).startswith(
        "edge-ident import a.csv shows"
    )
    both = whole_step("edge-ident diagnose FIRST SECOND", Done(("a.csv", "b.csv")))
    assert both == "edge-ident diagnose a.csv b.csv"


def test_a_page_that_was_written_is_named_and_not_asked_for() -> None:
    said = whole_step(SEEN, Done(("a.csv",), page="a-diagnosis/report.html"))
    assert said == "see where: a-diagnosis/report.html; check units"


def test_a_motion_is_a_command_and_never_the_one_that_was_made() -> None:
    step = "record a motion of several frequencies, such as --motion multisine"
    assert whole_step(step, Done(device="tcp://board:502")) == (
        "record a motion of several frequencies: edge-ident capture --device tcp://board:502 "
        "--motion multisine"
    )
    assert whole_step(step, Done()).endswith(
        "(with a board: edge-ident capture --motion multisine)"
    )
    again = whole_step(step, Done(motion="multisine"))
    assert again.endswith("several frequencies, faster or with longer strokes than this one")
