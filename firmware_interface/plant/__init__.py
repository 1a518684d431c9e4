"""Flexible feed drives that can hide effects: the machine behind the virtual board.

They are the opponent of the estimators: no effect obeys the formula that edge_ident has for it, and
the two share no code. `Plant` is one drive, stepped sample by sample by a board. Batches run in
closed loop at once::

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

from firmware_interface.plant.drives import (
    COUNT_RAD,
    PAPER_SAMPLES,
    SAMPLE_S,
    Chain,
    Control,
    Drives,
    Motion,
    draw_drives,
    multisine,
    paper,
    staircase,
)
from firmware_interface.plant.effect import Effect, Scales
from firmware_interface.plant.hiding import EFFECTS, UNKNOWN, Hidden, draw
from firmware_interface.plant.plant import Mechanism, Plant
from firmware_interface.plant.simulation import (
    Electronics,
    Noise,
    Recordings,
    Twin,
    draw_electronics,
    draw_noise,
    simulate,
)

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
