"""All motions of a machine together: what the last of them settles.

The recordings are diagnosed as one. What belongs to the time of a recording does not allow that:
a machine that has warmed up, or whose amplifier has drifted, is another one in the next recording.
Where such a cause is in question, and one model leaves far more of all recordings than each of them
leaves with its own, the last recording is diagnosed by itself. An effect that its motion would have
shown, and that it does not show, is ruled out; the explanation of the recordings before stays.

Above the band, a line in time is a vibration from outside if other motions hold it, too. One that
the recordings before do not hold, or that the last one certainly does not, comes from the motion
itself: from friction at its reversals. Where the base model was enough for the recordings before,
so does an order without a name.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from edge_ident.diagnosis.above_band.held import held
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.measures import TOLERANCE, SpectralLine, Verdict
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.experiment.open_causes import explanations, structure_in_band, tied_to_time, without
from edge_ident.experiment.result import MotionPlan, PlannedPair
from edge_ident.model.model import Model
from edge_ident.signals.metrics import rms
from edge_ident.signals.recording import Recording

Progress = Callable[[str, int, int], None]

# Residual of one model for all recordings, over that of a model for each, from which the machine
# changed in between: the sum of two independent errors is 1.4 times as large as one.
_CHANGED: Final = 2.0


def diagnose_together(
    recordings: Sequence[Recording],
    names: Collection[str],
    *,
    before: Mapping[str, AxisDiagnosis],
    plan: MotionPlan | None,
    model: Model | None,
    on_progress: Progress,
) -> dict[str, AxisDiagnosis]:
    """Diagnose axes on all recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        The last one is that of the motion which was made for what was open.
    names : collection of str
        Axes whose base model is not adequate on each of them, or not to be trusted.
    before : mapping of axis name to AxisDiagnosis
        On the recordings but the last, where there is one.
    plan : MotionPlan or None
        What the last motion was designed for.
    model : Model or None
        Effects that the machine is known to have.
    on_progress : callable

    Raises
    ------
    DataError
        An axis hardly moves.
    """

    def judged(name: str) -> AxisDiagnosis:
        earlier = before.get(name)
        together = _diagnosed(recordings, name, recordings[0], model, on_progress)
        together = _without_own_lines(together, earlier, recordings[-1], name)
        if earlier is None or together.verdict.complete:
            return together
        if not tied_to_time(earlier):
            return together
        alone = _diagnosed(recordings[-1:], name, recordings[0], model, on_progress)
        if not _changed(together, earlier, alone):
            return together
        asked = plan.pairs if plan is not None else ()
        pairs = [pair for pair in asked if pair.axis == name and pair.separated]
        return _settled(earlier, alone, pairs, recordings[-1].source)

    return {name: judged(name) for name in names}


def _diagnosed(
    recordings: Sequence[Recording],
    name: str,
    first: Recording,
    model: Model | None,
    on_progress: Progress,
) -> AxisDiagnosis:
    """What is worth naming on the first motion is worth naming beside a livelier one."""
    efforts = np.concatenate([recording.axes[name].effort for recording in recordings])
    share = rms(first.axes[name].effort) / rms(efforts)
    found = diagnose(
        recordings,
        model=model,
        tolerance=TOLERANCE * min(share, 1.0),
        keep_minor=True,
        only=[name],
        on_progress=on_progress,
    )
    return found.axes[name]


def _without_own_lines(
    together: AxisDiagnosis, earlier: AxisDiagnosis | None, last: Recording, name: str
) -> AxisDiagnosis:
    """The diagnosis without lines that only the last motion holds, or only those before.

    Those of an order stay where the axis was diagnosed before.
    """
    resolved_hz = 1.0 / float(last.time_s[-1] - last.time_s[0])
    known = [line.frequency_hz for line in (earlier.lines if earlier else ()) if line.frequency_hz]

    def lasts(line: SpectralLine) -> bool:
        found = line.frequency_hz
        if found is None:
            return earlier is not None
        if not any(abs(found - other) < resolved_hz for other in known):
            return False
        # inside the band of a livelier motion, the comparison tells
        return found >= together.cutoff_hz or structure_in_band(together)

    lasting = [line for line in together.lines if lasts(line)]
    above = [line for line in lasting if (line.frequency_hz or 0.0) >= together.cutoff_hz]
    gone = set(above).difference(held(last, name, above, together.model))
    lines = tuple(line for line in lasting if line not in gone)
    if lines == together.lines:
        return together
    verdict = together.verdict
    if not (lines or together.external_vibrations or structure_in_band(together)):
        verdict = _without_lines(together)
    return replace(together, lines=lines, verdict=verdict)


def _without_lines(axis: AxisDiagnosis) -> Verdict:
    """The verdict on an axis that lines alone kept open. Curves stand in its model where the base
    model leaves structure in the band that no cause names."""
    if axis.curves:
        return Verdict.PARTLY_EXPLAINED
    return Verdict.EXPLAINED if axis.causes else Verdict.ADEQUATE


def _changed(together: AxisDiagnosis, earlier: AxisDiagnosis, alone: AxisDiagnosis) -> bool:
    """Whether one model leaves more of all recordings than each leaves with its own."""
    apart = max(earlier.extended.fitted, alone.extended.fitted)
    return together.extended.fitted > _CHANGED * apart


def _settled(
    earlier: AxisDiagnosis, alone: AxisDiagnosis, pairs: Sequence[PlannedPair], source: str
) -> AxisDiagnosis:
    """The explanation of before, without what the last motion would have shown."""
    sought = {effect for pair in pairs for effect in (pair.first, pair.second) if effect}
    return without(
        earlier, sought - explanations(alone), f"{source} would have shown it, and does not"
    )
