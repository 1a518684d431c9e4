"""A batched flexible feed drive that hides effects: the opponent of the estimators.

It shares no formula with the packages that it judges. In short::

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

from tests.plant.catalogue import EFFECTS, UNKNOWN, draw
from tests.plant.drives import COUNT_RAD, Chain, Control, Drives, draw_drives
from tests.plant.effect import Effect, Scales
from tests.plant.electronics import Electronics, Noise, draw_electronics, draw_noise
from tests.plant.mechanism import Mechanism
from tests.plant.motions import PAPER_SAMPLES, SAMPLE_S, Motion, multisine, paper, staircase
from tests.plant.simulation import Recordings, simulate

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
    "Mechanism",
    "Motion",
    "Noise",
    "Recordings",
    "Scales",
    "draw",
    "draw_drives",
    "draw_electronics",
    "draw_noise",
    "multisine",
    "paper",
    "simulate",
    "staircase",
]
