"""Whether two processors answer the same."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from edge_ident.estimation.network_estimate import CONVERGED

SHARES_LIMIT: Final = CONVERGED
"""Of what fp32 residuals may differ: below it, the loop of the estimate does not see a change."""
STD_LIMIT: Final = 0.01
"""Of what parameters may differ, in standard deviations: no reader and no decision sees it."""
SAME_FLOAT: Final = 1e-9
"""Residuals that differ by less come from the same float32 output: two neighbours are at least
6e-8 apart, and the logarithm that follows rounds at 1e-15.
"""


def exact_int8() -> bool:
    """Whether onnxruntime is known to add up without saturation, and floats one by one, here.

    On x86 it does with the instructions for neural networks; without them, sums of two products
    of eight bits saturate at sixteen.
    """
    flags = Path("/proc/cpuinfo")
    known = flags.read_text("utf-8").split() if flags.exists() else []
    return "fma" in known and ("avx512_vnni" in known or "avx_vnni" in known)


def networks_agree(found: Any, wanted: Any, *, exact: bool) -> tuple[str, bool]:
    """Compare the residuals of both networks; returns how far apart, and whether that will do."""
    apart = {name: float(np.max(np.abs(np.subtract(found[name], wanted[name])))) for name in wanted}
    int8 = apart["int8"] <= (SAME_FLOAT if exact else np.inf)
    said = "identical" if apart["int8"] <= SAME_FLOAT else f"{apart['int8']:.1e} apart"
    more = "" if exact else " (not judged: this x86 processor saturates)"
    told = f"int8 {said}{more}; fp32 {apart['fp32']:.1e} apart, limit {SHARES_LIMIT:.0e}"
    return told, int8 and apart["fp32"] <= SHARES_LIMIT


def parameters_agree(found: Any, wanted: Any) -> tuple[str, bool]:
    """Compare documents of `identify --json`; returns how far apart, and whether that will do."""
    apart = [0.0]
    for name, axis in wanted["axes"].items():
        other = found["axes"][name]
        if other["trusted"] != axis["trusted"]:
            return f"axis {name} is trusted by one of the two", False
        for estimator, parameters in axis["estimators"].items():
            others = other["estimators"][estimator]
            if (others is None) != (parameters is None):
                return f"axis {name}: one of the two has no {estimator}", False
            apart += _apart(others or {}, parameters or {})
    worst = float(np.max(apart))  # a value that is no number stays one
    told = f"parameters {worst:.1e} standard deviations apart, limit {STD_LIMIT}"
    return told, worst <= STD_LIMIT


def _apart(found: Any, wanted: Any) -> list[float]:
    """Differences of an estimator's parameters, in standard deviations."""
    both = ((found[name], one) for name, one in wanted.items() if isinstance(one, dict))
    return [abs(other["value"] - one["value"]) / one["std"] for other, one in both]
