"""Commands that move the axes and record: run, the whole job on a board; capture; and report."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

import edge_ident
from edge_ident import commissioning, report
from edge_ident.cli import options
from edge_ident.cli.command import UNTRUSTED, command, noting
from edge_ident.cli.messages import print_result, say, shown_progress
from edge_ident.cli.options import Setting, setting
from edge_ident.cli.sessions import session
from edge_ident.support.next_step import Done

if TYPE_CHECKING:
    from edge_ident import Drive
    from edge_ident.commissioning.identification_motions import Plan


# The command run: the whole job on a board.

_WRITES: Final = (
    "gains_before.json", "capture*.npz", "verification*.npz", "model.json", "report.html",
    "report.json",
)  # fmt: skip


@dataclass(frozen=True)
class PlanOptions:
    """What a run is to do, and how far it may go to find out what is wrong.

    Attributes
    ----------
    most_motions : NUMBER
        Largest number of identification motions. Those after the first are designed to separate the
        causes that the diagnosis leaves open.
    most_seconds : NUMBER
        Longest duration of all identification motions together, in s; default: no limit.
    until : SHARE
        End the first motion early: as soon as the half-width of each 95 % interval is at most this
        share of its parameter (for the offset: of the Coulomb friction), such as 2% or 0.02.
    dry_run
        Write no gains; forecast the tracking error with them.
    store
        Store confirmed gains in the board's permanent memory.
    no_diagnose
        Do not diagnose axes whose base model is not enough.
    diagnose_first
        Diagnose before any gains are written, and not afterwards.
    diagnose_within : NUMBER
        Longest time for the diagnosis of all axes, in s; motions are not counted.
    """

    context: typer.Context
    motion: Setting[options.MotionName] = "sinusoid"
    cycles: options.Cycles = None
    most_motions: Annotated[int, setting(min=1, max=9)] = 3
    most_seconds: Annotated[float | None, setting(min=1.0)] = None
    until: Annotated[float | None, setting(parser=options.true_part)] = None
    bandwidth: options.Bandwidth = None
    dry_run: bool = False
    store: bool = False
    seed: options.Seed = 0
    no_diagnose: Setting[bool] = False
    diagnose_first: Setting[bool] = False
    diagnose_within: Annotated[float, setting(min=0.0)] = 60.0

    def plan(self, known: "edge_ident.Model | None") -> "Plan":
        """The plan of the run, with effects that are known."""
        if self.dry_run and self.store:
            raise typer.BadParameter("a dry run has no gains to store", param_hint="--store")
        return commissioning.identification_motions.Plan(
            motion=self.motion,
            cycles=options.periods(self.context, self.motion, self.cycles),
            bandwidth_rad_s=self.bandwidth,
            write=not self.dry_run,
            store=self.store,
            seed=self.seed,
            model=known,
            diagnose=not self.no_diagnose,
            diagnose_first=self.diagnose_first,
            diagnose_within_s=self.diagnose_within,
            most_motions=self.most_motions,
            most_s=math.inf if self.most_seconds is None else self.most_seconds,
            until=self.until,
        )


def register(app: typer.Typer) -> None:
    """Add this file's commands."""
    app.command()(run)
    app.command()(capture)
    app.command("report")(draw_report)


@command
def run(
    *,
    where: options.BoardOptions,
    wanted: PlanOptions,
    network: options.NetworkOptions,
    model: Setting[Path | None] = None,
    faults: options.HideOptions,
    machine: Setting[str] = "",
    details: bool = False,
    results: options.ResultOptions,
) -> None:
    """Move the axes, identify the drive, design gains, write them, and verify them by motions.

    The gains are designed for the machine as it is, also where its model is incomplete. They keep
    their stability margins for all parameters within their 95 % intervals. After writing they are
    read back. They stay if no axis follows worse on two motions; otherwise the old gains are
    restored. From these motions, better gains are designed. At most three sets are written, and
    each only if the forecast promises at least 5 % less tracking error.

    Then each axis is diagnosed whose base model (rigid body and friction) is not enough. If several
    explanations remain, the command designs, announces and makes further motions. Ctrl-C ends the
    command; confirmed gains stay. The results are printed and written to the folder given by
    --output; existing files are never overwritten. Without --output, each run gets a folder, named
    by date and time, in edge-ident-runs or in the folder of the setting output.

    With --until 2%, the first motion ends as soon as every parameter is known to 2 %, and the
    result says how much of the motion was needed. New gains are then verified on that part.

    Example: `edge-ident run --device /dev/ttyACM0 --dry-run`

    Example: `edge-ident run --device virtual --until 3%`
    """
    known, hidden = options.given_model(model), faults.hidden()
    plan, done = wanted.plan(known), list[str]()
    with noting(done):
        with session(wanted.context, where, results.output, _WRITES, hidden) as opened:
            _check_time(plan, opened.drive)
            board, drive, folder, loaded = opened.board, opened.drive, opened.folder, network.load()
            with shown_progress() as bars:
                outcome = commissioning.run.commission(board, drive, loaded, plan, folder, bars)
                done.append(outcome.conclusion)  # a full disk or Ctrl-C no longer changes it
        outcome = _with_next_steps(outcome, folder, opened.device, plan.motion)
        document = report.run_documents.run_document(outcome, board.identity, loaded, folder)
        try:
            found, captures = outcome.identification, outcome.captures(folder)
            options.save_result_model(found.model, captures, folder, known)
            page = report.run_page.write_run_page(outcome, document, folder, opened.device, machine)
            faults.add_to(document, hidden)
            options.deliver(document, "report.json", folder, as_json=results.json)
        finally:  # also where the disk is full
            if not results.json:  # then rich is not loaded, 2 MiB
                report.render.show(report.run.outcome_view(outcome, opened.device, details=details))
    if not results.json:
        faults.tell(hidden)
        say(f"written: {page}")
    if not outcome.good:
        raise typer.Exit(UNTRUSTED)


