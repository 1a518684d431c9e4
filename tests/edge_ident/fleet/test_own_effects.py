"""Effects of a user's own reach the processes of a survey, or it is said why not."""

import importlib.util
from pathlib import Path

import pytest

import edge_ident

OWN = '''"""A drag of my own."""
from __future__ import annotations

import helper

import edge_ident


class SquareDrag(edge_ident.Effect):
    """Drag that grows with the square of the speed."""

    parameters = (edge_ident.Parameter("level", "{effort}", 0.0, 1e9, "at unit speed"),)

    def load(self, at: Undefined, values):
        return values["level"] * at.velocity * abs(at.velocity)


edge_ident.register_effect(SquareDrag(search=helper.search))
'''
HELPER = """import edge_ident

search = edge_ident.SearchSpec(forms=(edge_ident.Form(("level",)),))
"""
AFTER = "\nraise RuntimeError('what the program itself does')\n"
GUARDED = OWN.replace(
    "\nedge_ident.register", "\nif __name__ == '__main__':\n    edge_ident.register"
)


@pytest.fixture
def folder(tmp_path: Path, registry: None, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Of the file that has registered the effect in this process."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "helper.py").write_text(HELPER, encoding="utf-8")
    carry_out(tmp_path / "own.py", OWN, "__main__")
    (tmp_path / "units").mkdir()
    return tmp_path


def carry_out(file: Path, source: str, name: str) -> None:
    file.write_text(source, encoding="utf-8")
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(importlib.util.module_from_spec(spec))


def dragged() -> edge_ident.Model:
    axis = edge_ident.reduced_model().axes["x"]
    drag = edge_ident.Term("square_drag", {"level": 1.5})
    return edge_ident.Model({"x": edge_ident.AxisModel((*axis.terms, drag))})


def surveyed(folder: Path) -> edge_ident.SurveyedRecording:
    found = edge_ident.survey(
        folder / "units", model=dragged(), diagnose=False, jobs=1, output=folder / "out"
    )
    return found.recordings[0]


def test_a_process_knows_what_the_program_registered(folder: Path) -> None:
    """It carries out the file as far as the call, and no further."""
    recording = edge_ident.simulate(dragged(), "multisine", cycles=1)
    edge_ident.save_recording(recording, folder / "units" / "a.npz")
    (folder / "own.py").write_text(OWN + AFTER, encoding="utf-8")
    found = surveyed(folder)
    assert found.failed is None
    assert found.axes["x"].verdict == "adequate"
    # what was kept follows from the effect as it was
    (folder / "own.py").write_text(GUARDED, encoding="utf-8")
    failed = surveyed(folder).failed
    assert failed is not None
    assert "of __main__ registers square_drag" in failed.cause
    assert "import own_effects" in failed.next_step


def test_an_effect_from_a_prompt_is_refused_before_the_work(folder: Path, registry: None) -> None:
    (folder / "units" / "a.csv").touch()
    exec(compile(OWN, "<stdin>", "exec", dont_inherit=True), {"__name__": "prompt"})
    with pytest.raises(edge_ident.ModelError, match="at a prompt or in a notebook"):
        surveyed(folder)
