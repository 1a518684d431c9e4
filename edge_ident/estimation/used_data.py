"""What of a recording was used, and what was done to it before anything was estimated."""

from typing import Final

import numpy as np

from edge_ident.estimation.trust import Finding
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.even_rows import even_rows_sentence
from edge_ident.signals.lost_rows import lost_rows_sentence
from edge_ident.signals.resampling import UNEVEN

UNKNOWN_LIMIT: Final = 0.05
"""Share of a record that is clipped or missing, above which the rest may be another motion."""
_FEW_UNKNOWN: Final = 0.001
"""Share of such samples below which it is not worth a sentence."""


def describe_data(signals: Signals, stamp_jitter: float = 0.0, lost_rows: int = 0) -> list[Finding]:
    """What was done to the data before anything was estimated.

    Parameters
    ----------
    signals : Signals
    stamp_jitter : float
    lost_rows : int
        See `edge_ident.signals.recording.Recording`.
    """
    findings = _of_stamps(stamp_jitter, lost_rows)
    if signals.jitter > UNEVEN and not lost_rows:
        findings.append(
            Finding(
                "uneven_sampling",
                f"time stamps are up to {signals.jitter:.2g} sampling periods off an even "
                "grid; samples were interpolated",
                "record with the board's clock if results look noisy",
                blocks=False,
            )
        )
    findings += _unknown(signals)
    standing = 1.0 - float(np.mean(signals.moving))
    if standing > 0 and not signals.unknown_share:
        findings.append(
            Finding(
                "standstill",
                f"in {standing:.1%} of the recording the axis is at rest or nearly so; "
                "this part was not used",
                "use stiffer feedback or friction feed-forward to shorten the rest at reversals",
                blocks=False,
            )
        )
    return findings


def _of_stamps(stamp_jitter: float, lost_rows: int) -> list[Finding]:
    """What the time stamps did not tell, and the position did."""
    findings = []
    if stamp_jitter:
        findings.append(
            Finding(
                "jittering_stamps",
                even_rows_sentence(stamp_jitter),
                "record with the board's clock, or read the file with --period",
                blocks=False,
            )
        )
    if lost_rows:
        findings.append(
            Finding(
                "lost_rows",
                lost_rows_sentence(lost_rows),
                "look for a recorder that is too slow or a line that drops packets",
                blocks=False,
            )
        )
    return findings


def _unknown(signals: Signals) -> list[Finding]:
    """Samples inside gaps of the time stamps, or with a clipped effort."""
    share = signals.unknown_share
    if share < _FEW_UNKNOWN:
        return []
    return [
        Finding(
            "clipped_or_missing",
            f"in {share:.1%} of the recording the effort is clipped at its highest or lowest "
            "value, or samples are missing; this part was not used",
            "record with a larger range of the effort, a gentler motion, and without pauses",
            blocks=share > UNKNOWN_LIMIT,
            contradicts=share > UNKNOWN_LIMIT,
        )
    ]
