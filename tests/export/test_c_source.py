"""A network in C answers as onnxruntime does to the same int8 graph, bit by bit, on every target.

The golden images are those that the loop of identification shows the network. Before the sigmoid,
answers are equal to the last bit. The sigmoid itself has a tolerance: onnxruntime's errs by 1.7e-7.
"""

import os
import platform
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

onnx = pytest.importorskip("onnx")

import onnxruntime  # noqa: E402

from edge_ident.cli import app  # noqa: E402
from edge_ident.errors import ModelError  # noqa: E402
from edge_ident.estimation.image import effort_image  # noqa: E402
from edge_ident.estimation.network import BUILT_IN, load_network  # noqa: E402
from export.c_source import source as c_source_module  # noqa: E402
from export.c_source.source import CSource, c_source, export_c  # noqa: E402
from tests.export.c_builds import INT8, PROGRAMS, STRICT, built, needs, write  # noqa: E402

SIGMOID_TOLERANCE: Final = 2e-7
Images = NDArray[np.float32]


def exact_reference() -> bool:
    """Whether onnxruntime adds up int8 products without saturation, and floats fused, here.

    On x86 it does with the instructions for neural networks; without them, sums of two products
    of eight bits saturate at sixteen.
    """
    if platform.machine() not in ("x86_64", "AMD64"):
        return True
    flags = Path("/proc/cpuinfo")
    known = flags.read_text("utf-8").split() if flags.exists() else []
    return "fma" in known and ("avx512_vnni" in known or "avx_vnni" in known)


with_reference = pytest.mark.skipif(
    not exact_reference(), reason="onnxruntime saturates on this processor"
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


def changed(change: Callable[[Any], None]) -> bytes:
    model = onnx.load(INT8)
    change(model.graph)
    return bytes(model.SerializeToString())


def replace_constants(graph: Any, **values: NDArray[Any]) -> None:
    for item in graph.initializer:
        name = item.name.replace(".", "_")
        if name in values:
            item.CopyFrom(onnx.numpy_helper.from_array(values[name], item.name))


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


def _node(graph: Any, kind: str, number: int = 0) -> Any:
    return [node for node in graph.node if node.op_type == kind][number]


def _operator(graph: Any) -> None:
    _node(graph, "Sigmoid").op_type = "Tanh"


def _padding(graph: Any) -> None:
    attributes = _node(graph, "Conv", 1).attribute
    next(item for item in attributes if item.name == "pads").ints[:] = [1, 1, 1, 1]


def _pooling(graph: Any) -> None:
    attributes = _node(graph, "MaxPool").attribute
    next(item for item in attributes if item.name == "kernel_shape").ints[:] = [3, 3]


def _pooling_one_by_one(graph: Any) -> None:
    attributes = _node(graph, "MaxPool").attribute
    attributes.remove(next(item for item in attributes if item.name == "strides"))


def _not_transposed(graph: Any) -> None:
    attributes = _node(graph, "Gemm", 1).attribute
    attributes.remove(next(item for item in attributes if item.name == "transB"))


def _no_weights(graph: Any) -> None:
    del _node(graph, "Gemm", 2).input[1]


def _weights_zero_point(graph: Any) -> None:
    replace_constants(graph, third_weight_zero_point=np.full(10, 3, np.int8))


def _bias_scale(graph: Any) -> None:
    replace_constants(graph, second_bias_quantized_scale=np.full(10, 1e-3, np.float32))


def _branch(graph: Any) -> None:
    _node(graph, "Relu", 1).input[0] = "relu_3"


def _no_pixels(graph: Any) -> None:
    graph.input[0].type.tensor_type.shape.dim[2].dim_param = "rows"


def _scale(graph: Any) -> None:
    replace_constants(graph, conv2d_1_scale=np.array(-0.01, np.float32))


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (_operator, "operator Tanh"),
        (_padding, r"Conv .* has pads \[1, 1, 1, 1\]"),
        (_pooling, r"MaxPool .* has kernel_shape \[3, 3\]"),
        (_pooling_one_by_one, "MaxPool .* follows first.weight"),
        (_not_transposed, "dense.1.weight does not fit"),
        (_no_weights, "Gemm .* has 0 constants"),
        (_weights_zero_point, "third.weight_quantized has a zero point"),
        (_bias_scale, "second.bias_quantized is not quantized as the sums"),
        (_branch, "Relu .* takes more than what the one before puts out"),
        (_no_pixels, "no fixed size"),
        (_scale, "has the scale -0.0"),
    ],
)
def test_a_graph_of_another_kind_is_refused(spoil: Callable[[Any], None], cause: str) -> None:
    with pytest.raises(ModelError, match=cause):
        c_source(changed(spoil), INT8.name)


def test_a_network_in_float_is_refused(tmp_path: Path) -> None:
    fp32 = BUILT_IN.with_name("feed_drive_fp32.onnx")
    with pytest.raises(ModelError, match=r"second\.weight is a convolution of several"):
        c_source(fp32.read_bytes(), fp32.name)
    with pytest.raises(ModelError, match=r"feed_drive_fp32\.onnx: is not an int8 network"):
        export_c(tmp_path / "out", fp32)
    assert not (tmp_path / "out").exists()


# ---- limits


def test_it_leaves_room_on_a_small_microcontroller(source: CSource) -> None:
    assert source.sizes.constants_bytes <= 400 * 1024
    assert source.sizes.memory_bytes + source.sizes.image_bytes <= 100_000


def test_a_network_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def more_units(graph: Any) -> None:
        weights = np.ones((120, 3610), np.int8)
        replace_constants(
            graph,
            dense_0_weight_quantized=weights,
            dense_0_weight_scale=np.full(120, 1e-4, np.float32),
            dense_0_weight_zero_point=np.zeros(120, np.int8),
            dense_1_weight=np.ones((100, 120), np.float32),
        )

    with pytest.raises(ModelError, match=r"takes 4\d{5} bytes of constants \(limit 425984\)"):
        c_source(changed(more_units), INT8.name)
    monkeypatch.setattr(c_source_module, "MEMORY_LIMIT_BYTES", 50_000)
    with pytest.raises(ModelError, match=r"bytes of memory \(limit 50000\)"):
        c_source(INT8.read_bytes(), INT8.name)


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
