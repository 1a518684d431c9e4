"""The trained network at run time: hash and sessions."""

import hashlib
import json
import os
import platform
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from edge_ident.errors import ModelError
from edge_ident.estimation.image import effort_image
from edge_ident.estimation.manifest import (
    BUILT_IN,
    GRAPHS,
    VARIANTS,
    Graph,
    Manifest,
    Variant,
    load_manifest,
    read_content,
)
from edge_ident.estimation.rank_one import RankOneGraph, divided, open_session
from edge_ident.signals.metrics import POINTS, Array
from edge_ident.support.documents import atomic_write, read_json
from edge_ident.support.given import type_of

Precision = Variant | Literal["fastest"]

_IMAGE_SHAPE: Final = (1, POINTS, POINTS)
# What ways to run a network are timed with.
_EFFORTS: Final = np.sin(np.linspace(0.0, 7.0, 2 * POINTS)).reshape(2, 1, POINTS)
# Distance that outputs keep from 0 and 1, where the inverse sigmoid has no value.
_OUTPUT_MARGIN: Final = 1e-6


class Network:
    """A network that is ready to run.

    Parameters
    ----------
    read : callable
        Gives the bytes of its ONNX file. They are not kept: its session has all that it needs.

    Attributes
    ----------
    manifest : Manifest
    variant : {"fp32", "int8"}
    graph : {"rank_one", "image"}
        Whether it reads efforts or their image; both give the same answers, to rounding.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.load_network().manifest.motion.effort_unit
    'N*m'
    """

    graph: Graph = "image"

    def __init__(
        self,
        read: Callable[[], bytes],
        manifest: Manifest,
        variant: Variant,
        graph: Graph = "image",
    ) -> None:
        self.manifest = manifest
        self.variant = variant
        self.graph = graph
        self._read = read
        self.residuals_of(np.zeros((1, POINTS)), np.zeros((1, POINTS)))  # warm up

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of its file."""
        return hashlib.sha256(self._read()).hexdigest()

    def unload(self) -> None:
        """Give back the memory that it runs in; the next question loads it again."""
        for session in ("_rank_one", "_session"):
            vars(self).pop(session, None)

    def residuals_of(self, model_effort: Array, measured_effort: Array) -> Array:
        """Guess minus truth, in shares, from the efforts that an image is made of.

        Parameters
        ----------
        model_effort : (n, 100) array
            Effort of the model at each of n guesses, over the measurement's scale.
        measured_effort : (100,), (1, 100) or (n, 100) array
            Measured effort over its own scale.

        Returns
        -------
        (n, 4) array
        """
        normalization = self.manifest.normalization
        if self.graph == "image":
            return self.residual_shares(effort_image(model_effort, measured_effort, normalization))
        measured = np.atleast_2d(measured_effort)
        return _shares(self._rank_one.run(model_effort, measured, normalization))

    def residual_shares(self, images: NDArray[np.float32]) -> Array:
        """Guess minus truth, in shares, from images.

        Parameters
        ----------
        images : (n, 1, 100, 100) float32 array
            From `edge_ident.estimation.image.effort_image`.

        Returns
        -------
        (n, 4) array
        """
        (outputs,) = self._session.run(None, {self._session.get_inputs()[0].name: images})
        return _shares(outputs)

    @cached_property
    def _session(self) -> onnxruntime.InferenceSession:
        return open_session(self._read(), _IMAGE_SHAPE)

    @cached_property
    def _rank_one(self) -> RankOneGraph:
        parts = divided(self._read())
        if parts is None:
            raise ModelError(
                "the network does not begin with a convolution of the image", "load it for images"
            )
        return RankOneGraph(*parts)


def _shares(outputs: NDArray[np.float32]) -> Array:
    """Residuals before the sigmoid."""
    clipped = np.clip(outputs.astype(np.float64), _OUTPUT_MARGIN, 1.0 - _OUTPUT_MARGIN)
    return np.asarray(np.log(clipped / (1.0 - clipped)))


def given_network(network: "Network | str | PathLike[str]") -> Network:
    """The network that a caller gives: a network, or the path of its ONNX file.

    Raises
    ------
    ModelError
        As of `load_network`; it is neither.
    """
    if isinstance(network, str | PathLike):
        return load_network(path=Path(network))
    if hasattr(network, "manifest"):
        return network
    raise ModelError(
        f"{type_of(network)} is no network",
        "give what load_network returned, the path of an ONNX file, or nothing",
    )


def load_network(variant: Precision = "fp32", path: str | Path | None = None) -> Network:
    """Load the network of the package, or another one with its manifest beside it.

    Every network can run in two ways, from the image or from its factors. The first time that a
    machine loads a network, it measures which is faster, and remembers that
    (`edge_ident.estimation.network`).

    Parameters
    ----------
    variant : {"fp32", "int8", "fastest"}
        Of the package's network; a path names its own. The fastest is fp32, unless int8 takes this
        machine at most four fifths of the time.
    path : str or Path, optional
        `NAME_fp32.onnx` or `NAME_int8.onnx`, with `NAME.json` in the same folder.

    Returns
    -------
    Network

    Raises
    ------
    ModelError
        If a file is missing or malformed, the network fails its hash, or it does not take a
        100x100 image to four outputs.

    Examples
    --------
    >>> import edge_ident
    >>> network = edge_ident.load_network()
    >>> found = edge_ident.identify(edge_ident.simulate(), network)
    >>> found.axes["x"].network is not None
    True
    """
    if path is not None:
        path = Path(path)
        variants: tuple[Variant, ...] = (_variant_of(path),)
        folder, name = path.parent, path.stem.removesuffix(f"_{variants[0]}")
    elif variant not in (*VARIANTS, "fastest"):
        raise ModelError(
            f"there is no variant {variant} of the package's network",
            f"give {', '.join(VARIANTS)} or fastest, or a file: load_network(path=...)",
        )
    else:
        variants = VARIANTS if variant == "fastest" else (variant,)
        folder, name = BUILT_IN.parent, BUILT_IN.stem
    manifest_path = folder / f"{name}.json"
    manifest = load_manifest(manifest_path)
    files = {
        of: partial(_checked, folder / f"{name}_{of}.onnx", manifest_path, manifest, of)
        for of in variants
    }

    def passes() -> dict[Way, Callable[[], object]]:
        networks = {
            (of, graph): Network(read, manifest, of, graph)
            for of, read in files.items()
            for graph in (GRAPHS if divided(read()) else GRAPHS[1:])
        }
        return {way: partial(one.residuals_of, *_EFFORTS) for way, one in networks.items()}

    hashes = {of: manifest.sha256.get(of, "") for of in variants}
    chosen, graph = fastest(times_of(hashes, passes))
    return Network(files[chosen], manifest, chosen, graph)


def _checked(path: Path, manifest_path: Path, manifest: Manifest, variant: Variant) -> bytes:
    """The bytes of a network's file, if it is the one that the manifest describes."""
    content = read_content(path)
    if hashlib.sha256(content).hexdigest() != manifest.sha256.get(variant):
        raise ModelError(
            f"{path}: has the wrong hash: it is not the file that {manifest_path.name} describes",
            "copy network and manifest again, both from the same export",
        )
    return content


