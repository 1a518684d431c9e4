"""The designed loops in the frequency domain."""

from typing import TYPE_CHECKING

import numpy as np

from edge_ident.control.drive_gains import GainDesigns
from edge_ident.support.drawing import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def loop_figure(designs: GainDesigns) -> "Figure":
    """Bode diagram of every opened loop, a column per axis, with its margins in the title."""
    figure = new_figure(10, 5)
    grid = figure.subplots(2, len(designs.axes), sharex=True, squeeze=False)
    for (magnitude, phase), (name, design) in zip(grid.T, designs.axes.items(), strict=True):
        loop = designs.loops[name]
        magnitude.loglog(loop.omega_rad_s, np.abs(loop.response))
        magnitude.axhline(1.0, color="0.5", linewidth=0.8)
        magnitude.set_title(
            f"axis {name}: phase margin {design.phase_margin_deg:.0f}°, "
            f"gain margin {design.gain_margin:.3g}",
            fontsize=10,
        )
        magnitude.set_ylabel("open loop, magnitude")
        phase.semilogx(loop.omega_rad_s, np.degrees(np.unwrap(np.angle(loop.response))))
        phase.axhline(-180.0, color="0.5", linewidth=0.8)
        phase.set_ylabel("phase (°)")
        phase.set_xlabel("frequency (rad/s)")
    return figure
