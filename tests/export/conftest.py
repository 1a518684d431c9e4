"""What makes tests of training fast."""

import pytest

from edge_ident.model.effects import catalogue
from export import recordings


@pytest.fixture
def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """A catalogue of two effects that are quick to compute."""
    two = {name: catalogue()[name] for name in ("offset_drift", "torque_ripple")}
    monkeypatch.setattr(recordings, "catalogue", lambda: two)
