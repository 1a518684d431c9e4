"""Nothing that comes from outside is ever unpickled or evaluated."""

import ast
from pathlib import Path

import numpy as np
import pytest

from edge_ident.errors import DataError
from edge_ident.signals.recording_files import load_recording

ROOT = Path(__file__).parents[1]
SOURCES = [
    path
    for package in ("edge_ident", "firmware_interface", "export", "tools")
    for path in (ROOT / package).rglob("*.py")
]
SAFE = {"np.load": ("allow_pickle", False), "torch.load": ("weights_only", True)}


def test_no_source_unpickles() -> None:
    assert len(SOURCES) > 100
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import | ast.ImportFrom):
                if ast.unparse(node) == "from pickle import Pickler":
                    continue  # it only writes
                names = {alias.name.split(".")[0] for alias in node.names}
                names.add((getattr(node, "module", None) or "").split(".")[0])
                assert not names & {"pickle", "marshal", "shelve", "dill", "joblib"}, path
            elif isinstance(node, ast.Call):
                if ast.unparse(node) == "exec('')":
                    continue  # code that says nothing (`edge_ident.support.process`)
                if ast.unparse(node) == "exec(own_code, vars(module))":
                    continue  # the caller's own program, as far as it registers effects
                called = ast.unparse(node.func)
                assert called not in ("eval", "exec"), path
                if called in SAFE:
                    word, value = SAFE[called]
                    given = {
                        k.arg: ast.literal_eval(k.value) for k in node.keywords if k.arg == word
                    }
                    assert given == {word: value}, f"{path}:{node.lineno}"


def test_a_pickled_column_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "evil.npz"
    np.savez(path, time_s=np.arange(400.0), x_position_rad=np.array([{}], dtype=object))
    with pytest.raises(DataError, match="not a readable"):
        load_recording(path)
