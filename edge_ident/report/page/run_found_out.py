"""How a run found out what is wrong, for its page: each motion, and what it ruled out."""

from edge_ident.commissioning.separation import Separation
from edge_ident.experiment.result import QUANTITIES
from edge_ident.report.page.card import Row, Table
from edge_ident.report.run_motions import kind, peaks, what_for, what_it_ruled_out, what_it_showed


def found_out(separation: Separation) -> Table:
    """A row for each identification motion."""
    rows: list[Row] = [
        (
            f"{made.file}: {kind(made)}",
            what_for(made),
            what_it_showed(made),
            what_it_ruled_out(made) or "nothing",
        )
        for made in separation.motions
    ]
    headings = ("motion", "what it was for", "what is known then", "what it ruled out")
    return Table("Identification motions", headings, rows)


def peaks_table(separation: Separation) -> Table:
    """What each motion asked of each axis: as commanded, and the effort as recorded."""
    headings = ("motion, axis", *(f"{name} ({unit})" for name, _, unit in QUANTITIES))
    rows: list[Row] = [
        (f"{made.file}, {axis}", *(f"{of[field]:.3g}" for _, field, _ in QUANTITIES))
        for made in separation.motions
        for axis, of in peaks(made).items()
    ]
    return Table("Peaks: motion as commanded, effort as recorded", headings, rows)
