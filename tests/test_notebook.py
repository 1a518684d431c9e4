"""The notebook of the docs runs from top to bottom, and finds what the recording hides."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "docs" / "examples"
NOTEBOOK = FOLDER / "python_interface.ipynb"
CHECKS = """
(cause,) = diagnosis.axes["x"].causes
assert cause.term.effect == "stribeck_friction"
assert not base.axes["x"].adequacy.adequate
assert designs.axes["x"].phase_margin_deg > 45.0
"""

nbformat = pytest.importorskip("nbformat", reason="needs the extra docs: pip install -e '.[docs]'")
nbclient = pytest.importorskip("nbclient", reason="needs the extra docs: pip install -e '.[docs]'")
pytest.importorskip("ipykernel", reason="needs the extra docs: pip install -e '.[docs]'")
pytest.importorskip("matplotlib", reason="needs the extra report: pip install -e '.[report]'")


@pytest.mark.thorough
def test_every_cell_runs() -> None:
    book = nbformat.read(NOTEBOOK, as_version=4)
    book.cells.append(nbformat.v4.new_code_cell(CHECKS))
    client = nbclient.NotebookClient(
        book, timeout=600, resources={"metadata": {"path": str(FOLDER)}}
    )
    client.execute()
    shown = {
        kind
        for cell in book.cells
        for out in cell.get("outputs", ())
        for kind in out.get("data", ())
    }
    assert {"text/html", "image/png"} <= shown


def test_no_output_is_stored() -> None:
    cells = nbformat.read(NOTEBOOK, as_version=4).cells
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
