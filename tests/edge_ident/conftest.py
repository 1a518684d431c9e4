"""Effects that a test registers are gone when it ends."""

from collections.abc import Iterator

import pytest

from edge_ident.model import effects


@pytest.fixture
def registry() -> Iterator[None]:
    yield
    effects._registered.clear()
    effects.catalogue.cache_clear()
