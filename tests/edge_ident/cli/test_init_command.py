"""`edge-ident init`: answers from options or a person become a drive description, or nothing."""

import json
import math
import os
import pty
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import edge_ident
from edge_ident.cli import app, init

PAPER = (
    "--sample-rate=400", "--lead=4", "--gear-ratio=131.25", "--encoder-at=output",
    "--encoder=8400", "--torque=0.0914", "--travel=11.4", "--speed=5000",
)  # fmt: skip
STAGE = (
    "--axis=y", "--sample-rate=1kHz", "--lead=5mm", "--gear-ratio=1", "--encoder-at=table",
    "--encoder=0.5um", "--torque-constant=0.21", "--torque=3A", "--travel=300mm",
    "--speed=250mm/s", "--acceleration=5", "--rotor-inertia=0.26", "--load=40", "--friction=40N",
)  # fmt: skip
# the paper's drive as a person types it; the empty lines are Enter
TYPED = ("400", "", "4", "131.25", "output", "8400", "", "0.0914", "11.4", "5000", "", "", "", "")


def run(*arguments: object, typed: str | None = None) -> Result:
    return CliRunner().invoke(app, ["init", *map(str, arguments)], input=typed)


@pytest.fixture
def on_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(init, "on_terminal", lambda: True)


def is_the_papers(drive: edge_ident.Drive) -> bool:
    """Gear ratio, encoder, lead and sampling are the paper's, in all axes; so is the motion."""
    known = edge_ident.load_drive()
    assert list(drive.axes) == ["x", "z"]
    for name, axis in drive.axes.items():
        built_in = known.axes[name]
        assert axis.gear_ratio == built_in.gear_ratio == 131.25
        assert axis.encoder_counts_per_turn == built_in.encoder_counts_per_turn == 8400.0
        assert axis.screw_lead_m_per_rad == pytest.approx(built_in.screw_lead_m_per_rad, rel=1e-6)
        # 5.7 mm either way, 5000 rpm and 0.0914 N·m of the motor
        assert axis.travel_limit_rad == pytest.approx(5.7 / 4.0 * 2.0 * math.pi)
        assert axis.speed_limit_rad_s == pytest.approx(5000.0 * math.pi / 30.0 / 131.25)
        assert axis.effort_limit_nm == pytest.approx(0.0914 * 131.25)
        assert axis.phase_rad == pytest.approx(built_in.phase_rad)
        assert axis.amplitude_rad == pytest.approx(built_in.amplitude_rad, rel=0.01)
    assert drive.trajectory().duration_s == known.trajectory().duration_s
    return drive.sampling_period_s == known.sampling_period_s


# ---- options alone


@pytest.mark.parametrize(
    "encoder",
    [(), ("--encoder-at=motor", "--encoder=64"), ("--encoder-at=motor", "--encoder=16 lines")],
)
def test_the_papers_drive(tmp_path: Path, encoder: tuple[str, ...]) -> None:
    path = tmp_path / "paper.toml"
    done = run(path, *PAPER, *encoder)
    assert (done.exit_code, done.stdout) == (0, f"{path}\n")
    drive = edge_ident.load_drive(path)
    assert is_the_papers(drive)
    assert drive.name == "paper"
    assert "lead: 4 mm = 0.00063662 m/rad" in done.stderr
    assert "travel: 11.4 mm = 0.0114 m from end to end" in done.stderr


def test_a_linear_stage_without_a_gearbox(tmp_path: Path) -> None:
    path = tmp_path / "stage.toml"
    assert run(path, *STAGE, "--name", "long stage").exit_code == 0
    drive = edge_ident.load_drive(path)
    axis = drive.axes["y"]
    assert (drive.name, drive.sampling_period_s, list(drive.axes)) == ("long stage", 0.001, ["y"])
    assert (axis.gear_ratio, axis.encoder_counts_per_turn) == (1.0, 10_000.0)
    assert axis.screw_lead_m_per_rad == pytest.approx(0.005 / (2 * math.pi))
    assert axis.travel_limit_rad == pytest.approx(30 * 2 * math.pi)
    assert axis.speed_limit_rad_s == pytest.approx(50 * 2 * math.pi)
    assert axis.effort_limit_nm == pytest.approx(0.63)
    text = path.read_text("utf-8")
    assert re.search(r"^travel_limit_rad = [\d.]+ +# rad, .*from 300mm end to end$", text, re.M)


