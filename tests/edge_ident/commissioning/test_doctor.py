"""Checks of host, ports and link: what is well, what is not, and the remedy."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from edge_ident.cli import app
from edge_ident.commissioning import doctor
from firmware_interface.errors import NoReplyError
from firmware_interface.registers import Fault
from firmware_interface.virtual.board import VirtualBoard
from firmware_interface.virtual.settings import BoardSettings
from tests.edge_ident.shared_board import SharedBoard

PERIOD_S = 0.0025


@pytest.mark.parametrize("start", [0, 2**32 - 100])
def test_a_clock_that_keeps_time_does_so_across_its_wrap_around(start: int) -> None:
    times = 10.0 + 0.01 * np.arange(200)
    samples = (start + np.floor((times - 10.0) / PERIOD_S)) % 2**32
    clock, jitter = doctor.clock_checks(times, samples, PERIOD_S)
    assert clock.good, clock
    assert jitter.good, jitter


def test_a_clock_a_tenth_of_a_percent_off_is_found() -> None:
    times = 0.01 * np.arange(400)
    samples = np.floor(times * 1.002 / PERIOD_S)
    clock, jitter = doctor.clock_checks(times, samples, PERIOD_S)
    assert not clock.good
    assert float(clock.detail.split()[0]) == pytest.approx(1.002, abs=2e-4)
    assert clock.next_step
    assert jitter.good


def test_one_request_that_comes_late_is_jitter_not_a_wrong_clock() -> None:
    times = 0.01 * np.arange(400)
    samples = np.floor(times / PERIOD_S)
    times[200] -= 0.1
    clock, jitter = doctor.clock_checks(times, samples, PERIOD_S)
    assert clock.good
    assert not jitter.good


@pytest.mark.parametrize(("duration_s", "good"), [(0.001, True), (0.016, False)])
def test_round_trips_of_a_slow_adapter(duration_s: float, good: bool) -> None:
    check = doctor.round_trip_check(np.full(50, duration_s))
    assert check.good is good
    assert "latency timer" in check.next_step


def test_a_package_that_another_distribution_has_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert doctor.own_packages().good
    other, package = tmp_path / "otherware-1.0.dist-info", tmp_path / "firmware_interface"
    for folder in (other, package):
        folder.mkdir()
    (package / "__init__.py").touch()  # Python 3.12 and later passes over files that are missing
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: otherware\nVersion: 1.0\n")
    (other / "RECORD").write_text("firmware_interface/__init__.py,,\n")
    monkeypatch.syspath_prepend(tmp_path)
    check = doctor.own_packages()
    assert not check.good
    assert check.detail == "firmware_interface (also of otherware)"


FAKES = {
    "import os, signal\nos.kill(os.getpid(), signal.SIGILL)": "SIGILL when it is imported",
    (
        "import os, signal\n__version__ = '1'\n"
        "class SessionOptions: pass\n"
        "class ExecutionMode: ORT_SEQUENTIAL = 0\n"
        "class GraphOptimizationLevel: ORT_ENABLE_ALL = 0\n"
        "def InferenceSession(*_): os.kill(os.getpid(), signal.SIGSEGV)"
    ): "SIGSEGV when it runs a network",
    "raise ImportError('libc.so.6: version GLIBC_2.99 not found')": "GLIBC_2.99 not found",
}
"""Stand-ins for builds of onnxruntime, and what the doctor says of each."""


@pytest.mark.parametrize("fake", FAKES)
def test_a_build_of_onnxruntime_that_this_processor_cannot_run(fake: str, tmp_path: Path) -> None:
    """It kills the process that tries it; the doctor lives and tells what to do."""
    (tmp_path / "onnxruntime.py").write_text(fake)
    done = subprocess.run(
        [sys.executable, "-m", "edge_ident", "doctor", "--json"],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    checks = {check["what"]: check for check in json.loads(done.stdout)["checks"]}
    assert not checks["onnxruntime"]["good"]
    assert FAKES[fake] in checks["onnxruntime"]["detail"]
    assert "install" in checks["onnxruntime"]["next_step"]
    assert not any(name.startswith("network") for name in checks)
    assert checks["numpy"]["good"]


def test_onnxruntime_and_its_networks_are_well_here() -> None:
    runtime, *networks = doctor.networks()
    assert runtime.good
    assert [check.good for check in networks] == [True, True]


@pytest.mark.parametrize(("milliseconds", "good"), [("1", True), ("16", False)])
def test_the_latency_timer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, milliseconds: str, good: bool
) -> None:
    monkeypatch.setattr(doctor, "_TIMERS", tmp_path)
    (tmp_path / "ttyUSB0").mkdir()
    (tmp_path / "ttyUSB0" / "latency_timer").write_text(milliseconds + "\n")
    (check,) = doctor.latency_timer("/dev/ttyUSB0")
    assert check.good is good
    assert str(tmp_path) in check.next_step
    assert doctor.latency_timer("/dev/ttyACM0") == []


def test_modem_manager_matters_to_ports_that_are_not_exempt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_PROCESSES", tmp_path)
    assert doctor.modem_manager(["/dev/ttyACM0"]).good
    (tmp_path / "17").mkdir()
    (tmp_path / "17" / "comm").write_text("ModemManager\n")
    assert doctor.modem_manager(["/dev/ttyS0"]).good
    check = doctor.modem_manager(["/dev/ttyACM0"])
    assert not check.good
    assert "ID_MM_DEVICE_IGNORE" in check.next_step
    monkeypatch.setattr(doctor, "_ignored", lambda port: True)
    assert doctor.modem_manager(["/dev/ttyACM0"]).good


def test_a_port_without_permission(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    check = doctor.permission("/dev/ttyACM0")
    assert not check.good
    assert "dialout" in check.next_step


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_REQUESTS", 10)
    monkeypatch.setattr(doctor, "_PAUSE_S", 0.0)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("settings", "bad", "next_step"),
    [
        (BoardSettings(map_crc=7), "register map", "same release"),
        (BoardSettings(fault=Fault.FOLLOWING_ERROR), "state", "edge-ident clear-fault"),
    ],
)
def test_boards_that_cannot_be_used_get_a_remedy(
    monkeypatch: pytest.MonkeyPatch, settings: BoardSettings, bad: str, next_step: str
) -> None:
    code, text, _ = SharedBoard(monkeypatch, settings).run("doctor", "--json")
    checks = {check["what"]: check for check in json.loads(text)["checks"]}
    assert code == 1
    assert not checks[bad]["good"]
    assert next_step in checks[bad]["next_step"]


@pytest.mark.usefixtures("quick")
def test_a_board_is_looked_at_and_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    shared = SharedBoard(monkeypatch)
    _, text, _ = shared.run("doctor", "--json")
    checks = {check["what"]: check["good"] for check in json.loads(text)["checks"]}
    assert checks["register map"]
    assert checks["state"]
    assert {"round trip", "board clock", "jitter"} <= set(checks)
    assert shared.board.status().last_token == 0


def test_a_device_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    result = CliRunner().invoke(app, ["doctor", "--device", "/dev/ttyNOTHERE", "--json"])
    (link,) = [c for c in json.loads(result.stdout)["checks"] if c["what"] == "link"]
    assert result.exit_code == 1
    assert "edge-ident ports" in link["next_step"]


class FailingLine(VirtualBoard):
    """Falls silent after some reads."""

    def __init__(self, answers: int) -> None:
        super().__init__()
        self._answers = answers

    def read(self, address: int, count: int) -> list[int]:
        self._answers -= 1
        if self._answers < 0:
            raise NoReplyError("no reply within 0.3 s", "check the cable")
        return super().read(address, count)

    def close(self) -> None:
        """Nothing is open."""


@pytest.mark.parametrize(("answers", "bad"), [(0, "register map"), (60, "link")])
def test_a_line_that_fails_is_no_wrong_register_map(
    monkeypatch: pytest.MonkeyPatch, answers: int, bad: str
) -> None:
    monkeypatch.setattr(doctor, "open_link", lambda *_, **__: FailingLine(answers))
    found = doctor.check_link("a line", 115200, lambda done, of: None)
    assert [check.what for check in found if not check.good] == [bad]
    assert ("register map" in {check.what for check in found if check.good}) is (answers > 0)
