"""How long the ways to run a network take on this machine: measured once, and remembered.

What is faster depends on the processor and on onnxruntime. So each machine measures a network when
it first loads it, and writes the times to a file of its user: `network_times.json` in the folder
`edge-ident` of `XDG_CACHE_HOME`, by default `~/.cache`. Removing the file makes it measure again.
Where it cannot be written, every process measures for itself.
"""

import json
import os
import platform
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import onnxruntime

from edge_ident.estimation.manifest import GRAPHS, Graph, Variant
from edge_ident.support.atomic_files import atomic_write
from edge_ident.support.json_text import read_json

Way = tuple[Variant, Graph]
"""A way to run a network."""

WORTH: Final = 0.8
"""Another way has to take at most this part of the time of one that stands before it: smaller
differences come and go with what else the machine does."""
_SCHEMA: Final = "edge-ident/network-times/1"
_ROUNDS: Final = 12
"""Passes of each way in turn; the fastest counts: other programs only slow a pass down."""
_WARM: Final = 2
"""Passes before each round, so that a network finds its own weights in the cache."""


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
