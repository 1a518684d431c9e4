"""Whether an axis follows its reference, as a finding."""

from collections.abc import Sequence

from edge_ident.estimation.trust import Finding
from edge_ident.signals.recording import Recording
from edge_ident.signals.tracking import OFF, tracking


def check_tracking(recordings: Sequence[Recording], name: str) -> list[Finding]:
    """Say of each recording in which an axis does not follow its reference where and by how much.

    It blocks nothing: the effort may well be that of the motion that was made.
    """
    found = []
    for recording in recordings:
        seen = tracking(recording, name) if name in recording.axes else None
        if seen is not None and seen.off:
            said = seen.sentence(recording.axes[name].position_unit)
            where = f"in {recording.source}, " if len(recordings) > 1 else ""
            found.append(Finding(OFF, where + said, seen.next_step, blocks=False))
    return found


def off_reference(findings: Sequence[Finding]) -> Finding | None:
    """The finding that an axis does not follow its reference, None where it does."""
    return next((finding for finding in findings if finding.code == OFF), None)
