"""The examples of the docs: what each script says is what was hidden in its recording."""

import html
import io
import json
import re
import runpy
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import edge_ident
from edge_ident.model.model import PARAMETERS
from tests.repetitions import a_few
from tools import example_recordings as made

EXAMPLES = pytest.mark.parametrize("make", made.EXAMPLES, ids=lambda make: make.__name__)
Make = Callable[[], made.Example]
SMALL_BYTES = 250_000
CLOSE = 0.05
"""Relative error of whatever a script finds."""
NEAR = 0.1
"""The same of a rigid body beside a formula that is not the machine's law."""


@cache
def run(make: Make) -> tuple[dict[str, Any], str]:
    """The names that a script leaves, and what it prints."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        names = runpy.run_path(str(make().path.with_name("diagnose.py")))
    return names, " ".join(printed.getvalue().split())


def diagnosis(make: Make) -> edge_ident.Diagnosis:
    found = run(make)[0]["diagnosis"]
    assert isinstance(found, edge_ident.Diagnosis)
    return found


@EXAMPLES
def test_a_script_prints_what_its_readme_quotes(make: Make) -> None:
    readme = make().path.with_name("README.md").read_text("utf-8")
    quoted = " ".join(" ".join(re.findall(r"^    (\S.*)$", readme, re.M)).split()).split(" … ")
    assert quoted
    for text in quoted:
        assert text in run(make)[1]


@EXAMPLES
def test_a_script_finds_the_parameters_of_the_machine(make: Make) -> None:
    example = make()
    truth = example.drives.chain.rigid_body[0]
    for (name, axis), (inertia, viscous, coulomb, offset) in zip(
        diagnosis(make).axes.items(), truth, strict=True
    ):
        base = axis.model.terms[0].values
        found = [base[parameter] for parameter in PARAMETERS]
        close = NEAR if "stribeck_friction" in [c.term.effect for c in axis.causes] else CLOSE
        assert found[:3] == pytest.approx([inertia, viscous, coulomb], rel=close), name
        assert found[3] == pytest.approx(offset, abs=CLOSE * coulomb), name


def test_the_feed_drive_has_stribeck_friction_on_one_axis() -> None:
    axes = diagnosis(made.feed_drive).axes
    (cause,) = axes["x"].causes
    assert cause.term.effect == "stribeck_friction"
    speed = np.linspace(0.1, 2.0, 50)
    _, viscous, coulomb, _ = made.feed_drive().drives.chain.rigid_body[0, 0]
    more = made.STRIBECK_NM / (1.0 + (speed / made.STRIBECK_SPEED_RAD_S) ** 2)
    base, own = axes["x"].model.terms[0].values, cause.term.values
    found = own["level"] * np.exp(-((speed / own["speed"]) ** own["exponent"]))
    found += base["coulomb_friction"] + base["viscous_friction"] * speed
    assert found == pytest.approx(coulomb + viscous * speed + more, rel=CLOSE)
    assert not axes["z"].causes
    assert axes["z"].verdict == "adequate"


def test_the_magnets_of_the_linear_stage_are_found() -> None:
    names = run(made.linear_stage)[0]
    assert names["diagnosis"].axes["y"].verdict == "explained"
    assert names["force_n"] == pytest.approx(made.COGGING_N, rel=CLOSE)
    assert names["cogging"].values["period"] == pytest.approx(made.POLE_PAIR_M, rel=CLOSE)


def test_the_weight_on_the_rotary_joint_is_found() -> None:
    names = run(made.rotary_joint)[0]
    assert names["diagnosis"].axes["q"].verdict == "explained"
    found = np.hypot(names["sine"], names["cosine"])
    assert found == pytest.approx(made.GRAVITY_NM, rel=CLOSE)


@pytest.mark.parametrize(
    "make", a_few(made.EXAMPLES, [made.feed_drive]), ids=lambda make: make.__name__
)
def test_the_recording_is_the_one_that_the_plant_makes(make: Make, tmp_path: Path) -> None:
    example = make()
    again = tmp_path / example.path.name
    made.write(example, again)
    kept, new = (edge_ident.load_recording(path) for path in (example.path, again))
    for name, axis in kept.axes.items():
        few_counts = 3.0 * example.electronics.count_rad
        np.testing.assert_allclose(axis.position, new.axes[name].position, atol=few_counts)
        noise = 0.02 * np.std(axis.effort)
        np.testing.assert_allclose(axis.effort, new.axes[name].effort, atol=noise)


@EXAMPLES
def test_the_page_says_the_same_and_is_small(make: Make) -> None:
    """An older page is renewed by `python -m tools.example_recordings --pages`."""
    example = make()
    page = example.path.with_name("diagnosis") / "report.html"
    assert example.path.stat().st_size <= SMALL_BYTES
    assert page.stat().st_size <= SMALL_BYTES
    text = page.read_text("utf-8")
    (document,) = re.findall(r'<script[^>]*id="document"[^>]*>(.*?)</script>', text, re.DOTALL)
    told = json.loads(html.unescape(document))["axes"]
    for name, axis in diagnosis(make).axes.items():
        assert told[name]["verdict"] == axis.verdict
        assert [c["effect"] for c in told[name]["causes"]] == [c.term.effect for c in axis.causes]
