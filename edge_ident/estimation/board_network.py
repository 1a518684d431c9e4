"""The network as a board runs it: one period of one motion, in int8, without least squares.

`edge-ident export --c` and a firmware built with it do what this file says, number by number. A
virtual board calls this file itself, and `run` asks it what the board should have said.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from edge_ident.estimation.alignment import Subsampled
from edge_ident.estimation.image import effort_scale
from edge_ident.estimation.network import Network
from edge_ident.estimation.network_estimate import estimate_together, motion_mismatch
from edge_ident.signals.one_period import (
    Blocks,
    KnownMotion,
    Period,
    condition_period,
    period_samples,
)
