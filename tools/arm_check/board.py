"""An ARM board as folders: Debian's files, the wheels, and an emulator that runs their Python."""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
PROCESSORS: Final = {
    "cortex-a72": ("0xd08", "fp asimd evtstrm crc32 cpuid"),
    "cortex-a76": (
        "0xd0b",
        "fp asimd evtstrm aes pmull sha1 sha2 crc32 atomics fphp asimdhp cpuid asimdrdm lrcpc "
        "dcpop asimddp",
    ),
}
"""The emulator's name of each: its part number and its features, as Linux tells them. The second
has dot products of eight bits, so onnxruntime takes other code there.
"""
_PROGRAMS: Final = {"qemu-aarch64": "qemu-user", "apt-get": "apt", "dpkg-deb": "dpkg"}
_FROM_DEBIAN: Final = ("python3-minimal", "libpython3-stdlib", "libstdc++6")
_PLATFORMS: Final = ("manylinux_2_28_aarch64", "manylinux_2_17_aarch64")
# The diagnosis alone needs it, and it is half of what would be downloaded.
_LEFT_OUT: Final = "scipy"
_LONGEST_S: Final = 600


class NotHereError(Exception):
    """What is missing here, so that nothing can be checked."""


@dataclass(frozen=True)
class Board:
    """An ARM board as folders: Debian's files, the wheels, and what Python compiles."""

    folder: Path
    python: Path

    def runs(self, processor: str, arguments: Sequence[str]) -> str:
        """What a Python command prints on a processor."""
        part, features = PROCESSORS[processor]
        # onnxruntime looks there for what it may use; x86's would crash it
        cpuinfo = self.folder / "sysroot" / "proc" / "cpuinfo"
        cpuinfo.parent.mkdir(exist_ok=True)
        cpuinfo.write_text(
            f"processor\t: 0\nFeatures\t: {features}\nCPU implementer\t: 0x41\n"
            f"CPU architecture: 8\nCPU variant\t: 0x0\nCPU part\t: {part}\nCPU revision\t: 3\n\n"
        )
        emulator = ["qemu-aarch64", "-cpu", processor, "-L", str(self.folder / "sysroot")]
        return printed([*emulator, str(self.python), *arguments], self._environment())

    def _environment(self) -> dict[str, str]:
        changed = {
            "PYTHONPATH": f"{self.folder / 'wheels'}:{ROOT}",
            "PYTHONPYCACHEPREFIX": str(self.folder / "compiled"),
            "OMP_NUM_THREADS": "1",
        }
        kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        return kept | changed


def board(folder: Path) -> Board:
    """Unpack what is not there yet.

    Raises
    ------
    NotHereError
        Something that is needed is missing or cannot be reached.
    """
    if platform.machine() != "x86_64":
        raise NotHereError(f"compares ARM with x86-64, and this is {platform.machine()}")
    for program, package in _PROGRAMS.items():
        if shutil.which(program) is None:
            raise NotHereError(f"{program} is missing (Debian's package {package})")
    folder.mkdir(parents=True, exist_ok=True)
    _once(folder / "sysroot", _unpack_debian, _FROM_DEBIAN)
    (python,) = (folder / "sysroot" / "usr" / "bin").glob("python3.[0-9]*")
    wanted = requirements()
    _once(folder / "wheels", lambda into: _unpack_wheels(into, python, wanted), wanted)
    return Board(folder, python)


def requirements() -> list[str]:
    """What the runtime needs, in the releases that are compared."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    needed = [one for one in project["dependencies"] if not one.startswith(_LEFT_OUT)]
    return [*needed, *(f"{name}=={version(name)}" for name in ("numpy", "onnxruntime"))]


def _once(folder: Path, unpack: Callable[[Path], None], key: Sequence[str]) -> None:
    """Fill a folder, unless it was filled for the same key; it appears whole or not at all."""
    made_for, text = folder.with_suffix(".txt"), "\n".join(key)
    if folder.is_dir() and made_for.exists() and made_for.read_text("utf-8") == text:
        return
    shutil.rmtree(folder, ignore_errors=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as partial:
        unpack(Path(partial) / "whole")
        (Path(partial) / "whole").rename(folder)
    made_for.write_text(text, "utf-8")


def _unpack_debian(into: Path) -> None:
    """Python and its libraries of this Debian release, whatever is installed here."""
    with tempfile.TemporaryDirectory() as name:
        state = Path(name)
        for folder in ("lists/partial", "cache/archives/partial"):
            (state / folder).mkdir(parents=True)
        (state / "status").touch()
        settings = {
            "APT::Architecture": "arm64",
            "APT::Architectures": "arm64",
            "APT::Sandbox::User": "root",
            "Acquire::Languages": "none",
            "Acquire::Retries": "1",
            "Acquire::http::Timeout": "20",
            "Debug::NoLocking": "1",
            "Dir::State::Lists": str(state / "lists"),
            "Dir::State::status": str(state / "status"),
            "Dir::Cache": str(state / "cache"),
        }
        apt = ["apt-get", "-qq", *(f"-o{key}={value}" for key, value in settings.items())]
        _reached("Debian", [*apt, "update"])
        wanted = ["install", "--download-only", "--no-install-recommends", *_FROM_DEBIAN]
        _reached("Debian", [*apt, "--yes", *wanted])
        for package in sorted((state / "cache" / "archives").glob("*.deb")):
            printed(["dpkg-deb", "-x", str(package), str(into)])


def _unpack_wheels(into: Path, python: Path, wanted: Sequence[str]) -> None:
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-compile", f"--target={into}"]
    for_arm = [f"--platform={name}" for name in _PLATFORMS]
    for_arm += [f"--python-version={python.name.removeprefix('python')}", "--only-binary=:all:"]
    _reached("the package index", [*pip, *for_arm, *wanted])


def _reached(where: str, command: Sequence[str]) -> None:
    try:
        printed(command)
    except subprocess.TimeoutExpired:
        raise NotHereError(f"{where} does not answer") from None
    except subprocess.CalledProcessError as error:
        lines = error.stderr.splitlines() or ["no answer"]
        named = [line for line in lines if line.startswith(("E:", "ERROR:"))]
        raise NotHereError(f"{where}: {(named or lines)[-1]}") from None


def printed(command: Sequence[str], environment: Mapping[str, str] | None = None) -> str:
    """What a command prints to stdout.

    Raises
    ------
    subprocess.CalledProcessError
        It fails.
    subprocess.TimeoutExpired
    """
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True,
        timeout=_LONGEST_S,
    )  # fmt: skip
    return done.stdout