def test_an_option_for_one_axis_comes_before_that_for_all(tmp_path: Path) -> None:
    path = tmp_path / "mixed.toml"
    done = run(
        path, *PAPER, "--travel=z=7.6", "--kind=z=rotary", "--speed=z=90deg/s", "--travel=z=90"
    )
    assert done.exit_code == 0, done.stderr
    axes = edge_ident.load_drive(path).axes
    assert axes["x"].travel_limit_rad == pytest.approx(5.7 / 4.0 * 2.0 * math.pi)
    assert axes["z"].travel_limit_rad == pytest.approx(math.pi / 4)
    assert axes["z"].speed_limit_rad_s == pytest.approx(math.pi / 2)
    assert axes["z"].screw_lead_m_per_rad == 0.0


def test_what_does_not_count_is_said(tmp_path: Path) -> None:
    turning = [word for word in PAPER if not word.startswith("--travel")]
    given = (*turning, "--travel=90deg", "--kind=rotary", "--load=0.5", "--friction=0.01")
    done = run(tmp_path / "turning.toml", *given)
    assert done.exit_code == 0, done.stderr
    assert "axis x is rotary: --lead does not count for it" in done.stderr
    assert "assumed: axis x, z: load and friction not used" in done.stderr
    done = run(tmp_path / "known.toml", *given, "--rotor-inertia=0.26")
    assert "not used" not in done.stderr


def test_the_document_is_the_description(tmp_path: Path) -> None:
    import tomllib

    path = tmp_path / "paper.toml"
    document = json.loads(run(path, *PAPER, "--json").stdout)
    assert document["schema"] == "edge-ident/drive/1"
    assert document["file"] == str(path)
    assert document["drive"] == tomllib.loads(path.read_text("utf-8"))
    assert all(isinstance(line, str) for line in document["assumed"])


