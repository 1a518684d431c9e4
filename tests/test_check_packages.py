"""What the check of the packages refuses; the check itself runs as tools/check_packages.py."""

import re
import zipfile
from pathlib import Path

import pytest

from tools import check_packages

ROOT = Path(__file__).parents[1]


def wheel(folder: Path, *, more: str = "", less: str = "") -> Path:
    """Packed from the checkout, with a file more or less."""
    path = folder / "edge_ident-1.0-py3-none-any.whl"
    folders = (*check_packages.INSTALLED, *check_packages.NOT_INSTALLED)
    names = check_packages.tracked(*folders) - {less}
    with zipfile.ZipFile(path, "w") as archive:
        for name in (*names, "edge_ident-1.0.dist-info/METADATA", *([more] if more else [])):
            archive.writestr(name, "")
    return path


def test_a_wheel_of_both_packages_is_right(tmp_path: Path) -> None:
    check_packages.check_wheel(wheel(tmp_path))


def test_a_wheel_with_another_top_level_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(check_packages.CheckError, match=r"too much \['export/train.py'\]"):
        check_packages.check_wheel(wheel(tmp_path, more="export/train.py"))


def test_a_wheel_without_its_network_is_refused(tmp_path: Path) -> None:
    network = "edge_ident/networks/feed_drive_fp32.onnx"
    with pytest.raises(check_packages.CheckError, match=f"missing .*{network}"):
        check_packages.check_wheel(wheel(tmp_path, less=network))


def test_a_wheel_that_is_too_large_is_refused(tmp_path: Path) -> None:
    path = wheel(tmp_path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("edge_ident-1.0.dist-info/large", bytes(3 << 20))
    limit = f"more than {check_packages.LARGEST_WHEEL_MIB} MiB"
    with pytest.raises(check_packages.CheckError, match=limit):
        check_packages.check_wheel(path)


def test_the_container_copies_what_the_wheel_is_made_of() -> None:
    text = (ROOT / "tools" / "Containerfile").read_text("utf-8")
    copied = " ".join(re.findall(r"^COPY (?!--)(.+) \S+$", text, re.M)).split()
    assert set(copied) == {"pyproject.toml", "README.md", "LICENSE", *check_packages.INSTALLED}
