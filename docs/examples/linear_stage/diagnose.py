"""How far apart are the magnets of this linear motor, and how strongly do they pull?"""

from math import hypot
from pathlib import Path

import edge_ident

recording = edge_ident.load_recording(Path(__file__).with_name("recording.csv"))
diagnosis = edge_ident.diagnose([recording])
print(diagnosis)

cogging = next(c.term for c in diagnosis.axes["y"].causes if c.term.effect == "torque_ripple")
force_n = hypot(cogging.values["cosine"], cogging.values["sine"])
print(f"cogging: {force_n:.2f} N, every {1e3 * cogging.values['period']:.2f} mm")
