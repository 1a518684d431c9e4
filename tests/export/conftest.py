"""What makes tests of training fast."""

import pytest

from edge_ident.model.effects import catalogue
from export import recordings


@pytest.fixture(autouse=True)
def threads_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """No measurement: how many threads add up a sum changes its last digits."""
    monkeypatch.setenv("OMP_NUM_THREADS", "1")


@pytest.fixture
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """A catalogue of two effects that are quick to compute."""
    two = {name: catalogue()[name] for name in ("offset_drift", "torque_ripple")}
    monkeypatch.setattr(recordings, "catalogue", lambda: two)
