"""A new effect is one file, and one class in the independent plant; nothing else names it."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from edge_ident.control.gain_design import design
from edge_ident.control.position_loop import LoopHardware
from edge_ident.diagnosis.diagnose import diagnose
from edge_ident.diagnosis.fit.candidates import candidates
from edge_ident.errors import ModelError
from edge_ident.identification.identify import identify
from edge_ident.model import effects
from edge_ident.model.effects import catalogue, named
from edge_ident.model.inverse import inverse_effort
from edge_ident.model.model import BASE, PARAMETERS, AxisModel, Model, SupportedRange, Term
from edge_ident.model.model_files import load_model, save_model
from edge_ident.model.motion import Motion
from edge_ident.model.search import Form
from edge_ident.signals.recording import AxisRecord, Recording
from edge_ident.simulation.loop import recorded_references
from edge_ident.simulation.simulate import Scenario, record
from firmware_interface.control_law import feedforward_nm
from firmware_interface.motion import Reference
from firmware_interface.plant import Drives, Electronics, draw, draw_drives, multisine, simulate
from firmware_interface.plant.effect import Effect as PlantEffect
from firmware_interface.plant.effect import Scales, State
from firmware_interface.plant.hiding import names_of
from tests.edge_ident.diagnosis.select.test_search_parts import recorded, rigid, swing
from tools import effect_pages

NAME = "magnetic_brake"
FILE = '''"""Magnetic brake: a drag that fades with speed, as eddy currents screen the field.

f = level·v·speed/(v² + speed²), most at the speed.
Source: Smythe, Trans. AIEE 61 (1942) 681.
"""

import numpy as np

from edge_ident.model.effect import Advice
from edge_ident.model.effect import Compensation
from edge_ident.model.effect import Effect, Parameter
from edge_ident.model.search import Form, SearchSpec


class MagneticBrake(Effect):
    """Drag of eddy currents."""

    parameters = (
        Parameter("level", "{effort}", 0.0, 1e9, "twice the largest drag"),
        Parameter("speed", "{position}/s", 1e-9, 1e9, "at which the drag is largest"),
    )

    def load(self, at, values):
        """Against the motion."""
        v, speed = at.velocity, values["speed"]
        return values["level"] * v * speed / (v**2 + speed**2)


EFFECT = MagneticBrake(
    advice=Advice("drag fades with speed", "magnets near the axis", "Move the magnets away."),
    search=SearchSpec(
        forms=(Form(("level",), ("speed",)),),
        signature="drag is largest at one speed and falls beyond it",
        alternatives=("nonlinear_viscous",),
        experiment="many speeds both ways: --motion staircase",
        grid=lambda excitation: {"speed": excitation.speed * np.geomspace(0.05, 1.0, 8)},
    ),
    draw=lambda draws, scale: {
        "level": draws.strength() * scale.effort,
        "speed": draws.uniform(0.1, 0.8) * scale.speed,
    },
    compensation=Compensation(over="speed"),
)
'''
HARDWARE = LoopHardware(0.0025, 0.0005, 7.5e-4, 12.0)
TRUTH = (0.43, 0.9, 1.4, 0.1)
BRAKE = Term(NAME, {"level": 1.5, "speed": 0.6})
RANGE = SupportedRange((-1.3, 1.3), (-2.4, 2.4), (-7.0, 7.0), (-9.0, 9.0))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A second folder of the package of effects."""
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    catalogue.cache_clear()
    yield tmp_path
    monkeypatch.undo()
    catalogue.cache_clear()
    sys.modules.pop(f"{effects.__name__}.{NAME}", None)