def _with_next_steps(
    outcome: "commissioning.run.Outcome", folder: Path, device: str, motion: str
) -> "commissioning.run.Outcome":
    """The outcome with next steps after a run on this board, whose page is in the folder."""
    captures = tuple(map(str, outcome.captures(folder)))
    done = Done(captures, (), str(folder / "report.html"), device, motion)
    return replace(
        outcome, identification=report.findings.with_next_steps(outcome.identification, done)
    )


def _check_time(plan: "Plan", drive: "Drive") -> None:
    """Refuse a first motion that takes longer than all may take."""
    first = commissioning.motions.named_trajectory(drive, plan.motion, plan.cycles)
    takes_s = first.lead_in_s + first.duration_s
    if takes_s > plan.most_s:
        raise typer.BadParameter(
            f"the first motion takes {takes_s:.1f} s, and more where its way there is long",
            param_hint="--most-seconds",
        )


# The command capture: a motion and its recording.

_CAPTURE_WRITES: Final = ("capture*.npz", "capture.json")


@command
def capture(
    *,
    context: typer.Context,
    where: options.BoardOptions,
    motion: Setting[str] = "sinusoid",
    cycles: options.Cycles = None,
    faults: options.HideOptions,
    results: options.ResultOptions,
) -> None:
    """Move the axes and record the motion; no gains are written.

    The recording is written to capture.npz in the folder given by --output, which must not hold a
    recording yet. Without --output, each capture gets a folder, named by date and time, in
    edge-ident-runs or in the folder of the setting output. The path of the recording is printed.

    Example: `edge-ident capture --device virtual --motion multisine --output captures/a`

    Parameters
    ----------
    motion : sinusoid|multisine|staircase|FILE
        Motion that the axes make, or a file that plan wrote.
    """
    options.check_named(motion)
    cycles = options.periods(context, motion, cycles)
    followed: Any = motion if motion in options.MOTIONS else edge_ident.load_motion(motion)
    hidden = faults.hidden()
    with session(context, where, results.output, _CAPTURE_WRITES, hidden) as opened:
        path = opened.folder / commissioning.identification_motions.CAPTURE_FILE
        with shown_progress() as bars:
            found = commissioning.capture.record_motion(
                opened.board, opened.drive, followed, cycles, path, bars
            )
    document = report.run_documents.capture_document(found, path)
    faults.add_to(document, hidden)
    options.deliver(document, "capture.json", opened.folder, path, as_json=results.json)
    if not results.json:
        faults.tell(hidden)
        say(f"identify it with: edge-ident identify {path}")


# The command report: what a run measured, as a figure.


@command
def draw_report(
    *,
    folder: Annotated[Path, typer.Argument()],
    results: options.ResultOptions,
) -> None:
    """Draw the results of a run: effort and model, residual, tracking error before and after.

    The figure is written to report.png in the folder of the run, or in the folder given by
    --output. Its path is printed.

    Example: `edge-ident report edge-ident-runs/2026-01-31T09-15-00`

    Parameters
    ----------
    folder : FOLDER
        Folder written by run or capture.
    """
    figure = report.render.drawn(report.run.run_charts(folder))
    picture = report.render.save_figure(figure, results.file("report.png") or folder / "report.png")
    document = {"schema": "edge-ident/report/1", "figure": str(picture)}
    print_result(document, picture, as_json=results.json)
