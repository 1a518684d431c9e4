"""Manifests come back from their files as they were described."""

import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from edge_ident.estimation.manifest import Evaluation, Manifest, load_manifest
from export.configuration import IMPROVED, PAPER, Configuration
from export.manifest import describe, with_figures, write
from export.motion import paper_motion

CONTENTS = {"fp32": b"thirty-two", "int8": b"eight"}


def figures(name: str, rms: float) -> Evaluation:
    errors = rms * np.array([1.0, 2.0, 3.0, 4.0])
    return Evaluation(name, 10, 0.01, 0.02, errors, 0.5 * errors, 2.0 * errors)


def assert_same(found: object, wanted: object) -> None:
    """Equal in everything, arrays included."""
    if hasattr(wanted, "__dataclass_fields__"):
        for field in fields(wanted):  # type: ignore[arg-type]
            assert_same(getattr(found, field.name), getattr(wanted, field.name))
    elif isinstance(wanted, tuple | list):
        assert isinstance(found, tuple | list)
        for one, other in zip(found, wanted, strict=True):
            assert_same(one, other)
    elif isinstance(wanted, dict):
        assert isinstance(found, dict)
        assert set(found) == set(wanted)
        for key in wanted:
            assert_same(found[key], wanted[key])
    elif isinstance(wanted, np.ndarray):
        np.testing.assert_array_equal(found, wanted)
    else:
        assert found == wanted


def round_trip(manifest: Manifest, path: Path) -> Manifest:
    write(manifest, path)
    return load_manifest(path)


@pytest.mark.parametrize("configuration", [IMPROVED, PAPER], ids=["start set", "start null"])
def test_a_manifest_comes_back_as_it_was_described(
    tmp_path: Path, configuration: Configuration
) -> None:
    described = describe(configuration, paper_motion(), CONTENTS)
    evaluation = (figures("noisy", 0.01), figures("noisy_int8", 0.02), figures("clean", 0.001))
    manifest = with_figures(described, evaluation, np.array([0.1, 0.2, 0.3, 0.4]))
    path = tmp_path / "feed_drive.json"
    assert_same(round_trip(manifest, path), manifest)
    start = json.loads(path.read_text())["start_shares"]
    assert start == (None if configuration.start_shares is None else [0.5, 0.5, 0.5, 0.0])


def test_it_holds_the_motion_in_its_own_units(tmp_path: Path) -> None:
    motion = replace(paper_motion(), position_unit="m", effort_unit="N")
    found = round_trip(describe(IMPROVED, motion, CONTENTS), tmp_path / "m.json").motion
    assert (found.position_unit, found.effort_unit) == ("m", "N")
    assert found.period_s == pytest.approx(8742 * 0.0025)
    angle = 2.0 * np.pi * (np.arange(100) + 0.5) / 100
    np.testing.assert_allclose(found.regressor[:, 1], 1.80642 * np.cos(angle), atol=5e-3)
    np.testing.assert_allclose(found.column_scales, [0.519345, 1.806416, 1.0, 1.0], rtol=1e-5)


def test_hashes_are_those_of_the_files() -> None:
    described = describe(IMPROVED, paper_motion(), CONTENTS)
    # printf eight | sha256sum
    assert described.sha256["int8"].startswith("c195d2d87562")
    assert described.sha256["fp32"] != described.sha256["int8"]


def test_deviations_are_those_of_noisy_drives_and_no_smaller_for_int8() -> None:
    described = describe(IMPROVED, paper_motion(), CONTENTS)
    evaluation = (figures("noisy", 0.02), figures("noisy_int8", 0.01), figures("clean", 0.001))
    found = with_figures(described, evaluation, np.zeros(4)).parameter_std
    np.testing.assert_allclose(found["fp32"], [0.02, 0.04, 0.06, 0.08])
    np.testing.assert_allclose(found["int8"], found["fp32"])
