"""How heavy is the arm on this joint, and where does it hang down?"""

from math import atan2, degrees, hypot
from pathlib import Path

import edge_ident

recording = edge_ident.load_recording(Path(__file__).with_name("recording.csv"))
diagnosis = edge_ident.diagnose([recording])
print(diagnosis)

load = next(
    c.term for c in diagnosis.axes["q"].causes if c.term.effect == "position_dependent_load"
)
sine, cosine = load.values["sine"], load.values["cosine"]
print(f"mass times lever: {hypot(sine, cosine) / 9.81:.3f} kg*m")
print(f"the arm hangs down at {degrees(-atan2(cosine, sine)):.1f} degrees")
