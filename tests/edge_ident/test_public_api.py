"""The public API: what is promised is there, documented, light to import, and its examples run."""

import ast
import doctest
import functools
import importlib
import inspect
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest

import edge_ident
from edge_ident import commissioning, report
from edge_ident.report.view import ResultView
from edge_ident.simulation import simulate as simulation
from edge_ident.support import lazy, rows

ROOT = Path(__file__).parents[2]
PROMISED = (
    "Recording", "load_recording", "Drive", "Model", "identify", "diagnose", "simulate",
    "design_gains", "connect",
)  # fmt: skip
FUNCTIONS = [name for name in edge_ident.__all__ if inspect.isfunction(getattr(edge_ident, name))]
WITHOUT_EXAMPLE = {"Board", "PARAMETERS", "TOLERANCE", "__version__"}
WITHOUT_EXAMPLE |= {name for name in edge_ident.__all__ if name.endswith("Error")}
simulated_once = functools.cache(simulation.simulate)


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every example simulates the same drive; once is enough."""
    monkeypatch.setattr(simulation, "simulate", simulated_once)


@pytest.fixture
def found(simulated: None) -> edge_ident.Identification:
    return edge_ident.identify(edge_ident.simulate())


def loaded_by(source: str) -> set[str]:
    """Top-level packages that a fresh interpreter has after running the source."""
    program = f"import sys\n{source}\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_what_is_promised_is_exported() -> None:
    assert set(PROMISED) <= set(edge_ident.__all__)
    assert edge_ident.__version__.count(".") == 2
    assert dir(edge_ident) == sorted(edge_ident.__all__)


def test_names_at_run_time_are_those_that_type_checkers_see() -> None:
    tree = ast.parse(Path(edge_ident.__file__).with_suffix(".pyi").read_text())
    imported = {
        alias.asname: node.module
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(imported) == set(edge_ident.__all__) - {"__version__"}
    for name, module in imported.items():
        given = getattr(edge_ident, name)
        assert given is getattr(sys.modules[module], name), name


@pytest.mark.parametrize("package", [commissioning, report])
def test_modules_at_run_time_are_those_that_type_checkers_see(package) -> None:
    tree = ast.parse(Path(package.__file__).with_suffix(".pyi").read_text())
    offered = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert len(offered) == len(package.__all__)
    for node in offered:
        for alias in node.names:
            found = importlib.import_module(f"{node.module}.{alias.name}")
            assert getattr(package, alias.name) is found
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        package.nothing  # noqa: B018


def test_no_exported_name_is_that_of_a_module() -> None:
    """Importing the module would put it in the place of the name."""
    inside = {path.stem for path in Path(edge_ident.__file__).parent.iterdir()}
    assert not inside & set(edge_ident.__all__)


def test_what_is_not_exported_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'regressor'"):
        edge_ident.regressor  # noqa: B018


@pytest.mark.parametrize("name", sorted(set(edge_ident.__all__) - WITHOUT_EXAMPLE))
@pytest.mark.usefixtures("simulated", "registry")
def test_the_example_of_each_docstring(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(edge_ident, name), name)
    assert example.examples, f"{name} has no example"
    report_of = doctest.DocTestRunner(optionflags=doctest.REPORT_NDIFF).run(example)
    assert report_of.failed == 0


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_parameter_and_result_is_documented(name: str) -> None:
    function = getattr(edge_ident, name)
    text = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    for parameter in signature.parameters:
        assert re.search(rf"^(\w+, )*{parameter}(, \w+)* :", text, re.MULTILINE), parameter
    gives = signature.return_annotation not in (None, "None")
    assert not gives or "Returns\n---" in text or "Yields\n---" in text or not signature.parameters


def test_importing_costs_next_to_nothing() -> None:
    heavy = {"numpy", "scipy", "onnxruntime", "rich", "typer", "matplotlib", "pymodbus", "torch"}
    assert not loaded_by("import edge_ident; edge_ident.__version__") & heavy


def test_a_recording_is_identified_without_scipy(simulated: None, tmp_path: Path) -> None:
    edge_ident.save_recording(edge_ident.simulate(), tmp_path / "drive.npz")
    source = f"""
