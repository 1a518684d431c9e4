"""The smallest effect that is worth naming."""

from typing import Final

TOLERANCE: Final = 0.01
"""Share of the rms effort that is worth naming, unless the caller says otherwise. A judgement: a
hundredth of the effort moves no gain."""
