"""Training runs by name."""

import pytest

from edge_ident.errors import ModelError
from export.configuration import CONFIGURATIONS, IMPROVED, PAPER, configuration


def test_configurations_are_found_by_name() -> None:
    assert configuration("paper") is PAPER
    assert configuration("improved") is IMPROVED
    with pytest.raises(ModelError, match="no training configuration"):
        configuration("other")
    assert all(name == entry.name for name, entry in CONFIGURATIONS.items())
