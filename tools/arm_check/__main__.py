"""Identifies a recording as ARM boards would: Linux's aarch64 wheels, on emulated processors.

python -m tools.arm_check [--folder FOLDER]    exit code 1 where an answer is another

Processors of Raspberry Pi 4 and 5 answer what this x86-64 processor answers to the same questions:

- The int8 network gives the same residuals to the last bit.
- The fp32 network gives residuals that differ by less than its loop resolves.
- The command `edge-ident identify` gives the same parameters, to a hundredth of their standard
  deviations.

Debian's Python and libraries for ARM and the wheels are unpacked into a folder, where they stay for
the next time. Nothing is installed, and no root is needed. Where the emulator (Debian's qemu-user),
Debian or the package index is missing, the tool says so, checks nothing and ends with exit code 0.
"""

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

import edge_ident
from edge_ident.estimation.image import effort_image
from tools.arm_check.agreement import exact_int8, networks_agree, parameters_agree
from tools.arm_check.board import PROCESSORS, Board, NotHereError, board, printed

_IMAGES: Final = 8


def images() -> NDArray[np.float32]:
    """What the loop shows a network: scaled remainders of random drives, with noise of a tenth."""
    manifest = edge_ident.load_network("int8").manifest
    assert manifest.start_shares is not None
    columns = manifest.motion.regressor / manifest.motion.column_scales
    rng = np.random.default_rng(20)
    remainders = rng.normal(size=(_IMAGES, 4)) @ columns.T
    remainders += 0.1 * np.std(remainders, axis=1)[:, None] * rng.normal(size=remainders.shape)
    remainders /= np.sqrt(2.0 * np.mean(remainders**2, axis=1))[:, None]
    start = np.broadcast_to(columns @ manifest.start_shares, remainders.shape)
    return effort_image(start, remainders, manifest.normalization)


def recording() -> edge_ident.Recording:
    """One axis on the motion that the network knows, with noise of 2 %."""
    whole = edge_ident.simulate(noise=0.02)
    name = next(iter(whole.axes))
    return dataclasses.replace(whole, axes={name: whole.axes[name]})


def check(arm: Board, work: Path) -> bool:
    """Ask both machines the same; print how they agree."""
    np.save(work / "images.npy", images())
    edge_ident.save_recording(recording(), work / "recording.npz")
    network = ["-m", "tools.arm_check.answer", str(work / "images.npy")]
    identify = ["-m", "edge_ident", "identify", str(work / "recording.npz"), "--no-diagnose"]
    # each machine would choose the quicker precision of its own
    whole = [*identify, "--precision", "fp32", "--json"]
    wanted = [json.loads(printed([sys.executable, *asked])) for asked in (network, whole)]
    good = True
    for processor in PROCESSORS:
        found = json.loads(arm.runs(processor, network))
        told, agree = networks_agree(found, wanted[0], exact=exact_int8())
        print(f"{processor}: {told}: {'ok' if agree else 'WRONG'}", flush=True)
        good = good and agree
    processor = next(iter(PROCESSORS))
    told, agree = parameters_agree(json.loads(arm.runs(processor, whole)), wanted[1])
    print(f"{processor}: {told}: {'ok' if agree else 'WRONG'}")
    return good and agree


def main() -> int:
    """Check in a temporary folder, on the board in the given one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    parser.add_argument(
        "--folder", type=Path, default=cache / "edge-ident-arm",
        help="where the unpacked files stay, 220 MB; default: %(default)s",
    )  # fmt: skip
    folder = parser.parse_args().folder.resolve()
    try:
        arm = board(folder)
        with tempfile.TemporaryDirectory() as work:
            return 0 if check(arm, Path(work)) else 1
    except NotHereError as reason:
        print(f"ARM: skipped: {reason}")
        return 0
    except subprocess.CalledProcessError as error:
        print(f"ARM: {error}\n{error.stderr}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
