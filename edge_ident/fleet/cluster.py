"""Recordings on a Dask cluster.

The content of a recording travels with its task, so the computers of the cluster need no common
folder. Where a worker is lost, the cluster's scheduler gives its task to another.
"""

import uuid
import warnings
from collections.abc import Iterable
from itertools import islice
from typing import Any, Final

from edge_ident.errors import DataError, LinkError
from edge_ident.fleet.analysis import analyse_content
from edge_ident.fleet.tasks import Outcomes, Task, ended
from edge_ident.support.version import VERSION

PATIENCE_S: Final = 20
"""Time for the scheduler to answer, and for a first worker to appear."""
_IN_HAND: Final = 2
"""Tasks for each thread of the cluster: one runs while the next is on its way."""


def run_on_cluster(tasks: Iterable[Task], address: str) -> Outcomes:
    """Do tasks on a cluster.

    Parameters
    ----------
    tasks : iterable of Task
    address : str
        Of the scheduler: `tcp://HOST:PORT`.

    Yields
    ------
    Outcome
        In the order in which they end.

    Raises
    ------
    DataError
        Dask is not installed here, or the cluster has another edge-ident.
    LinkError
        There is no cluster at that address, or it has no worker.
    """
    distributed = _dask()
    client = _connected(distributed, address)
    given: dict[Any, Task] = {}
    try:
        _check_version(client)
        waiting = iter(tasks)
        count = _IN_HAND * max(1, sum(client.nthreads().values()))
        for task in islice(waiting, count):
            given[_submit(client, task)] = task
        ready = distributed.as_completed(list(given), loop=client.loop)
        for future in ready:
            task = given.pop(future)
            following = next(waiting, None)
            if following is not None:
                begun = _submit(client, following)
                given[begun] = following
                ready.add(begun)
            yield task, _document(future, distributed)
    finally:
        client.cancel(list(given), force=True)
        client.close()


def installed() -> str:
    """Version of edge-ident, here or wherever it is asked."""
    return VERSION


def _submit(client: Any, task: Task) -> Any:
    content = task.found.path.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a recording is large, and is sent once
        return client.submit(
            analyse_content, task.found.name, content, task.options,
            key=f"edge-ident-{task.key}-{uuid.uuid4().hex}", pure=False,
        )  # fmt: skip


def _document(future: Any, distributed: Any) -> dict[str, Any]:
    try:
        document: dict[str, Any] = future.result()
    except distributed.scheduler.KilledWorker:
        return ended("workers of the cluster died of it")
    except Exception as error:  # of the cluster: that of a recording is in its document
        return ended(f"{type(error).__name__}: {error}")
    return document


def _dask() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise DataError(
            "a survey on a cluster needs Dask, which is not installed",
            "pip install 'edge-ident[cluster]'",
        ) from error
    return distributed


def _connected(distributed: Any, address: str) -> Any:
    next_step = "start one with: dask scheduler; and on each computer: dask worker ADDRESS"
    try:
        client = distributed.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise LinkError(f"no Dask cluster answers at {address}", next_step) from error
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError as error:
        client.close()
        raise LinkError(f"the cluster at {address} has no worker", next_step) from error
    return client


def _check_version(client: Any) -> None:
    here = installed()
    try:
        there = client.submit(installed, pure=False).result(timeout=PATIENCE_S)
    except Exception as error:
        there = f"none ({type(error).__name__})"
    if there != here:
        raise DataError(
            f"the workers of the cluster have another edge-ident: {there}, here {here}",
            f"install it on each: pip install 'edge-ident[files]=={here}'",
        )
