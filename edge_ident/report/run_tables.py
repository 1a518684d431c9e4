"""A run and a latency profile as tables, by rich."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.text import Text

from edge_ident.commissioning.gains.verification import Verification
from edge_ident.commissioning.latency.result import TARGET_MS, Profile, ProfileRun, spread
from edge_ident.commissioning.run import Outcome
from edge_ident.commissioning.study.separation import Separation
from edge_ident.report.gain_report import promise_view
from edge_ident.report.identification_tables import designs_view, identification_view
from edge_ident.report.run_motions import kind, what_for, what_it_ruled_out, what_it_showed
from edge_ident.report.waterfall import bar_texts
from edge_ident.support.tables import FittingTable


def outcome_view(outcome: Outcome) -> Group:
    """Identification, motions, gains, tracking error before and after, and the conclusion."""
    return Group(*_outcome_parts(outcome))


def _outcome_parts(outcome: Outcome) -> Iterator[RenderableType]:
    yield identification_view(outcome.identification, outcome.timing_ms.get("diagnosis"))
    if outcome.early is not None:
        yield Text(outcome.early.sentence)
    if outcome.board is not None:
        yield from map(Text, outcome.board.sentences)
    if outcome.separation.ended:
        yield _motions_table(outcome.separation)
    if outcome.designs:
        yield designs_view(outcome.designs)
    if outcome.change and outcome.change.verification:
        yield _tracking_table(outcome.change.verification)
    if outcome.change and outcome.change.promise:
        yield promise_view(outcome.change.promise)
    yield Text(outcome.conclusion)
    if outcome.change and outcome.change.next_step:
        yield Text(f"  next: {outcome.change.next_step}")


def _motions_table(separation: Separation) -> FittingTable:
    """How it was found out."""
    table = FittingTable(title="how it was found out", title_justify="left")
    for heading in ("motion", "what it was for", "what is known then", "ruled out"):
        table.add_column(heading)
    for made in separation.motions:
        cells = (what_for(made), what_it_showed(made), what_it_ruled_out(made))
        table.add_row(f"{made.file}\n{kind(made)}", *cells)
    table.caption, table.caption_justify = separation.ended, "left"
    return table


def _tracking_table(verification: Verification) -> FittingTable:
    table = FittingTable(title="tracking error, rms", title_justify="left")
    for heading in ("axis", "before", "after", "smaller by", "no change below"):
        table.add_column(heading, justify="right")
    for axis, tracking in verification.axes.items():
        table.add_row(
            axis,
            f"{1e3 * tracking.before_rad:.2f} mrad",
            f"{1e3 * tracking.after_rad:.2f} mrad",
            f"{tracking.ratio:.1f}",
            f"{1e3 * tracking.repeatability_rad:.2f} mrad",
        )
    return table


def profile_view(profile: Profile) -> Group:
    """Percentiles of every stage, a table for each start and precision, and the verdict."""
    return Group(
        Text(f"{profile.device}; {profile.machine}; {profile.repetitions} repetitions"),
        *(_stage_table(run) for run in profile.runs),
        Text(profile.ways),
        Text(f"{profile.verdict} (target {TARGET_MS:.0f} ms)"),
    )


def _stage_table(run: ProfileRun) -> FittingTable:
    title = f"{run.start}, {run.precision}, {run.graph.replace('_', '-')} graph (ms)"
    table = FittingTable(title=title, title_justify="left")
    table.add_column("stage")
    for heading in ("p50", "p95", "p99", "max"):
        table.add_column(heading, justify="right")
    table.add_column("█ p50, ░ p99")
    for (stage, times), bar in zip(run.stages_ms.items(), [*bar_texts(run), ""], strict=True):
        of_stage = spread(times)
        values = (of_stage.p50, of_stage.p95, of_stage.p99, of_stage.maximum)
        table.add_row(stage.replace("_", " "), *(f"{value:.2f}" for value in values), bar)
    return table
