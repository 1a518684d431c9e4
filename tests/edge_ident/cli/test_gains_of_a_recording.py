"""`edge-ident gains FILE`: what is designed, and what is said of what a recording cannot show."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app
from edge_ident.signals.recording import AxisRecord, Recording

COUNT = 2.0 * np.pi / 8400.0


def gains(file: Path, *arguments: object) -> Result:
    return CliRunner().invoke(app, ["gains", str(file), *map(str, arguments)])


def said(done: Result) -> str:
    return " ".join(done.stderr.split())


def recorded(path: Path, units: tuple[str, str] = ("rad", "N*m")) -> Path:
    """One slow sinusoid, with an effort of which most is noise."""
    time_s = 0.0025 * np.arange(8000)
    speed = 1.5 * np.cos(1.5 * time_s)
    effort = -0.43 * 2.25 * np.sin(1.5 * time_s) + 0.9 * speed + 1.4 * np.sign(speed)
    effort += 8.0 * np.random.default_rng(2).standard_normal(len(time_s))
    position = COUNT * np.round(np.sin(1.5 * time_s) / COUNT)
    record = Recording(time_s, {"x": AxisRecord(position, effort, *units)}, "test")
    edge_ident.save_recording(record, path)
    return path


def test_what_is_not_trusted_has_gains_with_margins_over_its_intervals(tmp_path: Path) -> None:
    done = gains(recorded(tmp_path / "noisy.npz"), "--no-diagnose", "--json")
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert not document["identification"]["axes"]["x"]["trusted"]
    assert document["axes"]["x"]["phase_margin_deg"] >= 50.0


def test_the_loop_that_gains_are_for_is_told_with_what_no_margin_knows(tmp_path: Path) -> None:
    done = gains(recorded(tmp_path / "noisy.npz"), "--no-diagnose")
    assert "designed for 400 Hz, 0.5 ms from encoder to effort, and at most x 12 N·m: the" in said(
        done
    )
    assert "give yours with --drive and --control-delay" in said(done)
    (moved, acts) = map(float, re.findall(r"up to ([0-9.]+) Hz", said(done)))
    assert moved == pytest.approx(1.5 / (2.0 * np.pi), rel=0.5)
    assert acts > 1.0


def test_units_of_no_motor_are_refused_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(edge_ident, "identify", lambda *_, **__: pytest.fail("identified"))
    done = gains(recorded(tmp_path / "stage.npz", ("m", "N")))
    assert "the axis is in m and N" in said(done)
    assert "--unit 'x_position_m=25 turn'" in said(done)
