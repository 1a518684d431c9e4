"""What a diagnosis says of an axis in one word."""

from enum import StrEnum


class Verdict(StrEnum):
    """Whether the model of an axis is complete."""

    ADEQUATE = "adequate"
    """The residual of the base model is within the noise floor."""
    EXPLAINED = "explained"
    """The residual of the extended model is within the noise floor."""
    PARTLY_EXPLAINED = "partly_explained"
    """Causes or curves account for a part; the residual of the extended model has structure."""
    UNEXPLAINED = "unexplained"
    """The residual has structure, and nothing is known of it."""

    @property
    def complete(self) -> bool:
        """Whether the model leaves no more than noise."""
        return self in (Verdict.ADEQUATE, Verdict.EXPLAINED)
