"""Whether the effort of one recording is late beside its motion, and that of another is not.

A delay is common to all recordings of a machine. One that a single file has is that of its clock,
and no model of all of them has it.
"""

from collections.abc import Mapping

from edge_ident.diagnosis.prepare.axis_data import AxisData
from edge_ident.diagnosis.prepare.timing import whole_shift
from edge_ident.diagnosis.result import AxisDiagnosis
from edge_ident.estimation.trust import Finding
from edge_ident.model.effects import named
from edge_ident.model.model import AxisModel
from edge_ident.signals.timing import beyond_limit


def may_differ(data: AxisData, model: AxisModel) -> bool:
    """Whether some recordings are late, or early, beside the terms of a model, and others not."""
    late = {
        s.motion.clock: beyond_limit(whole_shift(s, model), s.raw_period_s) for s in data.segments
    }
    return any(late.values()) and not all(late.values())


def timing_differs(alone: Mapping[str, AxisDiagnosis]) -> list[Finding]:
    """Which recordings have a delay of their own, from the diagnosis of each alone.

    Parameters
    ----------
    alone : mapping of source to AxisDiagnosis
    """
    delays = {
        source: float(cause.term.values[delay])
        for source, found in alone.items()
        for cause in found.causes
        if (delay := named(cause.term.effect).effort_delay)
    }
    in_step = [source for source in alone if source not in delays]
    if not in_step:
        return []
    return [
        Finding(
            "timing_differs",
            f"the effort of {source} is {1e3 * abs(delay):.3g} ms "
            f"{'late' if delay > 0.0 else 'early'}, and that of {in_step[0]} is not: no model fits "
            "both",
            "record both columns of all files by one clock, or diagnose each file alone",
            blocks=False,
        )
        for source, delay in delays.items()
    ]
