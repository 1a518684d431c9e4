"""What a diagnosis says of an axis in one word."""

from enum import StrEnum


class Verdict(StrEnum):
    """Whether the model of an axis is complete."""

    ADEQUATE = "adequate"
    """The residual of the base model is within the noise floor."""
    EXPLAINED = "explained"
    """The residual of the extended model is within the noise floor."""
    UNEXPLAINED = "unexplained"
    """The residual has structure that no known effect accounts for."""
