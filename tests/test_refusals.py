"""Bad input and bad boards: each with its message, its next step and its exit code."""

import json
import shutil
import socket
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from firmware_interface.board import Board
from firmware_interface.connection import open_link
from tests.boards import served_board

USAGE, LINK, BOARD, DATA = 2, 3, 4, 5


def refused(*arguments: str | Path) -> tuple[int, str]:
    """Exit code and error text of a command; stdout must stay empty."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.stdout == ""
    return result.exit_code, result.stderr


def write(path: Path, **changes: np.ndarray) -> Path:
    time = 0.01 * np.arange(400)
    columns = {"time_s": time, "x_position_rad": np.sin(2 * time), "x_torque_nm": np.cos(2 * time)}
    columns |= changes
    length = min(map(len, columns.values()))
    rows = np.column_stack([column[:length] for column in columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="")
    return path


def with_value(row: int, value: float) -> np.ndarray:
    column = np.cos(0.02 * np.arange(400))
    column[row] = value
    return column


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x_torque_nm": with_value(7, np.nan)}, "row 9, column x_torque_nm: not a finite number"),
        ({"time_s": 0.01 * np.r_[:200, 150:350]}, "row 202, column time_s: time goes from"),
        ({"x_position_rad": np.full(400, 0.5)}, "no motion"),
        ({"time_s": 0.01 * np.arange(50)}, "50 samples are not enough"),
    ],
)
def test_bad_recordings(tmp_path: Path, changes: dict[str, np.ndarray], message: str) -> None:
    code, text = refused("identify", write(tmp_path / "bad.csv", **changes))
    assert code == DATA
    assert message in text
    assert "next: " in text


def test_missing_file_and_column(tmp_path: Path) -> None:
    assert refused("identify", tmp_path / "absent.csv") == (
        DATA,
        f"error: {tmp_path}/absent.csv: no such file\n"
        "next:  give the path of a recording (.csv, .tsv, .txt, .dat, .asc, .csv.gz, .npz, .mat, "
        ".h5, .hdf5, .tdms, .parquet, .xlsx, .bag, .db3, .mcap)\n",
    )
    path = write(tmp_path / "a.csv")
    path.write_text(path.read_text().replace("x_torque_nm", "load", 1))
    code, text = refused("identify", path)
    assert code == DATA
    assert "axis x has no effort column" in text
    assert "--column" in text


def test_errors_are_json_where_json_was_asked_for(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["identify", str(tmp_path / "absent.csv"), "--json"])
    document = json.loads(result.stdout)
    assert result.exit_code == DATA
    assert document["error"] == "DataError"
    assert document["next_step"]


def test_a_network_that_fails_its_hash(tmp_path: Path) -> None:
    for file in (files("edge_ident") / "networks").iterdir():
        shutil.copy(str(file), tmp_path / file.name)
    network = tmp_path / "feed_drive_fp32.onnx"
    content = bytearray(network.read_bytes())
    content[len(content) // 2] ^= 1
    network.write_bytes(content)
    code, text = refused("identify", write(tmp_path / "a.csv"), "--network", network)
    assert code == DATA
    assert "hash" in text


@pytest.mark.parametrize(
    "device", ["/dev/ttyNOTTHERE", "tcp://127.0.0.1:1", "tcp://127.0.0.1", "loop+nothing://"]
)
def test_unknown_device(tmp_path: Path, device: str) -> None:
    code, text = refused("run", "--device", device, "--output", tmp_path)
    assert code == LINK
    assert "next: " in text


def test_no_device_and_wrong_options_are_usage_errors(tmp_path: Path) -> None:
    assert refused("run", "--output", tmp_path)[0] == USAGE
    assert refused("run", "--device", "virtual", "--motion", "dance", "--output", tmp_path)[0] == 2
    assert refused("board")[0] == USAGE
    assert refused("board", "--pty", "--speed", "0")[0] == USAGE
    assert refused("identify", write(tmp_path / "a.csv"), "--column", "pos")[0] == USAGE


def test_port_in_use() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, text = refused("board", "--tcp", str(port))
    assert code == LINK
    assert f"port {port}" in text


@pytest.mark.parametrize(
    ("settings", "message"),
    [("map_crc=0x12345678", "0x12345678"), ("fault=Fault.FOLLOWING_ERROR", "FOLLOWING_ERROR")],
)
def test_boards_that_must_not_be_used(tmp_path: Path, settings: str, message: str) -> None:
    with served_board("tcp_port=0", settings=settings) as device:
        code, text = refused("run", "--device", device, "--output", tmp_path)
    assert code == BOARD
    assert message in text


def test_a_run_keeps_its_gains_within_the_boards_limits(tmp_path: Path) -> None:
    tight = "limits=dict.fromkeys(('x', 'z'), tight)"
    with served_board("tcp_port=0", settings=tight) as device:
        command = ["run", "--device", device, "--output", str(tmp_path)]
        assert CliRunner().invoke(app, command).exit_code == 0
        after = Board.connect(open_link(device))
        found, limits = after.active_gains(), after.limits()
        assert not after.status().unconfirmed
    for axis, gains in found.items():
        assert gains.proportional <= limits[axis].gain_maximum.proportional
        assert gains.inertia_feedforward > 0.0


def test_a_description_of_another_drive_is_refused(tmp_path: Path) -> None:
    text = (files("edge_ident.drive") / "feed_drive.toml").read_text("utf-8")
    path = tmp_path / "other.toml"
    path.write_text(text.replace("= 8400", "= 2000"))
    code, message = refused("run", "--device", "virtual", "--drive", path, "--output", tmp_path)
    assert code == DATA
    assert "encoder counts of axis x: the board has 8400" in message
