"""A latency profile as tables, by rich."""

from rich.console import Group
from rich.text import Text

from edge_ident.commissioning.latency import TARGET_MS, Profile, ProfileRun, spread
from edge_ident.report.waterfall import bar_texts
from edge_ident.support.console import FittingTable


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
