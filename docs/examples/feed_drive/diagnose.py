"""What is wrong with this feed drive, and how much better is the model that knows it?"""

from pathlib import Path

import edge_ident

recording = edge_ident.load_recording(Path(__file__).with_name("recording.npz"))
diagnosis = edge_ident.diagnose([recording])
print(diagnosis)

found = edge_ident.identify(recording, model=diagnosis.model)
print(found)
print(edge_ident.design_gains(diagnosis.model))
