"""Model files: exact round trip, and errors that name the place and the next step."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edge_ident.errors import ModelError
from edge_ident.model.effect import scale_of
from edge_ident.model.effects import catalogue, random_term
from edge_ident.model.model import (
    BASE,
    PARAMETERS,
    AxisModel,
    Estimate,
    Model,
    SourceFile,
    Term,
    base_axis,
)
from edge_ident.model.model_files import load_model, save_model, sourced_model


def base(*values: float) -> Term:
    return Term(BASE, dict(zip(PARAMETERS, values, strict=True)), {"inertia": 0.01, "offset": 1e-3})


def model(*effects: Term) -> Model:
    return Model(
        {
            "x": AxisModel((base(0.43, 0.9, 1.4, 0.1 / 3), *effects)),
            "z": AxisModel((base(95.1, 203.5, 20.4, -3.2),), "m", "N"),
        },
        (SourceFile("laps.csv", "ab" * 32),),
        {"edge-ident": "0.1.0"},
    )


STRIBECK = Term("stribeck_friction", {"level": 0.3, "speed": 0.1}, {"level": 0.02})


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_every_effect_survives_a_round_trip_to_the_last_bit(name: str, tmp_path: Path) -> None:
    time = 0.01 * np.arange(1000)
    scale = scale_of(
        np.array([0.43, 0.9, 1.4, 0.0]), time, np.sin(time), np.cos(time), -np.sin(time)
    )
    drawn = random_term(name, np.random.default_rng(5), scale, "z")
    values = {key: float(value) for key, value in drawn.values.items()}
    written = model(STRIBECK, Term(name, values, {}, drawn.source_axis))
    save_model(written, tmp_path / "model.json")
    assert load_model(tmp_path / "model.json") == written


def test_units_follow_from_the_axis(tmp_path: Path) -> None:
    save_model(model(STRIBECK), tmp_path / "model.json")
    axes = json.loads((tmp_path / "model.json").read_text())["axes"]
    stribeck = axes["x"]["terms"][1]["parameters"]
    assert (stribeck["level"]["unit"], stribeck["speed"]["unit"]) == ("N*m", "rad/s")
    linear = axes["z"]["terms"][0]["parameters"]
    assert (linear["inertia"]["unit"], linear["viscous_friction"]["unit"]) == ("kg", "N*s/m")


def x_axis(document: dict[str, Any]) -> dict[str, Any]:
    return document["axes"]["x"]


def effect(document: dict[str, Any]) -> dict[str, Any]:
    return x_axis(document)["terms"][1]


def level(document: dict[str, Any]) -> dict[str, Any]:
    return effect(document)["parameters"]["level"]


CASES: dict[str, tuple[Callable[[dict[str, Any]], object], str, str]] = {
    "unknown effect": (
        lambda d: effect(d).update(effect="wear"),
        "axis x: there is no effect 'wear'",
        "backlash",
    ),
    "missing parameter": (
        lambda d: effect(d)["parameters"].pop("level"),
        "stribeck_friction, parameter level",
        "write",
    ),
    "unknown parameter": (
        lambda d: effect(d)["parameters"].update(height={}),
        "no parameter height",
        "level, speed",
    ),
    "not a number": (
        lambda d: level(d).update(value=float("nan")),
        "value is nan",
        "finite",
    ),
    "a text": (
        lambda d: level(d).update(value="0.3"),
        "value is '0.3'",
        "finite",
    ),
    "unphysical": (
        lambda d: effect(d)["parameters"]["speed"].update(value=-0.1),
        "not physical",
        "rad/s",
    ),
    "another unit": (
        lambda d: level(d).update(unit="N"),
        "unit is 'N'",
        "convert it to N*m",
    ),
    "bad std": (
        lambda d: level(d).update(std=True),
        "std is True",
        "finite",
    ),
    "negative std": (
        lambda d: level(d).update(std=-0.1),
        "std is -0.1",
        "0 or more",
    ),
    "more digits than a number has": (
        lambda d: level(d).update(value=10**400),
        "value is 1000",
        "finite",
    ),
    "two base terms": (
        lambda d: x_axis(d)["terms"].append(x_axis(d)["terms"][0]),
        "has rigid_body twice",
        "once",
    ),
    "no base term": (
        lambda d: x_axis(d)["terms"].pop(0),
        "first term is not rigid_body",
        "begin terms",
    ),
    "no terms": (lambda d: x_axis(d).pop("terms"), "first term is not rigid_body", "begin terms"),
    "unknown unit": (
        lambda d: x_axis(d).update(effort_unit="lb"),
        "effort_unit is 'lb'",
        "N*m",
    ),
    "another schema": (
        lambda d: d.update(schema="edge-ident/gains/1"),
        "schema",
        "edge-ident/model/1",
    ),
    "no provenance": (lambda d: d.pop("provenance"), "provenance", "recordings"),
    "no axes": (lambda d: d.pop("axes"), "axes is missing", "write"),
    "no such source": (
        lambda d: x_axis(d)["terms"].append(
            {
                "effect": "cross_axis_coupling",
                "source_axis": "y",
                "parameters": {
                    name: {"value": 0.1}
                    for name in ("inertia", "viscous_friction", "coulomb_friction")
                },
            }
        ),
        "source_axis is 'y'",
        "z",
    ),
    "more inertia taken than there is": (
        lambda d: x_axis(d)["terms"].append(
            {
                "effect": "backlash",
                "parameters": {
                    "gap": {"value": 0.1},
                    "load_inertia": {"value": 0.5},
                    "deceleration": {"value": 0.2},
                    "damping_rate": {"value": 0.0},
                    "weight": {"value": 0.0},
                },
            }
        ),
        "leave -0.07 of inertia",
        "raise inertia",
    ),
}


@pytest.mark.parametrize("case", sorted(CASES))
def test_what_is_wrong_is_named_with_its_place_and_a_next_step(case: str, tmp_path: Path) -> None:
    damage, cause, next_step = CASES[case]
    path = tmp_path / "model.json"
    save_model(model(STRIBECK), path)
    document = json.loads(path.read_text())
    damage(document)
    path.write_text(json.dumps(document))
    with pytest.raises(ModelError) as caught:
        load_model(path)
    assert str(path) in caught.value.cause
    assert cause in caught.value.cause
    assert next_step in caught.value.next_step
    assert "\n" not in caught.value.cause + caught.value.next_step


def test_a_file_that_is_no_json_or_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    with pytest.raises(ModelError, match="no such file"):
        load_model(path)
    path.write_text('{"schema": "edge-ident/model/1", "axes"')
    with pytest.raises(ModelError, match="not a JSON file"):
        load_model(path)
    path.write_text("[" * 100_000)
    with pytest.raises(ModelError, match="too deeply nested"):
        load_model(path)
    path.write_text("[1, 2]")
    with pytest.raises(ModelError, match="schema"):
        load_model(path)


def test_an_identification_leaves_its_numbers_and_the_recordings_hash(tmp_path: Path) -> None:
    file = tmp_path / "laps.csv"
    file.write_bytes(b"laps")
    found = Estimate(np.array([95.0, 203.0, 20.0, -3.0]), np.array([0.1, 1.0, 0.2, 0.1]))
    left = sourced_model(Model({"q": base_axis(found, "m", "N")}), [file])
    np.testing.assert_array_equal(left.axes["q"].parameters, found.parameters)
    assert left.axes["q"].terms[0].std["viscous_friction"] == 1.0
    assert (left.axes["q"].position_unit, left.axes["q"].effort_unit) == ("m", "N")
    [source] = left.recordings
    assert source.file == "laps.csv"
    assert len(source.sha256) == 64
    again = tmp_path / "again.csv"
    again.write_bytes(b"more laps")
    later = sourced_model(left, [again, file], left)
    assert [source.file for source in later.recordings] == ["again.csv", "laps.csv"]
