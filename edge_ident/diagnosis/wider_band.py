"""A second look, in a wider band.

The band of the comparison ends where the encoder's noise covers most of what is seen. Play,
presliding and a compliant chain act at reversals, so mostly above it; strong ones show through the
noise all the same. So where nothing is named, and the base model leaves more than noise in a wider
band, causes are looked for there as well.

Three things are no cause there. What explains little of what the base model leaves, although the
rest is not worth naming. Where the usual band holds nothing to explain, what is tied to a moment: a
wider band holds more of a sound chain's ringing after a jerk, which happens once as well. Where it
holds something that nothing explains, anything that was not suspected there.
"""

from typing import Final

from edge_ident.diagnosis.fit.fitting import FittedModel
from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.diagnosis.select.acceptance import beyond, explains_most, noise_limit
from edge_ident.diagnosis.structure_elsewhere import leaves_structure
from edge_ident.diagnosis.verdict import Verdict
from edge_ident.model.effects import named

WIDENING: Final = 2.0
"""Factor between the bands. At the end of the wider one the filter leaves a sixty-fourth, so a
still wider one shows next to nothing (`edge_ident.diagnosis.prepare.bandwidth`)."""
_WORTH: Final = 1.2
"""Least factor that pays: the sampling rate and the length of a recording limit it."""


def is_open(found: AxisDiagnosis, in_band: Verdict) -> bool:
    """Whether a diagnosis names nothing, though the recordings allow it, and a wider band could
    change that.

    Parameters
    ----------
    found : AxisDiagnosis
    in_band : Verdict
        Without what lies above the band.
    """
    allowed = not any(finding.blocks for finding in found.findings)
    clueless = in_band is Verdict.UNEXPLAINED and not found.suspected
    return allowed and not found.causes and not clueless


def shows_more(data: AxisData, usual: AxisData, base: FittedModel) -> bool:
    """Whether a band is wider indeed than the usual one, and the base model leaves more than noise
    and the errors of the formulas there."""
    wide_hz, usual_hz = (max(s.cutoff_hz for s in each.segments) for each in (data, usual))
    return wide_hz >= _WORTH * usual_hz and leaves_structure(data, base, base, tolerance=0.0)


def settles(again: AxisDiagnosis, found: AxisDiagnosis, in_band: Verdict) -> bool:
    """Whether the diagnosis in the wider band is that of the axis, and not the first one.

    Parameters
    ----------
    again, found : AxisDiagnosis
        In the wider band, and in the usual one.
    in_band : Verdict
        In the usual one, without what lies above it.
    """
    if again.verdict is not Verdict.EXPLAINED:
        return False
    noise = noise_limit(again.noise_floor, uncertainty=0.0)
    before, after = (beyond(fit.fitted, noise) for fit in (again.base, again.extended))
    if not explains_most(before, after).accepted:
        return False
    causes = {cause.term.effect for cause in again.causes}
    if in_band is Verdict.ADEQUATE:
        return not any(named(effect).tied_to_time for effect in causes)
    return causes <= {cause.term.effect for cause in found.suspected}
