"""Where a training run computes: a device that works, and as many threads as are fast."""

import pytest

pytest.importorskip("torch")

import torch

from edge_ident.errors import ModelError
from export import processor


@pytest.mark.parametrize("name", ["cuda:99", "warp-drive"])
def test_a_device_that_torch_cannot_use_is_refused(name: str) -> None:
    with pytest.raises(ModelError, match=f"--accelerator {name}: torch cannot use") as caught:
        processor.checked_device(name)
    assert "--accelerator cpu" in caught.value.next_step
    assert caught.value.exit_code == 5


def test_the_processor_can_be_used() -> None:
    assert processor.checked_device("cpu") == "cpu"
    assert processor.checked_device(None) in ("cpu", "cuda")


@pytest.mark.parametrize(
    ("times_s", "wanted"),
    [
        ({1: 1.0, 2: 4.0, 4: 8.0, 8: 8.0}, 1),  # a shared machine
        ({1: 1.0, 2: 0.55, 4: 0.3, 8: 0.28}, 4),  # the last is not worth its cores
        ({1: 1.0, 2: 0.9, 4: 0.85, 8: 0.82}, 1),
    ],
)
def test_more_threads_have_to_be_clearly_faster(
    times_s: dict[int, float], wanted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS")
    monkeypatch.setattr(processor, "_step_s", times_s.__getitem__)
    monkeypatch.setattr(processor.os, "sched_getaffinity", lambda _: range(8), raising=False)
    before = torch.get_num_threads()
    try:
        assert processor.set_fastest_threads() == wanted
        assert torch.get_num_threads() == wanted
    finally:
        torch.set_num_threads(before)


def test_a_number_that_the_user_gives_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    monkeypatch.setattr(processor, "_step_s", lambda _: pytest.fail("measured"))
    assert processor.set_fastest_threads() == torch.get_num_threads()


def test_a_step_is_measured_without_touching_the_random_numbers_of_the_run() -> None:
    before, threads = torch.random.get_rng_state(), torch.get_num_threads()
    assert processor._step_s(1) > 0.0
    torch.set_num_threads(threads)
    assert torch.equal(before, torch.random.get_rng_state())