def _variant_of(path: Path) -> Variant:
    for variant in VARIANTS:
        if path.stem.endswith(f"_{variant}"):
            return variant
    raise ModelError(
        f"{path}: the name does not contain the variant", "call it NAME_fp32 or NAME_int8"
    )


# How long the ways to run a network take on this machine: measured once, and remembered.
#
# What is faster depends on the processor and on onnxruntime. So each machine measures a network
# when it first loads it, and writes the times to a file of its user: `network_times.json` in the
# folder `edge-ident` of `XDG_CACHE_HOME`, by default `~/.cache`. Removing the file makes it measure
# again. Where it cannot be written, every process measures for itself.

Way = tuple[Variant, Graph]
"""A way to run a network."""

WORTH: Final = 0.8
"""Another way has to take at most this part of the time of one that stands before it: smaller
differences come and go with what else the machine does."""
_SCHEMA: Final = "edge-ident/network-times/1"
# Passes of each way in turn; the fastest counts: other programs only slow a pass down.
_ROUNDS: Final = 12
_WARM: Final = 2  # passes before each round, so that a network finds its own weights in the cache


def fastest(times: Mapping[Way, float]) -> Way:
    """The first of them, unless a later one is clearly faster."""
    ways = iter(times)
    chosen = next(ways)
    for way in ways:
        if times[way] <= WORTH * times[chosen]:
            chosen = way
    return chosen


def times_of(
    files: Mapping[Variant, str], passes: Callable[[], Mapping[Way, Callable[[], object]]]
) -> Mapping[Way, float]:
    """Time of a pass by each way, ms, in the order in which `passes` gives them.

    Only times that were measured together are compared: a machine has busy moments.

    Parameters
    ----------
    files : mapping of variant to str
        SHA-256 of the network's files.
    passes : callable
        Gets all ways ready and returns what makes a pass of each; called where nothing is
        remembered.
    """
    path, machine, name = _file(), _machine(), " ".join(files.values())
    known = _read(path)
    networks = known.get(machine, {})
    if found := _valid(networks.get(name), tuple(files)):
        return found
    times = _measured(passes())
    written = [[*way, spent_ms] for way, spent_ms in times.items()]
    document = {"schema": _SCHEMA, "machines": {**known, machine: {**networks, name: written}}}
    with suppress(OSError), atomic_write(path) as partial:  # else the next process measures again
        partial.write_text(json.dumps(document, indent=1), encoding="utf-8")
    return times


def _valid(written: Any, variants: tuple[Variant, ...]) -> dict[Way, float]:
    """Times as they were written; none where somebody changed them."""
    try:
        found = {(variant, graph): spent_ms for variant, graph, spent_ms in written}
    except (TypeError, ValueError):
        return {}
    right = all(
        variant in variants and graph in GRAPHS and isinstance(spent_ms, float) and spent_ms > 0.0
        for (variant, graph), spent_ms in found.items()
    )
    return found if right else {}


def _measured(passes: Mapping[Way, Callable[[], object]]) -> dict[Way, float]:
    spent_s: dict[Way, list[float]] = {way: [] for way in passes}
    for _ in range(_ROUNDS):
        for way, make_pass in passes.items():
            for _ in range(_WARM):
                make_pass()
            began_s = time.perf_counter()
            make_pass()
            spent_s[way].append(time.perf_counter() - began_s)
    return {way: 1e3 * min(spent) for way, spent in spent_s.items()}


def _read(path: Path) -> dict[str, dict[str, Any]]:
    """What is remembered, by machine; nothing where the file is missing or of another kind."""
    try:
        document = read_json(path)
        machines = document["machines"] if document["schema"] == _SCHEMA else {}
        return {str(name): dict(networks) for name, networks in machines.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _file() -> Path:
    folder = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(folder) / "edge-ident" / "network_times.json"


def _machine() -> str:
    """What the times belong to; a home folder may be shared among machines."""
    return f"{platform.node()}, {platform.machine()}, onnxruntime {onnxruntime.__version__}"
