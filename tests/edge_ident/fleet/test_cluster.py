"""The same survey on a Dask cluster of processes, and what a lost worker costs: nothing."""

import json
import os
import shutil
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

import edge_ident
from edge_ident.fleet import workers as on_cluster
from tests.processes import running

pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed")


LOCAL_CLUSTER = """
import json, signal, sys
from distributed import LocalCluster

if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        local_directory=sys.argv[1],
    ) as cluster:
        pids = [nanny.pid for nanny in cluster.workers.values()]
        print(json.dumps([cluster.scheduler_address, pids]), flush=True)
        signal.pause()
"""


@dataclass
class Cluster:
    """A cluster of two processes."""

    address: str
    workers: list[int]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    folder = tmp_path_factory.mktemp("dask")
    program = folder / "local_cluster.py"
    program.write_text(LOCAL_CLUSTER, encoding="utf-8")
    with running([sys.executable, str(program), str(folder)], errors=None) as process:
        assert process.stdout is not None
        yield Cluster(*json.loads(process.stdout.readline()))


def test_a_cluster_finds_what_processes_find(
    cluster: Cluster, fleet: Path, surveyed: tuple[edge_ident.Survey, Path]
) -> None:
    there, (here, _) = edge_ident.survey(fleet, cluster=cluster.address), surveyed
    assert there.comparisons == here.comparisons
    assert there.units == here.units
    (broken,) = there.failed
    assert broken.failed is not None
    assert broken.failed.cause.startswith("broken.csv: ")  # not the copy on the other computer


def test_a_worker_that_is_killed_loses_no_recording(
    cluster: Cluster, fleet: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "units"
    shutil.copytree(fleet, folder)
    (folder / "broken.csv").unlink()
    killed: list[int] = []

    def kill_one(found: edge_ident.SurveyedRecording) -> None:
        if not killed:
            killed.append(cluster.workers[0])
            os.kill(cluster.workers[0], signal.SIGKILL)

    found = edge_ident.survey(folder, cluster=cluster.address, on_recording=kill_one)
    assert killed
    assert found.trusted
    assert len(found.units) == 8


def test_results_are_kept_here(cluster: Cluster, fleet: Path, tmp_path: Path) -> None:
    """The workers need no folder in common with the caller."""
    folder, output = tmp_path / "units", tmp_path / "output"
    folder.mkdir()
    shutil.copy(fleet / "unit-02.npz", folder)
    edge_ident.survey(folder, cluster=cluster.address, output=output)
    again: list[str] = []
    edge_ident.survey(
        folder, jobs=1, output=output, on_recording=lambda found: again.append(found.file)
    )
    assert again == []


def test_where_no_cluster_answers_the_next_step_starts_one(
    fleet: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(on_cluster, "PATIENCE_S", 0.5)
    with pytest.raises(edge_ident.LinkError) as refusal:
        edge_ident.survey(fleet, cluster="tcp://127.0.0.1:9")
    assert "dask scheduler" in refusal.value.next_step


def test_a_cluster_without_edge_ident_is_refused(
    cluster: Cluster, fleet: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(on_cluster, "VERSION", "0.0.0")
    with pytest.raises(edge_ident.DataError, match=r"another edge-ident"):
        edge_ident.survey(fleet, cluster=cluster.address)
