"""What new gains promised, what was measured, and how they came into force, as documents."""

from collections.abc import Iterator
from typing import Any

from edge_ident.commissioning.promise import Expected, ExpectedErrors, Promise, Promised
from edge_ident.commissioning.verification import GainChange
from edge_ident.support.documents import finite


def promise_document(promise: Promise | None) -> dict[str, Any] | None:
    """By axis and motion: measured now, forecast of both, measured afterwards, kept or not."""
    if promise is None:
        return None
    found: dict[str, Any] = {}
    for motion, axis, of_axis in promise.every:
        found.setdefault(axis, {})[motion] = _promised(of_axis, promise.judged)
    return found


def _promised(of_axis: Promised, judged: int) -> dict[str, Any]:
    then, measured = of_axis.after, of_axis.measured
    return {
        "now": {"rms_rad": of_axis.now.rms_rad, "peak_rad": of_axis.now.peak_rad},
        "now_forecast": _errors(of_axis.now_forecast),
        "bias": finite(of_axis.bias),
        "after": {
            "rms_rad": finite(then.rms.middle_rad),
            "peak_rad": finite(then.peak.middle_rad),
        },
        "interval": {"rms_rad": _interval(then.rms), "peak_rad": _interval(then.peak)},
        "limit": {
            "rms_rad": finite(of_axis.rms_limit_rad(judged)),
            "peak_rad": finite(of_axis.peak_limit_rad(judged)),
        },
        "improvement": finite(of_axis.improvement),
        "tried": measured is not None,
        "measured": None
        if measured is None
        else {"rms_rad": measured.rms_rad, "peak_rad": measured.peak_rad},
        "kept": of_axis.kept(judged),
    }


def _errors(of: ExpectedErrors) -> dict[str, Any]:
    return {
        "rms_rad": finite(of.rms.middle_rad),
        "rms_interval_rad": _interval(of.rms),
        "peak_rad": finite(of.peak.middle_rad),
        "peak_interval_rad": _interval(of.peak),
    }


def _interval(of: Expected) -> list[float | None]:
    return [finite(of.low_rad), finite(of.high_rad)]


def commit_document(change: GainChange | None) -> dict[str, Any] | None:
    """How new gains came into force; None where none were written."""
    if change is None or change.unchanged or change.dry_run:
        return None
    running = change.running
    return {
        "running": running is not None and running.taken,
        "jump_nm": None if running is None else dict(running.jumps_nm),
        "refused": None if running is None or running.taken else running.result.name,
    }


def tried(promise: Promise) -> bool:
    """Whether a motion was made with the new gains."""
    return any(of_axis.measured is not None for *_, of_axis in promise.every)


def promise_rows(promise: Promise) -> Iterator[tuple[str, ...]]:
    """Motion, axis, quantity; now, promised, limit, measured (mrad); and whether it was kept."""
    for motion, axis, of_axis in promise.every:
        limits_rad = {
            "rms": of_axis.rms_limit_rad(promise.judged),
            "peak": of_axis.peak_limit_rad(promise.judged),
        }
        for quantity, limit_rad in limits_rad.items():
            name, tracked = f"{quantity}_rad", of_axis.measured
            measured_rad = None if tracked is None else getattr(tracked, name)
            yield (
                motion,
                axis,
                quantity,
                _mrad(getattr(of_axis.now, name)),
                _span(getattr(of_axis.after, quantity)),
                _mrad(limit_rad),
                "" if measured_rad is None else _mrad(measured_rad),
                "" if measured_rad is None else "yes" if measured_rad <= limit_rad else "no",
            )


def _span(of: Expected) -> str:
    return f"{_mrad(of.middle_rad)} ({_mrad(of.low_rad)} to {_mrad(of.high_rad)})"


def _mrad(value_rad: float) -> str:
    return f"{1e3 * value_rad:.3g}"
