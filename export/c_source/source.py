"""A network in C: its files, and whether it fits the chip."""

import hashlib
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from edge_ident.errors import ModelError
from edge_ident.estimation.manifest import BUILT_IN, read_content
from edge_ident.estimation.network import load_network
from edge_ident.support.documents import atomic_write
from export.c_source.graph import NEXT_STEP
from export.c_source.identification import FILE, identification_header
from export.c_source.layout import lay_out
from export.c_source.reading import read_layers
from export.c_source.rendering import Sizes, render, sizes_of

MEMORY_LIMIT_BYTES: Final = 100_000
"""Limit of working memory, the image included: leaves the program a quarter of 128 KiB."""
CONSTANTS_LIMIT_BYTES: Final = 416 * 1024
"""Room for every network of the shape that is trained here (up to 411 kB), in 512 KiB of flash."""


@dataclass(frozen=True)
class CSource:
    """A network in C.

    Attributes
    ----------
    name : str
        Of the files, and the beginning of all names in the header.
    sha256 : str
        Of the ONNX network.
    sizes : Sizes
    files : mapping of file name to text
    """

    name: str
    sha256: str
    sizes: Sizes
    files: dict[str, str]


def export_c(folder: Path, network: Path | None = None) -> CSource:
    """Write NAME.h, NAME.c and NAME_weights.h, with the name of the network's file.

    Beside them identification_network.h, by which the reference firmware knows the network, where
    a board can identify with it.

    Parameters
    ----------
    folder : Path
    network : Path, optional
        `NAME_int8.onnx` with its manifest beside it; default: the network of the package.

    Raises
    ------
    ModelError
        The network fails its checks, is no int8 network of edge-ident, or is too large.
    """
    path = network or BUILT_IN.with_name(f"{BUILT_IN.stem}_int8.onnx")
    loaded = load_network(path=path)
    if loaded.variant != "int8":
        raise ModelError(f"{path}: is not an int8 network", NEXT_STEP)
    source = c_source(read_content(path), path.name)
    header = identification_header(loaded.manifest, source.name, path.name)
    if header is not None:
        source = replace(source, files=source.files | {FILE: header})
    for name, text in source.files.items():
        with atomic_write(folder / name) as partial:
            partial.write_text(text, encoding="ascii", newline="\n")
    return source


def c_source(content: bytes, file: str) -> CSource:
    """A network in C; the same bytes give the same text.

    Parameters
    ----------
    content : bytes
        Of the ONNX network.
    file : str
        Its name, which the header states.

    Raises
    ------
    ModelError
        If it is no int8 network of edge-ident, or too large.
    """
    layers = lay_out(read_layers(content))
    sizes = sizes_of(layers)
    _require(sizes.constants_bytes, CONSTANTS_LIMIT_BYTES, "constants")
    _require(sizes.memory_bytes + sizes.image_bytes, MEMORY_LIMIT_BYTES, "memory")
    name = re.sub(r"\W", "_", Path(file).stem, flags=re.ASCII)
    name = f"network_{name}" if name[:1].isdigit() else name
    digest = hashlib.sha256(content).hexdigest()
    shown = file.encode("ascii", "backslashreplace").decode()
    return CSource(name, digest, sizes, render(layers, name, shown, digest))


def _require(size_bytes: int, limit_bytes: int, what: str) -> None:
    if size_bytes > limit_bytes:
        raise ModelError(
            f"the network takes {size_bytes} bytes of {what} (limit {limit_bytes})",
            "give a network of the size that edge-ident train makes",
        )
