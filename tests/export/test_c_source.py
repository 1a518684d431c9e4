"""A network in C answers as onnxruntime does to the same int8 graph, bit by bit, on every target.

The golden images are those that the loop of identification shows the network. Before the sigmoid,
answers are equal to the last bit. The sigmoid itself has a tolerance: onnxruntime's errs by 1.7e-7.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from typer.testing import CliRunner

onnx = pytest.importorskip("onnx")

import onnxruntime  # noqa: E402

from edge_ident.cli import app  # noqa: E402
from edge_ident.estimation.image import effort_image  # noqa: E402
from edge_ident.estimation.network import load_network  # noqa: E402
from export.c_source.source import CSource, c_source  # noqa: E402
from tests.export.c_builds import (  # noqa: E402
    INT8,
    PROGRAMS,
    STRICT,
    Images,
    built,
    changed,
    needs,
    replace_constants,
    write,
)
from tools.arm_check.agreement import exact_int8  # noqa: E402

SIGMOID_TOLERANCE: Final = 2e-7


with_reference = pytest.mark.skipif(
    not exact_int8(), reason="needs an x86-64 processor with VNNI, for onnxruntime to be exact"
)


@pytest.fixture(scope="module")
def images() -> Images:
    """What the loop shows: remainders of drives from 0.1 % to 100 % off, with and without noise."""
    manifest = load_network("int8").manifest
    assert manifest.start_shares is not None
    columns = manifest.motion.regressor / manifest.motion.column_scales
    rng = np.random.default_rng(20)
    remainders = []
    for number in range(48):
        remainder = columns @ (rng.normal(size=4) * 10.0 ** rng.uniform(-3, 0))
        noise = 0.3 * (number % 3) * rng.uniform() * np.std(remainder)
        remainder += noise * rng.normal(size=len(remainder))
        remainders.append(remainder / np.sqrt(2.0 * np.mean(remainder**2)))
    start = np.broadcast_to(columns @ manifest.start_shares, (48, len(columns)))
    return effort_image(start, np.array(remainders), manifest.normalization)


def answers(content: bytes, images: Images) -> Images:
    """Residuals and sigmoids of onnxruntime, one image at a time, (n, 8)."""
    model = onnx.load_from_string(content)
    before = model.graph.node[-1].input[0]
    model.graph.output.append(onnx.helper.make_empty_tensor_value_info(before))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        model.SerializeToString(), options, ["CPUExecutionProvider"]
    )
    runs = (session.run(None, {"image": image[None]}) for image in images)
    return np.array([np.concatenate([residuals[0], sigmoids[0]]) for sigmoids, residuals in runs])


def run(command: Sequence[str | Path], images: Images) -> Images:
    done = subprocess.run(command, input=images.tobytes(), stdout=subprocess.PIPE, check=True)
    return np.frombuffer(done.stdout, np.float32).reshape(-1, 8)


def require_equal(found: Images, wanted: Images) -> None:
    np.testing.assert_array_equal(found[:, :4].view(np.uint32), wanted[:, :4].view(np.uint32))
    np.testing.assert_allclose(found[:, 4:], wanted[:, 4:], rtol=0.0, atol=SIGMOID_TOLERANCE)


@pytest.fixture(scope="module")
def source() -> CSource:
    return c_source(INT8.read_bytes(), INT8.name)


# ---- the answer


@with_reference
@needs("gcc")
@pytest.mark.parametrize(
    "options",
    [
        (*STRICT, "-O2"),
        (*STRICT, "-O1", "-g", "-fsanitize=address,undefined,float-cast-overflow",
         "-fno-sanitize-recover=all"),
        ("-std=gnu99", "-O3", "-march=native", "-ffp-contract=fast"),
    ],
    ids=["strict", "sanitized", "contracted"],
)  # fmt: skip
def test_the_answer_is_that_of_onnxruntime_to_the_last_bit(
    options: tuple[str, ...], source: CSource, images: Images, tmp_path: Path
) -> None:
    """With fused multiplication and addition or without, whatever the compiler contracts."""
    write(source, tmp_path)
    program = built(tmp_path, source, "host.c", "gcc", *options)
    require_equal(run([program], images), answers(INT8.read_bytes(), images))


@with_reference
@needs("aarch64-linux-gnu-gcc", "qemu-aarch64")
def test_a_cortex_a_answers_the_same(source: CSource, images: Images, tmp_path: Path) -> None:
    write(source, tmp_path)
    compiler = "aarch64-linux-gnu-gcc"
    program = built(tmp_path, source, "host.c", compiler, *STRICT, "-O2", "-static")
    found = run(["qemu-aarch64", program], images[:4])
    require_equal(found, answers(INT8.read_bytes(), images[:4]))


@with_reference
@needs("arm-none-eabi-gcc", "qemu-system-arm")
@pytest.mark.parametrize(("cpu", "board"), [("m4", "mps2-an386"), ("m7", "mps2-an500")])
def test_a_cortex_m_answers_the_same_without_a_library(
    cpu: str, board: str, source: CSource, images: Images, tmp_path: Path
) -> None:
    """Within 40 million instructions and half a kibibyte of stack."""
    write(source, tmp_path, images[:2])
    command = [
        "arm-none-eabi-gcc", f"-mcpu=cortex-{cpu}", "-mthumb", "-mfloat-abi=hard", "-ffreestanding",
        *STRICT, "-O2", "-nostdlib", "-I", tmp_path, "-T", PROGRAMS / "cortex_m.ld",
        "-o", tmp_path / "program", tmp_path / f"{source.name}.c", PROGRAMS / "cortex_m.c", "-lgcc",
    ]  # fmt: skip
    subprocess.run(list(map(str, command)), check=True)
    emulator = [
        "qemu-system-arm", "-machine", board, "-nographic", "-icount", "shift=0",
        "-semihosting-config", "enable=on,target=native", "-kernel", tmp_path / "program",
    ]  # fmt: skip
    done = subprocess.run(
        list(map(str, emulator)), capture_output=True, text=True, check=True, timeout=100
    )
    said = [line.split() for line in (done.stdout + done.stderr).splitlines()]
    bits = [int(value, 16) for name, value in said if name == "answer"]
    found = np.array(bits, np.uint32).view(np.float32).reshape(-1, 8)
    require_equal(found, answers(INT8.read_bytes(), images[:2]))
    assert all(int(value, 16) < 40_000_000 for name, value in said if name == "instructions")
    assert [int(value, 16) < 512 for name, value in said if name == "stack"] == [True]


@needs("gcc")
def test_a_pixel_that_is_no_number_is_refused(source: CSource, tmp_path: Path) -> None:
    write(source, tmp_path)
    program = built(tmp_path, source, "host.c", "gcc", *STRICT, "-O0", "-fsanitize=undefined")
    for pixel in (np.nan, np.inf, -np.inf, 2e20):
        image = np.zeros((1, 100, 100), np.float32)
        image[0, 99, 99] = pixel
        assert subprocess.run([program], input=image.tobytes()).returncode == 1


# ---- other networks


def _another_training(graph: Any) -> None:
    """No mirrored kernels, a bias in the first layer, no idle inputs, other zero points."""
    rng = np.random.default_rng(3)
    replace_constants(
        graph,
        first_weight=rng.normal(scale=0.05, size=(10, 1, 9, 9)).astype(np.float32),
        relu_zero_point=np.int8(-100),
        conv2d_1_zero_point=np.int8(-7),
        relu_1_zero_point=np.int8(-120),
        dense_0_weight_quantized=rng.integers(-127, 128, (80, 3610)).astype(np.int8),
        dense_0_weight_scale=rng.uniform(1e-4, 2e-4, 80).astype(np.float32),
        dense_0_weight_zero_point=np.zeros(80, np.int8),
        dense_1_weight=rng.normal(scale=0.1, size=(100, 80)).astype(np.float32),
    )
    bias = rng.normal(scale=0.05, size=10).astype(np.float32)
    graph.initializer.append(onnx.numpy_helper.from_array(bias, "first.bias"))
    first = next(node for node in graph.node if "first.weight" in node.input)
    first.input.append("first.bias")


@with_reference
@needs("gcc")
def test_a_network_of_another_training_answers_as_onnxruntime_does(
    images: Images, tmp_path: Path
) -> None:
    content = changed(_another_training)
    source = c_source(content, "2. Möbel_int8.onnx")
    assert source.name == "network_2__M_bel_int8"
    write(source, tmp_path)
    program = built(tmp_path, source, "host.c", "gcc", *STRICT, "-O2", "-march=native")
    wanted = answers(content, images)
    assert np.ptp(wanted[:, :4]) > 0.1
    require_equal(run([program], images), wanted)


# ---- the text


def test_the_same_network_gives_the_same_text(source: CSource) -> None:
    again = c_source(INT8.read_bytes(), INT8.name)
    assert again == source
    root = str(Path(__file__).parents[2])
    for text in source.files.values():
        assert root not in text
        assert max(map(len, text.splitlines())) <= 100
    header = source.files["feed_drive_int8.h"]
    assert load_network("int8").sha256 in header


# ---- the command


def in_a_process_without(package: str, folder: Path) -> subprocess.CompletedProcess[str]:
    script = (
        f"import sys; sys.modules[{package!r}] = None\n"
        "from edge_ident.__main__ import main\n"
        f"sys.argv[1:] = ['export', '--c', {str(folder)!r}]\nmain()"
    )
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=os.environ
    )


def test_the_command_needs_no_torch(tmp_path: Path, source: CSource) -> None:
    done = in_a_process_without("torch", tmp_path / "c")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{tmp_path / 'c' / 'feed_drive_int8.h'}\n"
    assert f"{source.sizes.constants_bytes} bytes of constants" in done.stderr
    for name, text in source.files.items():
        assert (tmp_path / "c" / name).read_text() == text


def test_without_onnx_it_says_what_to_install(tmp_path: Path) -> None:
    done = in_a_process_without("onnx", tmp_path / "c")
    assert done.returncode == 5
    assert "pip install onnx" in done.stderr
    assert not (tmp_path / "c").exists()


def test_a_checkpoint_is_no_network(tmp_path: Path) -> None:
    for arguments in (["run.pt", "--c", str(tmp_path)], ["--network", str(INT8)]):
        result = CliRunner().invoke(app, ["export", *arguments])
        assert result.exit_code == 2
        assert "--network" in result.output
