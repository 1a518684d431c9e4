"""From gains in force to others: checked, forecast, committed, verified by motions, kept or not.

`run` and `gains commit` go the same way: a motion with the gains in force, then a `Trial` of the
new ones, which `concluded` keeps or takes back.

How large a step may be: the board's own limits hold for everybody. Beyond them, feedback from a
file may grow or shrink five times at once and not to or from zero, unless the user says
`--large-steps`: nobody knows where a file comes from. `run` may take any step that the board
allows, for its gains are designed with margins from a motion of this very drive that it has just
identified and trusts; soft start-up gains are left by a step of four times, and by feed-forward
from nothing. Either way a motion decides, and the board rolls back by itself.
"""

import logging

from edge_ident.commissioning import gain_transfer, safety
from edge_ident.commissioning.capture import Observer, capture_motion, check_drive
from edge_ident.commissioning.further_motions import NamedMotion
from edge_ident.commissioning.gain_trial import MotionBefore, Trial
from edge_ident.commissioning.verification import GainChange, verification_motion
from edge_ident.drive.description import Drive
from edge_ident.drive.motions import MotionName, named_trajectory
from edge_ident.errors import BoardError, DataError
from edge_ident.identification.identify import identify
from edge_ident.model.model import Model
from edge_ident.support.stopwatch import Stopwatch
from firmware_interface.board import Board
from firmware_interface.errors import BusyError, NoReplyError
from firmware_interface.gains import AxisGains, Bank

log = logging.getLogger(__name__)


def put_in_force(
    board: Board, wanted: Bank, before: MotionBefore, observer: Observer
) -> GainChange:
    """Forecast, stage, commit, move with the new gains, and confirm them if they keep the promise.

    Nothing is written where the forecast is not worth it, or where the board's window to confirm
    is too short for the motions.

    Parameters
    ----------
    board : Board
        At rest, enabled, within `edge_ident.commissioning.safety.left_safe`.
    wanted : mapping of axis name to AxisGains
        Checked.
    before : MotionBefore
    observer : Observer

    Raises
    ------
    BoardError
        The window is too short, or a motion did not get to its end.
    """
    trial = Trial(board, wanted, before, observer, None, Stopwatch())
    return concluded(board, trial, worth_a_write=trial.worth_a_write())


def concluded(board: Board, trial: Trial, *, worth_a_write: bool) -> GainChange:
    """Write the gains of a trial if they are worth it, and confirm them if they keep the promise.

    The rules are in `edge_ident.commissioning.promise` and in
    `edge_ident.commissioning.verification`.

    Raises
    ------
    BoardError
        A motion did not get to its end.
    """
    if not worth_a_write:
        # the last motion was left to end by itself, and no further one ends it
        board.settle()
        log.info("not worth a write: nothing is written")
        return GainChange(confirmed=False, unchanged=True, promise=trial.promise)
    trial.write()
    change = trial.verify()
    keep = change.confirmed
    _confirm_or_roll_back(board, trial.wanted if keep else trial.active, keep=keep)
    return change


def settled_gains(board: Board) -> Bank:
    """Take a board, and give the gains that are in force on it to stay while this host holds it.

    Before that, another host could put others in force, confirm them, or lose them.

    Raises
    ------
    BoardError
        They wait to be confirmed, or another host holds the board.
    """
    board.claim()
    if board.status().unconfirmed:
        raise BoardError(
            "the gains in force wait to be confirmed, or the board takes them back by itself",
            "wait for that, or take them back with: edge-ident gains rollback",
        )
    return board.active_gains()


def wanted_gains(active: Bank, file: gain_transfer.GainFile) -> dict[str, AxisGains]:
    """Gains of all axes: a file's, and those in force where it says nothing.

    Raises
    ------
    DataError
        The file names an axis that the board does not have.
    """
    for axis in file.gains:
        # a board counts its axes by its own names; a file of another machine has others
        if axis not in active:
            raise DataError(
                f"the file has gains of axis {axis}, the board has {', '.join(active)}",
                "read the recording with the board's names of axes (--column), and design anew",
            )
    return {**active, **file.gains}


