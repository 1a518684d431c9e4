"""Builds sdist and wheel, installs the wheel in a clean environment, and uses what was installed.

python tools/check_packages.py [--keep FOLDER]    exit code 1 at the first thing that is wrong

It needs no installed package: `build` comes into an environment of its own. What is checked:

- The wheel is built from the sdist, so the sdist is complete and installs.
- The wheel is at most 2.8 MiB: some boards have a slow link. More than half is the networks.
- The wheel holds the tracked files of `edge_ident` and `firmware_interface`, less the simulated
  FPGA, the firmware with its header, and what the register map is generated from, which are for
  a checkout. It holds no other top-level name: `export`, `tools` and `tests` stay in
  the checkout, because a package of such a name in site-packages would hide another's.
- From an empty folder, the installed command simulates, identifies with the built-in network,
  and says how to get what is not installed.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import venv
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, TypeVar

ROOT: Final = Path(__file__).parents[1]
INSTALLED: Final = ("edge_ident", "firmware_interface")
NOT_INSTALLED: Final = (
    ":(exclude)firmware_interface/generate.py",
    ":(exclude)firmware_interface/hdl",
    ":(exclude)firmware_interface/reference_firmware",
    ":(exclude)firmware_interface/generate.py",
    ":(exclude)firmware_interface/registers.h",
    ":(exclude)firmware_interface/registers.toml",
)
LEFT_OUT: Final = ("export", "tools", "tests", "docs")
Result = TypeVar("Result")
LARGEST_WHEEL_MIB: Final = 2.8
_WRONG_MODEL: Final = 5  # exit code of a command that needs a checkout


def main(arguments: Sequence[str]) -> int:
    """Check everything in a temporary folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="copy sdist and wheel there")
    keep = parser.parse_args(arguments).keep
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        try:
            sdist, wheel = _timed("build", lambda: build(work))
            check_sdist(sdist)
            check_wheel(wheel)
            python = _timed("install the wheel", lambda: installed(work, wheel))
            _timed("use the wheel", lambda: check_use(python, work))
        except CheckError as error:
            print(f"packages: {error}", file=sys.stderr)
            return 1
        if keep:
            keep.mkdir(parents=True, exist_ok=True)
            for made in (sdist, wheel):
                shutil.copy(made, keep)
    return 0


class CheckError(Exception):
    """Something is wrong with a package."""


def build(work: Path) -> tuple[Path, Path]:
    """Make the sdist, and the wheel from it."""
    venv.create(work / "build", with_pip=True)
    python = _python(work / "build")
    needed = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["build-system"]["requires"]
    _run([python, "-m", "pip", "install", "-q", "build", *needed], work)
    # this environment holds what the build needs and nothing else: two more would be the same
    alone = ["--no-isolation", "--outdir", str(work / "dist"), str(ROOT)]
    _run([python, "-m", "build", *alone], work)
    (sdist,), (wheel,) = ((work / "dist").glob(kind) for kind in ("*.tar.gz", "*.whl"))
    return sdist, wheel


def check_sdist(sdist: Path) -> None:
    """Check that the sdist has every tracked file and nothing else."""
    with tarfile.open(sdist) as archive:
        names = {member.name.partition("/")[2] for member in archive if member.isfile()}
    _compare("sdist", names - {"PKG-INFO"}, tracked("."))


def check_wheel(wheel: Path) -> None:
    """Check that the wheel has the two packages and nothing else, and is small."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    ours = {name for name in names if not name.split("/")[0].endswith(".dist-info")}
    _compare("wheel", ours, tracked(*INSTALLED, *NOT_INSTALLED))
    size_mib = wheel.stat().st_size / 2**20
    print(f"wheel: {size_mib:.2f} MiB")
    if size_mib > LARGEST_WHEEL_MIB:
        raise CheckError(f"wheel: {size_mib:.2f} MiB, more than {LARGEST_WHEEL_MIB} MiB")


def tracked(*folders: str) -> set[str]:
    """Files under version control below some folders."""
    listed = subprocess.run(
        ["git", "ls-files", *folders], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(listed.stdout.splitlines())


def _compare(what: str, found: set[str], expected: set[str]) -> None:
    missing, more = sorted(expected - found), sorted(found - expected)
    if missing or more:
        raise CheckError(f"{what}: missing {missing[:5]}, too much {more[:5]}")
    print(f"{what}: {len(found)} files")


def installed(work: Path, package: Path) -> str:
    """Python of a clean environment that holds a package and what it depends on.

    The pip of the environment that built it does that: another takes seconds to unpack.
    """
    builder, python = (_python(work / name) for name in ("build", "wheel"))
    venv.create(work / "wheel", with_pip=False)
    _run([builder, "-m", "pip", "--python", python, "install", "-q", str(package)], work)
    return python


def check_use(python: str, work: Path) -> None:
    """Use an installed package from an empty folder."""
    empty = work / "empty"
    empty.mkdir()
    command = str(Path(python).with_name("edge-ident"))
    names = ", ".join(map(repr, LEFT_OUT))
    found = f"import importlib.util as u; print([n for n in ({names}) if u.find_spec(n)])"
    if _run([python, "-c", found], empty).strip() != "[]":
        raise CheckError(f"one of {names} can be imported")
    _run([command, "simulate", "--noise", "0.02", "-o", "recording.csv"], empty)
    document = json.loads(_run([command, "identify", "recording.csv", "--json"], empty))
    for name, axis in document["axes"].items():
        if not axis["trusted"] or axis["estimators"]["cnn"] is None:
            raise CheckError(f"axis {name} is not trusted, or the network is missing")
    told = _run([command, "train", "--output", "runs"], empty, expected=_WRONG_MODEL)
    if "pip install -e '.[train]'" not in told:
        raise CheckError(f"train does not say how to get it: {told}")


def _python(folder: Path) -> str:
    return str(folder / "bin" / "python")


def _run(command: Sequence[str], folder: Path, expected: int = 0) -> str:
    """What a command prints; both streams where it ends otherwise than with success."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != expected:
        said = (done.stdout + done.stderr)[-2000:]
        raise CheckError(f"{' '.join(command)}: exit code {done.returncode}\n{said}")
    return done.stdout + done.stderr if expected else done.stdout


def _timed(what: str, step: Callable[[], Result]) -> Result:
    begun = time.monotonic()
    result = step()
    print(f"{what}: {time.monotonic() - begun:.0f} s", flush=True)
    return result


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
