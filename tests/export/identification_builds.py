"""The reference firmware with the network, and what tells whether it identifies as Python does."""

import struct
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import onnxruntime
from numpy.typing import NDArray

from edge_ident import load_network, simulate
from edge_ident.commissioning.board_answer import counts_of
from edge_ident.estimation.image import effort_image
from edge_ident.estimation.manifest import BUILT_IN
from edge_ident.estimation.network_estimate import BoardNetwork
from export.c_source.source import export_c
from firmware_interface import registers
from firmware_interface.board_identification import (
    BoardIdentification,
    CapturedCounts,
    decoded_identification,
)
from firmware_interface.board_types import BoardIdentity
from firmware_interface.registers import AXES

FIRMWARE: Final = Path(registers.__file__).with_name("reference_firmware")
BOARD: Final = BoardIdentity("2.0", 1, 1, 0.0025, 0.0005, 8400, float(np.float32(0.004)))
INT8: Final = BUILT_IN.with_name("feed_drive_int8.onnx")


class ExactNetwork:
    """The int8 network before its sigmoid: onnxruntime's errs by 1.7e-7, which an int8 network
    that is shown its own answer makes into tenths of its standard deviation."""

    def __init__(self) -> None:
        self.manifest, self.variant = load_network("int8").manifest, "int8"
        model = onnx.load(INT8)
        before = model.graph.node[-1].input[0]
        del model.graph.output[:]
        model.graph.output.append(onnx.helper.make_empty_tensor_value_info(before))
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self._session = onnxruntime.InferenceSession(
            model.SerializeToString(), options, ["CPUExecutionProvider"]
        )

    def residuals_of(
        self, model: NDArray[np.float64], measured: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        images = effort_image(model, measured, self.manifest.normalization)
        answers = [self._session.run(None, {"image": image[None]})[0][0] for image in images]
        return np.array(answers, dtype=np.float64)


@cache
def exact_board() -> BoardNetwork:
    """What the firmware is to find, to the last digit."""
    network: Any = ExactNetwork()
    return BoardNetwork(network)


@cache
def simulated(**options: Any) -> CapturedCounts:
    """Counts of a drive in closed loop, for all tests that ask: nobody may write to them."""
    captured = counts_of(simulate(**options), BOARD, AXES)
    captured.position.flags.writeable = captured.effort.flags.writeable = False
    return captured


def build(folder: Path, target: str) -> Path:
    """A program of the firmware's Makefile, with the network."""
    network = folder / "network"
    if not network.exists():
        export_c(network)
    command = ["make", "-s", "-C", FIRMWARE, f"BUILD={folder}", f"NETWORK={network}", target]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / target


def packed(captured: CapturedCounts, board: BoardIdentity = BOARD) -> bytes:
    """What identify_counts reads."""
    samples = len(captured.position)
    delay_ns = round(1e9 * board.control_delay_s)
    head = struct.pack("<IfII", board.counts_per_turn, board.effort_per_count_nm, delay_ns, samples)
    return head + rows(captured).astype("<i4").tobytes()


def rows(captured: CapturedCounts) -> NDArray[np.int64]:
    """Position and effort of every axis, a row for each sample."""
    pairs = np.stack([captured.position, captured.effort], axis=2)
    return pairs.reshape(len(pairs), -1)


def identified(
    program: Path, captured: CapturedCounts, board: BoardIdentity = BOARD
) -> BoardIdentification:
    """What the firmware finds."""
    done = subprocess.run([program], input=packed(captured, board), capture_output=True, check=True)
    return decoded_identification([int(word) for word in done.stdout.split()[:30]])


def shortened(captured: CapturedCounts, samples: int) -> CapturedCounts:
    """The first samples alone."""
    return replace(captured, position=captured.position[:samples], effort=captured.effort[:samples])
