"""One map, three generated files, one CRC."""

import shutil
import subprocess
from pathlib import Path

import pytest

from firmware_interface import generate
from firmware_interface.generate import SOURCE, load_map
from firmware_interface.registers import MAP_CRC, REGISTERS


def test_generated_files_are_up_to_date() -> None:
    assert generate.main(["--check"]) == 0


def test_check_names_the_file_that_is_out_of_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    package = tmp_path / "firmware_interface"
    package.mkdir()
    files = generate.render(load_map(), package)
    for path, text in files.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, "utf-8")
    (package / "registers.h").write_text("/* edited by hand */\n", "utf-8")
    monkeypatch.setattr(generate, "_PACKAGE", package)
    monkeypatch.setattr(generate, "render", lambda source: files)
    assert generate.main(["--check"]) == 1
    assert capsys.readouterr().err == "firmware_interface/registers.h is out of date\n"


def changed(tmp_path: Path, old: str, new: str) -> int:
    """CRC of the map after a change of its source."""
    text = SOURCE.read_text("utf-8")
    assert old in text
    path = tmp_path / "registers.toml"
    path.write_text(text.replace(old, new, 1), "utf-8")
    return load_map(path).crc


def test_crc_follows_the_contract_and_not_the_prose(tmp_path: Path) -> None:
    assert load_map().crc == MAP_CRC
    assert changed(tmp_path, "Serial number of the board.", "Its number.") == MAP_CRC
    assert changed(tmp_path, "address = 0x0012", "address = 0x0014") != MAP_CRC
    assert changed(tmp_path, "scale = 1e-9", "scale = 1e-6") != MAP_CRC
    assert changed(tmp_path, 'type = "u32"', 'type = "i32"') != MAP_CRC


def test_overlapping_registers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="overlaps"):
        changed(tmp_path, "address = 0x0008", "address = 0x0007")


def test_both_axes_have_the_same_registers() -> None:
    def shape(axis: str) -> list[str]:
        return [name.replace(f".{axis}.", ".") for name in REGISTERS if f".{axis}." in name]

    assert shape("x") == shape("z")
    assert len(shape("x")) > 30


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_header_compiles_and_its_layout_assertions_hold() -> None:
    header = Path(generate.__file__).with_name("registers.h")
    command = [
        "cc",
        "-std=c99",
        "-pedantic",
        "-Wall",
        "-Werror",
        "-fsyntax-only",
        "-x",
        "c",
        str(header),
    ]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0
