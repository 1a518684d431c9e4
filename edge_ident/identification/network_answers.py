"""What the network says of the axes of a recording: all that it can read, in one batch."""

from collections.abc import Mapping

from edge_ident.estimation.image import Subsampled, align
from edge_ident.estimation.network import Network
from edge_ident.estimation.network_estimate import estimate_together, motion_mismatch
from edge_ident.model.model import Estimate
from edge_ident.signals.conditioning import Signals
from edge_ident.signals.recording import AxisRecord
from edge_ident.support.stopwatch import Stopwatch


def network_input(
    signals: Signals, axis: AxisRecord, network: Network | None, watch: Stopwatch
) -> Subsampled | str:
    """What the network is to read of an axis, or why it cannot read it.

    Parameters
    ----------
    signals : Signals
    axis : AxisRecord
        Tells the units.
    network : Network or None
    watch : Stopwatch
        Gets the stage "align".
    """
    if network is None:
        return "no network was given"
    motion = network.manifest.motion
    if axis.units != (motion.position_unit, motion.effort_unit):
        return (
            f"the network was trained for {motion.position_unit} and {motion.effort_unit}, "
            f"not {axis.position_unit} and {axis.effort_unit}"
        )
    with watch.stage("align"):
        found = align(signals, motion.regressor[:, 1], motion.period_s)
    if found is None:
        samples = round(motion.period_s / signals.period_s)
        if samples < len(motion.regressor):
            return f"the recording has {samples} samples a period of its motion: too few"
        return f"the recording is shorter than the {motion.period_s:.4g} s of its motion"
    mismatch, limit = motion_mismatch(found.regressor, network), network.manifest.mismatch_limit
    if mismatch > limit:
        return (
            "the axis moved otherwise than the network was trained for: "
            f"{mismatch:.0%} apart (limit {limit:.0%})"
        )
    return found


def run_network(
    inputs: Mapping[str, Subsampled | str], network: Network | None, seed: int, watch: Stopwatch
) -> dict[str, tuple[Estimate | None, str]]:
    """The network's estimate of each axis, or none, and why.

    Parameters
    ----------
    inputs : mapping of axis name to Subsampled or str
        From `network_input`.
    network : Network or None
    seed : int
        Of random starting points.
    watch : Stopwatch
        Gets the stages "cnn", and within it "image" and "network".
    """
    answers: dict[str, tuple[Estimate | None, str]] = {
        name: (None, seen) for name, seen in inputs.items() if isinstance(seen, str)
    }
    read = {name: seen for name, seen in inputs.items() if isinstance(seen, Subsampled)}
    if network is None or not read:
        return answers
    with watch.stage("cnn"):
        results = estimate_together(list(read.values()), network, seed=seed, stopwatch=watch)
    for name, result in zip(read, results, strict=True):
        estimate = Estimate(result.parameters, result.std) if result.trusted else None
        answers[name] = estimate, result.reason
    return answers