def check_change(board: Board, active: Bank, wanted: Bank, large_steps: bool) -> tuple[str, ...]:
    """What is checked before gains are staged, and again before they are committed.

    Returns
    -------
    tuple of str
        Axes whose feedback could not be checked: the board states no inertia.

    Raises
    ------
    GainError
    """
    gain_transfer.check_gains(wanted, active, board.limits())
    if not large_steps:
        gain_transfer.check_factor(wanted, active)
    return gain_transfer.check_feedback(board, wanted)


def commit_staged(
    board: Board, drive: Drive, staged: Bank, observer: Observer, model: Model | None = None
) -> GainChange:
    """Move with the old gains, forecast, then move with the new ones; keep them as a run does.

    Parameters
    ----------
    board : Board
    drive : Drive
    staged : mapping of axis name to AxisGains
    observer : Observer
    model : Model, optional
        Effects that are known of the drive.
    """
    check_drive(board, drive)
    name: MotionName = "sinusoid"
    with safety.ready_to_move(board, observer.say):
        observer.stage("motion, old gains")
        trajectory = named_trajectory(drive, name, 1)
        capture = capture_motion(board, trajectory, observer.samples, say=observer.say)
        board.finish()
        found = identify(capture.recording, None, model=model, diagnose=False)
        before = MotionBefore.of(drive, name, capture, found)
        return put_in_force(board, staged, before, observer)


def restore_gains(board: Board, drive: Drive, wanted: Bank, observer: Observer) -> GainChange:
    """Stage gains of before and put them in force; they stay if the drive moves without a fault.

    It does not move with the present gains, which may be the reason for the restoration.
    """
    check_drive(board, drive)
    motion = NamedMotion("sinusoid", named_trajectory(drive, "sinusoid", 1))
    with safety.ready_to_move(board, observer.say):
        # before any motion: the gains in force may be why somebody restores others
        gain_transfer.write_gains(board, wanted)
        observer.stage("verification motion")
        after = verification_motion(board, motion, observer)
        _confirm_or_roll_back(board, wanted, keep=True)
    return GainChange(confirmed=True, tracking_after_rad=after.tracking_rms_rad)


def roll_back_unconfirmed(board: Board) -> None:
    """Take back what was committed and not confirmed.

    Raises
    ------
    BoardError
        There is nothing to take back, or the gains in force did not change.
    NoReplyError, BusyError
        The board could not be asked what became of it; a note says that nobody knows.
    """
    if not board.status().unconfirmed:
        raise BoardError(
            "the active gains are confirmed: there is nothing to roll back",
            "to return to older gains, use edge-ident gains restore with a backup",
        )
    committed = board.active_gains()
    try:
        try:
            board.roll_back()
        except BoardError:
            if board.status().unconfirmed:
                raise
            log.warning("the axes did not come to rest: the board took the gains back itself")
        left = board.active_gains()
    except (NoReplyError, BusyError, KeyboardInterrupt) as error:
        error.add_note("which gains are in force is not known: look with edge-ident gains show")
        raise
    if left == committed:
        raise BoardError(
            "the gains in force are the same as before: those of before the commit were the same, "
            "or another command came in place of ROLL_BACK",
            "look with edge-ident gains show; if they are the wrong ones, use edge-ident gains "
            "restore with a backup",
        )


def check_owner(board: Board, file: gain_transfer.GainFile) -> None:
    """Make sure that a backup goes back to the board that it came from.

    Raises
    ------
    DataError
    """
    owner, serial = file.serial_number, board.identity.serial_number
    if owner is not None and owner != serial:
        raise DataError(
            f"the backup is of board {owner}, this is board {serial}",
            "connect the right board; to copy gains to another board, use edge-ident gains stage",
        )


def _confirm_or_roll_back(board: Board, left: Bank, *, keep: bool) -> None:
    """Keep the new gains or return to the old ones; read back that it leaves these in force.

    The board's word for it is not enough: no checksum says which command it was given.
    """
    if keep:
        board.confirm()
    else:
        board.roll_back()
    gain_transfer.compare_gains(left, board.active_gains())
    log.info("gains %s", "confirmed" if keep else "rolled back")
