"""Flexible feed drives that can hide effects: the machine behind the virtual board.

They are the opponent of the estimators, and share no formula with edge_ident. `Plant` is one drive,
stepped sample by sample by a board. Batches run in closed loop at once::

    drives = draw_drives(200, seed=1)
    motion = paper()  # or multisine(), staircase(), a quarter: paper(2186, phase_rad=...)
    effects = draw(["stribeck_friction"], drives, motion, seed=2)
    recordings = simulate(drives, motion, effects=effects, noise=Noise(0.02), seed=3)
    recordings.position, .effort  # (B, 2, N)
    recordings.base, .truth  # (B, 2, 4): without the effects; with what they change in the four

Boards and noise of every drive's own: `electronics=draw_electronics((200, 2), seed=4)` and
`noise=draw_noise(200, seed=5)`.

Use batches of 100 to 400 drives: smaller ones waste time, larger ones memory.
"""

from firmware_interface.plant.catalogue import EFFECTS, UNKNOWN, draw
from firmware_interface.plant.drives import COUNT_RAD, Chain, Control, Drives, draw_drives
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.electronics import Electronics, Noise, draw_electronics, draw_noise
from firmware_interface.plant.hiding import Hidden
from firmware_interface.plant.mechanism import Mechanism
from firmware_interface.plant.motions import (
    PAPER_SAMPLES,
    SAMPLE_S,
    Motion,
    multisine,
    paper,
    staircase,
)
from firmware_interface.plant.plant import Plant
from firmware_interface.plant.simulation import Recordings, simulate
from firmware_interface.plant.twin import Twin

__all__ = [
    "COUNT_RAD",
    "EFFECTS",
    "PAPER_SAMPLES",
    "SAMPLE_S",
    "UNKNOWN",
    "Chain",
    "Control",
    "Drives",
    "Effect",
    "Electronics",
    "Hidden",
    "Mechanism",
    "Motion",
    "Noise",
    "Plant",
    "Recordings",
    "Scales",
    "Twin",
    "draw",
    "draw_drives",
    "draw_electronics",
    "draw_noise",
    "multisine",
    "paper",
    "simulate",
    "staircase",
]