import edge_ident
found = edge_ident.identify(
    edge_ident.load_recording({str(tmp_path / "drive.npz")!r}), edge_ident.load_network()
)
assert "trusted" in str(found)
assert found._repr_html_()"""
    assert not loaded_by(source) & {"scipy", "matplotlib", "typer", "torch", "onnx"}


@pytest.mark.usefixtures("simulated")
def test_the_five_lines_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"<!-- example: api -->\n```python\n(.*?)```", readme, re.DOTALL)
    assert len([line for line in code.splitlines() if line]) == 5
    edge_ident.save_recording(edge_ident.simulate(), tmp_path / "recording.csv")
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(code, names)
    results = [value for value in names.values() if hasattr(value, "axes")]
    assert {type(value).__name__ for value in results} >= {"Recording", "Diagnosis"}


def test_a_result_reads_well_in_terminal_and_notebook(found: edge_ident.Identification) -> None:
    text = str(found)
    assert repr(found) == text
    assert "inertia" in text
    assert "kg*m^2" in text
    assert all(line == line.rstrip() for line in text.splitlines())
    html = found._repr_html_()
    assert html.startswith("<pre")
    assert "kg*m^2" in html


def test_every_result_has_its_view(found: edge_ident.Identification) -> None:
    classes = [
        of for name in edge_ident.__all__ if isinstance(of := getattr(edge_ident, name), type)
    ]
    results = {of.__name__ for of in classes if issubclass(of, rows.Readable)}
    assert results == set(lazy.VIEWS)
    for home in lazy.VIEWS.values():
        assert isinstance(importlib.import_module(home).VIEW, ResultView), home
    for result in (found, found.model, edge_ident.simulate()):
        again = pickle.loads(pickle.dumps(result))
        assert str(again) == str(result)
        assert len({len(column) for column in again.table().values()}) == 1


def test_what_a_file_names_cannot_become_markup() -> None:
    """An axis is named by its recording; its name must reach a notebook as text."""
    recording = edge_ident.simulate(motion="sinusoid")
    axis = recording.axes["x"]
    named = edge_ident.Recording(recording.time_s, {"<b>[red]x": axis}, "test")
    found = edge_ident.identify(named)
    assert "<b>" not in found._repr_html_()
    assert "<b>[red]x" in str(found)


def test_results_draw_themselves(found: edge_ident.Identification) -> None:
    recording = edge_ident.simulate()
    diagnosis = edge_ident.diagnose([recording])
    designs = edge_ident.design_gains(found.model)
    compared = edge_ident.compare(recording, methods=["least_squares"])
    for result in (found, diagnosis, designs, compared):
        picture = result.plot()._repr_png_()
        assert picture.startswith(b"\x89PNG")


def test_drawing_without_matplotlib_names_the_extra(
    found: edge_ident.Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(edge_ident.DataError) as refusal:
        found.plot()
    assert "edge-ident[report]" in refusal.value.next_step


def test_gains_of_an_axis_that_the_drive_lacks_are_refused() -> None:
    model = edge_ident.Model({"w": edge_ident.reduced_model().axes["x"]})
    with pytest.raises(edge_ident.DataError, match="but not w"):
        edge_ident.design_gains(model)


def test_a_method_that_there_is_not_is_refused(simulated: None) -> None:
    with pytest.raises(edge_ident.DataError, match="no method divination") as caught:
        edge_ident.compare(edge_ident.simulate(), methods=["divination"])
    assert "least_squares" in caught.value.next_step


def test_the_page_names_every_export() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", page))
    missing = set(edge_ident.__all__) - named
    assert not missing
