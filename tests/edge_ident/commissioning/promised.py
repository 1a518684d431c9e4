"""Promises that are not forecast: to see what becomes of gains that do not deserve them."""

from dataclasses import replace

import pytest

from edge_ident.commissioning import gain_change as gain_change
from edge_ident.commissioning import rounds
from edge_ident.commissioning.promise import Expected, ExpectedErrors, Promised
from edge_ident.control.gain_design import GainDesign
from firmware_interface.gains import AxisGains


def design_always(gains: AxisGains, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the design of every axis come out as these gains."""
    found = GainDesign(gains, 1.0, 1.0, 10.0, 0.0)
    monkeypatch.setattr(rounds, "design", lambda *_, **__: found)


def promise_a_share(monkeypatch: pytest.MonkeyPatch, share: float, spread: float = 1.1) -> None:
    """Let every error fall to a share of the present one, and the interval be that wide."""
    forecast = gain_change.promised

    def promised(*arguments: object) -> dict[str, Promised]:
        found = forecast(*arguments)  # type: ignore[arg-type]
        return {axis: replace(of, after=_share(of, share, spread)) for axis, of in found.items()}

    monkeypatch.setattr(gain_change, "promised", promised)


def _share(of: Promised, share: float, spread: float) -> ExpectedErrors:
    ends = (
        Expected(share * now, share * now / spread, share * now * spread)
        for now in (of.now.rms_rad, of.now.peak_rad)
    )
    return ExpectedErrors(*ends)
