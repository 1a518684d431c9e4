"""Compiles networks in C, with the programs that run them."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import pytest
from numpy.typing import NDArray

from edge_ident.estimation.manifest import BUILT_IN
from export.c_source.source import CSource

Images = NDArray[np.float32]

PROGRAMS: Final = Path(__file__).with_name("c_programs")
INT8: Final = BUILT_IN.with_name("feed_drive_int8.onnx")
STRICT: Final = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")


def needs(*programs: str) -> pytest.MarkDecorator:
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(bool(missing), reason=f"needs {', '.join(missing)}")


def write(source: CSource, folder: Path, images: Images | None = None) -> None:
    """The source, and the header by which the programs know it."""
    for name, text in source.files.items():
        (folder / name).write_text(text)
    lines = [
        f'#include "{source.name}.h"',
        f'#define SOURCE "{source.name}.c"',
        f"#define RUN {source.name}_run",
        f"#define MEMORY {source.name}_memory",
        f"#define PIXELS {source.name.upper()}_PIXELS",
        f"#define MEMORY_BYTES {source.sizes.memory_bytes}",
    ]
    if images is not None:
        rows = [
            "{" + ",".join(f"{value.hex()}f" for value in i.ravel().tolist()) + "}" for i in images
        ]
        lines.append(f"#define IMAGES {len(images)}u")
        lines.append(f"static const float images[][PIXELS] = {{{','.join(rows)}}};")
    (folder / "network.h").write_text("\n".join(lines) + "\n")


def built(folder: Path, source: CSource, program: str, compiler: str, *options: str) -> Path:
    """The network with one of the programs, for a computer; arithmetic.c includes the network."""
    target = folder / "program"
    network = () if program == "arithmetic.c" else (folder / f"{source.name}.c",)
    command = [compiler, *options, "-I", folder, "-o", target, *network, PROGRAMS / program]
    subprocess.run(list(map(str, command)), check=True)
    return target


def changed(change: Callable[[Any], None]) -> bytes:
    """The network of the package with another graph."""
    model = onnx.load(INT8)
    change(model.graph)
    return bytes(model.SerializeToString())


def replace_constants(graph: Any, **values: Any) -> None:
    """Other numbers; dots of their names are underscores here."""
    for item in graph.initializer:
        name = item.name.replace(".", "_")
        if name in values:
            item.CopyFrom(onnx.numpy_helper.from_array(values[name], item.name))