def test_a_run_takes_the_file(tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    run(path, *PAPER)
    done = CliRunner().invoke(
        app,
        ["run", "--device", "virtual", "--drive", str(path), "--dry-run", "--json",
         "-o", str(tmp_path / "out")],
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    assert all(a["trusted"] for a in json.loads(done.stdout)["identification"]["axes"].values())


# ---- refusals


def refused(done: Result, exit_code: int, *words: str) -> None:
    document = json.loads(done.stdout)
    assert (done.exit_code, document["exit_code"]) == (exit_code, exit_code)
    for word in words:
        assert word in document["message"] + document["next_step"]


def test_a_file_that_exists_stays_unless_told_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("mine")
    refused(run(path, *PAPER, "--json"), 5, "exists already", "--overwrite")
    assert path.read_text() == "mine"
    assert run(path, *PAPER, "--overwrite").exit_code == 0
    assert is_the_papers(edge_ident.load_drive(path))


@pytest.mark.parametrize(
    ("more", "exit_code", "words"),
    [
        (("--travel=1000m",), 5, ("axis x, travel", "7.854e+05 rad", "100000 rad")),
        (("--encoder=64",), 5, ("one count is 62.5 um", "--accept-implausible")),
        (("--rotor-inertia=1", "--load=1e14"), 5, ("is that of no axis", "axis z, load")),
        (("--sample-rate=2.5",), 5, ("sample rate", "period of 0.4 s")),
        (("--torque=3A",), 5, ("axis x, torque", "torque constant is not known")),
        (("--lead=4 kg",), 5, ("axis x, lead", "'kg' is not a unit")),
        (("--travel=y=300",), 2, ("no axis y, but x, z", "--travel")),
        (("--axis=x", "--axis=x"), 2, ("each axis once",)),
        (("--axis=x]",), 2, ("letters",)),
        (("--name=\x7f",), 5, ("line 4",)),
    ],
)
def test_what_is_refused_leaves_no_file(
    tmp_path: Path, more: tuple[str, ...], exit_code: int, words: tuple[str, ...]
) -> None:
    refused(run(tmp_path / "mine.toml", *PAPER, *more, "--json"), exit_code, *words)
    assert list(tmp_path.iterdir()) == []


def test_an_implausible_number_can_be_accepted(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert run(path, *PAPER, "--encoder=64", "--accept-implausible").exit_code == 0
    assert edge_ident.load_drive(path).axes["x"].encoder_counts_per_turn == 64.0


def test_without_a_terminal_all_that_is_missing_is_named(tmp_path: Path) -> None:
    done = run(tmp_path / "mine.toml", "--kind=z=rotary", "--lead=4", "--json")
    refused(done, 2, "--sample-rate, --gear-ratio, --encoder-at, --encoder, --torque, --travel")
    assert "--lead" not in json.loads(done.stdout)["message"]
    assert "--friction" not in json.loads(done.stdout)["message"]


# ---- a person on a terminal


def test_a_person_is_asked_in_plain_units(on_terminal: None, tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    done = run(path, typed="\n".join([*TYPED, "y", ""]))
    assert (done.exit_code, done.stdout) == (0, f"{path}\n")
    assert is_the_papers(edge_ident.load_drive(path))
    assert "Lead: travel for one turn of the screw, pulley or pinion, in mm: " in done.stderr
    assert "axis x, lead: 4 mm = 0.00063662 m/rad" in done.stderr
    assert "axis x, friction: not known" in done.stderr


def test_a_bad_or_doubtful_answer_is_asked_again(on_terminal: None, tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    # a negative lead, then 4 m, which is questioned and not kept, then what is meant
    typed = [*TYPED[:2], "-4", "4 m", "n", *TYPED[2:], "y", ""]
    done = run(path, typed="\n".join(typed))
    assert done.exit_code == 0, done.stderr
    assert "'-4' is not a positive number" in done.stderr
    assert "one turn moves the table by 4000 mm: is the lead in mm?" in done.stderr
    assert is_the_papers(edge_ident.load_drive(path))


def test_a_doubtful_answer_can_be_kept(on_terminal: None, tmp_path: Path) -> None:
    typed = [*TYPED[:5], "64", "y", *TYPED[6:], "y", ""]
    assert run(tmp_path / "mine.toml", typed="\n".join(typed)).exit_code == 0
    drive = edge_ident.load_drive(tmp_path / "mine.toml")
    assert drive.axes["z"].encoder_counts_per_turn == 64.0


def test_only_what_no_option_says_is_asked(on_terminal: None, tmp_path: Path) -> None:
    path = tmp_path / "paper.toml"
    # kind and what may stay unknown, of both axes; the second one is not like the first
    one = ["", "", "", "", "", ""]
    done = run(path, *PAPER, typed="\n".join([*one, "n", *one, ""]))
    assert done.exit_code == 0, done.stderr
    assert "Lead" not in done.stderr
    assert is_the_papers(edge_ident.load_drive(path))


@pytest.mark.parametrize("answers", range(len(TYPED)))
def test_the_end_of_input_writes_nothing(on_terminal: None, tmp_path: Path, answers: int) -> None:
    done = run(tmp_path / "mine.toml", "--json", typed="".join(f"{t}\n" for t in TYPED[:answers]))
    refused(done, 130)
    assert list(tmp_path.iterdir()) == []


def ended_by_ctrl_c(process: "subprocess.Popen[bytes]") -> int | None:
    """Its exit code; pressed again, since Python misses a signal just before it starts to read."""
    for _ in range(12):
        process.send_signal(2)
        with suppress(subprocess.TimeoutExpired):
            return process.wait(timeout=10)
    return None


def test_ctrl_c_at_a_question_of_a_terminal_writes_nothing(tmp_path: Path) -> None:
    host, terminal = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "edge_ident", "init", str(tmp_path / "mine.toml")],
        stdin=terminal, stdout=subprocess.PIPE, stderr=terminal, start_new_session=True,
    ) as process:  # fmt: skip
        os.close(terminal)
        try:
            shown = b""
            for wanted, answer in ((b"in Hz: ", b"400\n"), (b"(linear): ", b"")):
                while wanted not in shown:
                    shown += os.read(host, 1024)
                os.write(host, answer)
            assert ended_by_ctrl_c(process) == 130
        finally:
            process.kill()
            os.close(host)
    assert list(tmp_path.iterdir()) == []
