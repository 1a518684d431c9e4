"""Columns of lists in Parquet, as data sets of LeRobot have, and episodes one after the other."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

import edge_ident
from edge_ident.errors import DataError
from edge_ident.support import documents
from tests.edge_ident.signals.test_column_proposals import GOOD, accepted

Array = NDArray[np.float64]


def lists(values: Array, *, fixed: bool) -> pa.Array:
    """Two joints; the second has nine tenths."""
    kind = pa.list_(pa.float64(), 2) if fixed else pa.list_(pa.float64())
    return pa.array([[value, 0.9 * value] for value in values.tolist()], type=kind)


def write(folder: Path, *, fixed: bool = True, effort: bool = True, names: object = None) -> Path:
    path = folder / "data" / "chunk-000" / "episode_000000.parquet"
    path.parent.mkdir(parents=True)
    columns = {
        "observation.state": lists(GOOD.position, fixed=fixed),
        "action": lists(GOOD.position, fixed=fixed),
        "timestamp": pa.array(GOOD.time_s),
        "episode_index": np.zeros(len(GOOD.time_s), dtype=np.int64),
    }
    if effort:
        columns["observation.effort"] = lists(GOOD.effort, fixed=fixed)
    pq.write_table(pa.table(columns), path)
    if names is not None:
        described = {"names": names}
        (folder / "meta").mkdir()
        (folder / "meta" / "info.json").write_text(
            json.dumps({"features": dict.fromkeys(columns, described)})
        )
    return path


@pytest.mark.parametrize("fixed", [True, False])
def test_a_column_of_lists_is_a_column_for_each_place(fixed: bool, tmp_path: Path) -> None:
    read = accepted(write(tmp_path, fixed=fixed))
    for name, share in (("axis1", 1.0), ("axis2", 0.9)):
        axis = read.axes[name]
        np.testing.assert_allclose(axis.position, share * GOOD.position, rtol=1e-12)
        np.testing.assert_allclose(axis.effort, share * GOOD.effort, rtol=1e-12)
        assert axis.reference is not None


@pytest.mark.parametrize("names", [["pan.pos", "tilt.pos"], {"motors": ["pan", "tilt"]}])
def test_places_have_the_names_of_the_data_set(names: object, tmp_path: Path) -> None:
    assert list(accepted(write(tmp_path, names=names)).axes) == ["pan", "tilt"]


def test_a_data_set_without_an_effort_says_so(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no heading says which column is an effort"):
        edge_ident.load_recording(write(tmp_path, effort=False))


def test_lists_of_several_lengths_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    ragged = pa.array([[1.0] * (1 + k % 3) for k in range(400)])
    pq.write_table(pa.table({"a": ragged, "b": np.arange(400.0), "c": np.arange(400.0)}), path)
    assert "a (text)" in edge_ident.inspect_recording(path).left_out


def test_lists_have_the_limit_of_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.parquet"
    wide = pa.array([[0.0] * 50] * 400, type=pa.list_(pa.float64(), 50))
    pq.write_table(pa.table({"a": wide, "b": np.arange(400.0)}), path)
    monkeypatch.setattr(documents, "MOST_NUMBERS", 3000)
    with pytest.raises(DataError, match="it has 20,000 numbers, and at most 3,000 are read"):
        edge_ident.inspect_recording(path)


def test_episodes_one_after_the_other_are_told(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    time_s = np.tile(GOOD.time_s, 3)
    columns = {
        "time_s": time_s,
        "x_position_rad": np.tile(GOOD.position, 3),
        "x_torque_nm": np.tile(GOOD.effort, 3),
    }
    pq.write_table(pa.table(columns), path)
    with pytest.raises(DataError, match="time starts again, 2 times in all") as caught:
        edge_ident.load_recording(path)
    assert "one by one" in caught.value.next_step
