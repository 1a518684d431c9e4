"""What a program gives: one recording or many, paths, results; and what it is told."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import edge_ident
from edge_ident.model import effects
from edge_ident.model.effect import scale_of
from edge_ident.model.effects import random_term
from edge_ident.signals.recording_files import in_python

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def recording() -> edge_ident.Recording:
    return edge_ident.simulate()


@pytest.fixture(scope="module")
def found(recording: edge_ident.Recording) -> edge_ident.Identification:
    return edge_ident.identify(recording)


@pytest.fixture(scope="module")
def diagnosis(recording: edge_ident.Recording) -> edge_ident.Diagnosis:
    return edge_ident.diagnose(recording)


def with_term(*given: object) -> edge_ident.Model:
    base = edge_ident.reduced_model().axes["x"].terms[0]
    return edge_ident.Model({"x": edge_ident.AxisModel((base, edge_ident.Term(*given)))})


@pytest.fixture(scope="module")
def file(recording: edge_ident.Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("given") / "drive.csv"
    edge_ident.save_recording(recording, path)
    return path


def test_a_path_a_recording_and_a_list_of_one_are_the_same(
    file: Path, recording: edge_ident.Recording, found: edge_ident.Identification
) -> None:
    for given in (file, str(file), [file], recording, (recording,)):
        same = edge_ident.identify(given, diagnose=False)
        assert np.allclose(
            same.axes["x"].estimate.parameters, found.axes["x"].estimate.parameters, rtol=1e-6
        )


def test_a_result_or_a_file_stands_for_its_model(
    found: edge_ident.Identification, diagnosis: edge_ident.Diagnosis, tmp_path: Path
) -> None:
    edge_ident.save_model(found, tmp_path / "model.json")
    wanted = edge_ident.design_gains(found.model).axes["x"].gains
    for given in (found, tmp_path / "model.json"):
        assert edge_ident.design_gains(given).axes["x"].gains == wanted
    assert edge_ident.design_gains(diagnosis).axes["x"].sound


WRONG: dict[str, Callable[[edge_ident.Recording], object]] = {
    "speed missing": lambda r: edge_ident.simulate(with_term("stribeck_friction", {"level": 0.2})),
    "no effect 'stribek'": lambda r: edge_ident.simulate(with_term("stribek", {})),
    "no parameter rate": lambda r: edge_ident.simulate(
        with_term("stribeck_friction", {"level": 0.2, "speed": 1.0, "rate": 2.0})
    ),
    "not a finite number": lambda r: edge_ident.simulate(
        with_term("stribeck_friction", {"level": "much", "speed": 1.0})
    ),
    "speed missing ": lambda r: edge_ident.save_model(
        with_term("stribeck_friction", {"level": 0.2}), "never.json"
    ),
    "the model has no axis": lambda r: edge_ident.simulate(edge_ident.Model({})),
    "no such file": lambda r: edge_ident.identify("nowhere.csv"),
    "2 recordings to identify": lambda r: edge_ident.identify([r, r]),
    "None is no recording": lambda r: edge_ident.diagnose(None),
    "an int is no recording": lambda r: edge_ident.diagnose([r, 5]),
    "a Recording is no model": edge_ident.design_gains,
    "tolerance is 'much'": lambda r: edge_ident.diagnose(r, tolerance="much"),
    "tolerance is 1.0": lambda r: edge_ident.diagnose(r, tolerance=1.0),
    "no axis q": lambda r: edge_ident.diagnose(r, only="q"),
    "bandwidth_rad_s is -3": lambda r: edge_ident.design_gains(
        edge_ident.reduced_model(), bandwidth_rad_s=-3
    ),
    "a Recording is no Diagnosis": lambda r: edge_ident.plan_motion(r, r),
    "a Recording is no network": lambda r: edge_ident.identify(r, r),
    "an int is no path": lambda r: edge_ident.load_drive(3),
    "an int is no path ": lambda r: edge_ident.survey(3),
    "a Recording is no Trajectory": lambda r: edge_ident.save_motion(r, "never.json"),
    "no method divination": lambda r: edge_ident.compare(r, methods="divination"),
    "seed is -1": lambda r: edge_ident.simulate(seed=-1),
    "seed is -2": lambda r: edge_ident.plan_motion(edge_ident.diagnose(r), r, seed=-2),
    "seed is 0.5": lambda r: edge_ident.compare(r, seed=0.5),
    "a ReadOptions is no Mapping": lambda r: edge_ident.load_recording(
        "x.csv", edge_ident.ReadOptions()
    ),
    "period_s is -1": lambda r: edge_ident.ReadOptions(period_s=-1),
    "effort_shift_s is 'a'": lambda r: edge_ident.ReadOptions(effort_shift_s="a"),
    "an int is no str": lambda r: edge_ident.ReadOptions(resolution=8192),
    "cycles is 0": lambda r: edge_ident.simulate(cycles=0),
    "a dict is no ReadOptions": lambda r: edge_ident.load_recording("x.csv", options={"a": 1}),
    "a list is no Mapping": lambda r: edge_ident.ReadOptions(columns=[("a", "b")]),
    "an int is no AxisModel": lambda r: edge_ident.Model({"x": 3}),
    "no variant net.onnx": lambda r: edge_ident.load_network("net.onnx"),
    "a tuple is no AxisRecord": lambda r: edge_ident.identify(
        edge_ident.Recording(r.time_s, {"x": (1, 2)}, "made")
    ),
}


@pytest.mark.parametrize("said", WRONG)
def test_what_is_wrong_is_said_with_a_next_step(
    said: str, recording: edge_ident.Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(edge_ident.EdgeIdentError, match=re.escape(said.strip())) as caught:
        WRONG[said](recording)
    assert caught.value.next_step
    assert str(caught.value).splitlines()[-1] == f"next step: {caught.value.next_step}"
    assert not list(tmp_path.iterdir())


def test_a_data_frame_is_answered_in_python(recording: edge_ident.Recording) -> None:
    axis = recording.axes["x"]
    frame = pd.DataFrame({"a": axis.position, "b": axis.effort})
    for asked in (
        lambda: edge_ident.load_recording(frame),
        lambda: edge_ident.identify(frame),
        lambda: edge_ident.inspect_recording(frame).recording(),
    ):
        with pytest.raises(edge_ident.DataError) as caught:
            asked()
        assert "--" not in caught.value.cause + caught.value.next_step
        assert "ReadOptions(columns={'a': 'x_position_rad'" in caught.value.next_step


@pytest.mark.parametrize("since", ["datetime64[ns]", "timedelta64[ns]"])
def test_an_index_of_times_is_a_column_without_a_name(
    since: str, recording: edge_ident.Recording
) -> None:
    axis = recording.axes["x"]
    index = pd.Index(np.round(1e9 * recording.time_s).astype(since))
    frame = pd.DataFrame({"x_position_rad": axis.position, "x_torque_nm": axis.effort}, index)
    read = edge_ident.load_recording(frame)
    np.testing.assert_allclose(read.time_s, recording.time_s, atol=1e-9)


@pytest.mark.parametrize(
    ("flags", "python"),
    [
        ("give --column once for each", "give options=ReadOptions(columns=…) once for each"),
        ("--column 'a b=x_position_m' --unit 'a b=mm'",
         "options=ReadOptions(columns={'a b': 'x_position_m'}, units={'a b': 'mm'})"),
        ("say --decimal comma; otherwise", "say options=ReadOptions(decimal='comma'); otherwise"),
        ("leave --resolution out", "leave options=ReadOptions(resolution=…) out"),
        ("--axis x --axis z", "options=ReadOptions(axes=['x', 'z'])"),
    ],
)  # fmt: skip
def test_options_of_commands_become_those_of_a_program(flags: str, python: str) -> None:
    assert in_python(flags) == python


def test_every_result_is_a_table(
    recording: edge_ident.Recording,
    found: edge_ident.Identification,
    diagnosis: edge_ident.Diagnosis,
) -> None:
    compared = edge_ident.compare(recording, methods="least_squares")
    plan = edge_ident.plan_motion(diagnosis, recording, budget=0.1)
    designs = edge_ident.design_gains(found)
    for result in (recording, found.model, found, diagnosis, compared, plan, designs):
        table = pd.DataFrame(result.table())
        assert len(table), type(result).__name__
        assert "axis" in table
        assert str(result).strip()
    rows = pd.DataFrame(found.table()).set_index(["axis", "effect", "parameter"])
    assert rows.loc[("x", "rigid_body", "inertia"), "value"] == pytest.approx(
        found.axes["x"].estimate.parameters[0]
    )
    assert "8742 samples, 21.85 s, 400 Hz" in str(recording)


def block_of_the_page() -> str:
    page = (ROOT / "docs" / "own_effects.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    return code


@pytest.mark.usefixtures("registry")
def test_the_page_on_own_effects(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict = {}
    exec(block_of_the_page(), names)
    assert "axis x explained by magnetic brake" in capsys.readouterr().out
    model = names["braked"]
    with pytest.raises(edge_ident.ModelError, match="draws no random values"):
        random_term("magnetic_brake", np.random.default_rng(1), scale_of_one())
    used = edge_ident.design_gains(model).axes["x"].unused
    assert "says nothing of gains" in next(u.reason for u in used if u.effect == "magnetic_brake")


def scale_of_one():
    time_s = np.linspace(0.0, 1.0, 100)
    return scale_of(np.ones((1, 4)), time_s, np.sin(time_s), np.cos(time_s), -np.sin(time_s))


class Nothing(edge_ident.Effect):
    """Nothing is there yet."""


class Broken(edge_ident.Effect):
    """Its physics asks for a parameter that there is not."""

    parameters = (edge_ident.Parameter("level", "{effort}", 0.0, 1.0, "of it"),)

    def load(self, at, values):
        return values["height"] * at.velocity


class Backlash(Broken):
    def load(self, at, values):
        return values["level"] * at.velocity


LEVEL = edge_ident.SearchSpec(forms=(edge_ident.Form(("level",)),))
REFUSED: dict[str, object] = {
    "no parameters.*no form.*no hook": Nothing(),
    "names size, which is no parameter": Broken(
        search=edge_ident.SearchSpec(forms=(edge_ident.Form(("size",)),))
    ),
    "fails on a test motion: KeyError: 'height'": Broken(search=LEVEL),
    "there is an effect backlash already": Backlash(search=LEVEL),
    "Nothing is a class": Nothing,
    "an int is no Effect": 3,
}


@pytest.mark.parametrize("said", REFUSED)
@pytest.mark.usefixtures("registry")
def test_all_that_an_effect_lacks_is_said_at_once(said: str) -> None:
    with pytest.raises(edge_ident.EdgeIdentError, match=said) as caught:
        edge_ident.register_effect(REFUSED[said])
    assert caught.value.next_step
    assert not effects._registered
