"""Lines above the band that alone keep an axis from being explained ask for a second motion."""

from dataclasses import replace

from edge_ident.commissioning.further_motions import lines_in_doubt
from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.result import AxisDiagnosis, OutsideVibration
from edge_ident.diagnosis.verdict import Verdict
from edge_ident.identification.identify import identify
from edge_ident.identification.result import Identification
from edge_ident.simulation.simulate import simulate
from tests.edge_ident.diagnosis.hand_made import axis

LINES = (SpectralLine(None, 9.7, 0.1, 0.01), SpectralLine(None, 14.2, 0.2, 0.01))


def doubts(diagnosis: AxisDiagnosis) -> dict[str, tuple[str, ...]]:
    sound = identify(simulate(), diagnose=False)
    return lines_in_doubt(
        Identification({"x": replace(sound.axes["x"], diagnosis=diagnosis)}, sound.timing_ms)
    )


def test_a_line_alone_is_in_doubt() -> None:
    made = axis(Verdict.UNEXPLAINED)
    within = replace(made.extended, fitted=made.noise_floor)
    alone = replace(made, lines=LINES, extended=within)
    said = "the origin of an amplitude of 0.2 at 14.2 Hz and an amplitude of 0.1 at 9.7 Hz"
    assert doubts(alone) == {"x": (said,)}
    assert doubts(replace(alone, verdict=Verdict.EXPLAINED)) == {}
    vibrating = replace(alone, external_vibrations=(OutsideVibration(3.0, 0.1, "a.csv"),))
    assert doubts(vibrating) == {}, "no motion tells more of what shakes the axis"
    assert doubts(replace(alone, extended=replace(within, fitted=0.2))) == {}