@pytest.fixture
def brake(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The new effect: its file, and its class in the plant."""
    (folder / f"{NAME}.py").write_text(FILE, encoding="utf-8")
    monkeypatch.setattr(PlantEffect, "kinds", dict(PlantEffect.kinds))

    @dataclass(frozen=True)
    class Brake(PlantEffect):
        name: ClassVar[str] = NAME
        span: ClassVar[tuple[float, float]] = (0.01, 0.5)
        fastest: np.ndarray

        @classmethod
        def draw(cls, strength: np.ndarray, rng: np.random.Generator, scales: Scales) -> "Brake":
            return cls(strength * scales.effort_rms, 0.3 * scales.peak_speed)

        def table_torque(self, state: State) -> np.ndarray:
            ratio = state.velocity[2] / self.fastest
            return self.size * ratio / (1.0 + ratio**2)


def model(*terms: Term) -> Model:
    base = Term(BASE, dict(zip(PARAMETERS, TRUTH, strict=True)))
    return Model({"x": AxisModel((base, *terms))})


@pytest.mark.usefixtures("brake")
def test_the_library_knows_it(tmp_path: Path) -> None:
    assert NAME in catalogue()
    save_model(model(BRAKE), tmp_path / "model.json")
    assert load_model(tmp_path / "model.json").axes["x"].terms[1].values == BRAKE.values
    motion = Motion.known(*(np.array([0.0, 1.0, 2.0]),) * 2, np.array([0.3, 0.6, 6.0]), np.zeros(3))
    added = [inverse_effort(model(*terms).axes["x"], motion) for terms in ((BRAKE,), ())]
    np.testing.assert_allclose(added[0] - added[1], [0.6, 0.75, 1.5 * 3.6 / 36.36])


@pytest.mark.usefixtures("brake")
def test_it_is_simulated_and_compensated_and_its_gains_are_reported() -> None:
    time = 0.0025 * np.arange(2400)
    position = np.sin(1.7 * time) + 0.25 * np.sin(4.3 * time + 1.0)
    moved = Recording(time, {"x": AxisRecord(position, 0 * time, "rad", "N*m")}, "motion")
    scenario = Scenario(recorded_references(moved, {"x": "rad"}), noise=0.005)
    recording = record(model(BRAKE), scenario, "test")
    ignorant, knowing = (
        identify(recording, None, model=known, diagnose=False).axes["x"]
        for known in (None, model(BRAKE))
    )
    assert knowing.compensated_effects == (NAME,)
    assert knowing.estimate.parameters[1] == pytest.approx(TRUTH[1], rel=0.02)
    assert abs(ignorant.estimate.parameters[1] - TRUTH[1]) > 0.1 * TRUTH[1]
    (unused,) = design(knowing.model, HARDWARE).unused
    assert unused.reason == "the model does not say in which range it is supported"


@pytest.mark.usefixtures("brake")
def test_gains_cure_it_by_its_declaration_alone() -> None:
    knowing, ignorant = (
        design(model(*terms).axes["x"], HARDWARE)
        for terms in ((replace(BRAKE, supported=RANGE),), ())
    )
    assert [used.effect for used in knowing.used] == [NAME]
    speed = np.linspace(-2.4, 2.4, 49)
    still = np.zeros(49)
    added = [
        feedforward_nm(found.gains, Reference(still, speed, still), np)
        for found in (knowing, ignorant)
    ]
    drag = 1.5 * speed * 0.6 / (speed**2 + 0.6**2)
    np.testing.assert_allclose(added[0] - added[1], drag, atol=0.01)


@pytest.mark.usefixtures("brake")
def test_the_diagnosis_searches_for_it_and_the_page_describes_it() -> None:
    class View:
        reverses, late, several_speeds, own = True, False, True, ("offset",)

        def sources(self, form: Form) -> tuple[str | None, ...]:
            return ("z",) if form.coupled else (None,)

    assert NAME in {found.effect for found in candidates(View(), rotary=True)}
    page = effect_pages.render()
    assert f"## {NAME}" in page
    assert "drag is largest at one speed and falls beyond it" in page


@pytest.mark.usefixtures("brake")
def test_the_diagnosis_names_it() -> None:
    t, x, v, a = swing(seconds=10.0)
    brake = 0.6 * v * 0.5 / (v**2 + 0.5**2)
    axis = diagnose([recorded(t, x, rigid(v, a) + brake, noise=0.02)]).axes["x"]
    (cause,) = axis.causes
    assert cause.term.effect == NAME
    assert cause.term.values["level"] == pytest.approx(0.6, rel=0.1)
    assert cause.term.values["speed"] == pytest.approx(0.5, rel=0.1)


@pytest.mark.usefixtures("brake")
def test_the_independent_plant_hides_it() -> None:
    assert names_of(in_catalogue=True)[-1] == NAME
    drives: Drives = draw_drives(2, 31)
    motion = multisine(2000, seed=1)
    felt = draw([NAME], drives, motion, 3, strength=1.0)
    exact = Electronics(count_rad=0.0, effort_step_nm=0.0)
    with_it, without = (
        simulate(drives, motion, effects=some, electronics=exact).effort for some in (felt, ())
    )
    assert np.all(np.std(with_it - without, axis=-1) > 0.1 * np.std(without, axis=-1))


BROKEN = {
    'Form(("level",), ("speed",))': ('Form(("level", "speed"),)', "not linear in level, speed"),
    'alternatives=("nonlinear_viscous",)': ('alternatives=("wear",)', "'wear' is no other effect"),
    '"{effort}"': ('"{force}"', "unit of parameter level"),
    "def load(": ("def reading(", "reading and not true_motion"),
    "def load(self, at, values)": ("def loads(self, at, values)", "overrides no hook"),
    '{"speed": excitation': ('{"rate": excitation', "names rate, which is no parameter"),
    'over="speed"': ("feedforward={'level': 'brake'}", "names brake, which is no gain"),
    '"speed"),': ('"position"),', "depends on more than position"),
    '    compensation=Compensation(over="speed"),\n': ("", "or why they do nothing"),
    "    parameters = (": ("    memory_size = 2\n    parameters = (", "does not override rates"),
    '"magnets near the axis"': ('""', "its advice lacks"),
    "EFFECT = ": ("EFFECTS = ", "holds no EFFECT"),
}  # fmt: skip


@pytest.mark.parametrize("part", BROKEN)
def test_a_file_that_breaks_a_rule_is_refused(folder: Path, part: str) -> None:
    instead, message = BROKEN[part]
    (folder / f"{NAME}.py").write_text(FILE.replace(part, instead), encoding="utf-8")
    with pytest.raises(ModelError, match=message) as caught:
        named(NAME)
    assert caught.value.next_step == f"correct edge_ident/model/effects/{NAME}.py"
