"""A number that decides, with its reason."""

from dataclasses import dataclass
from typing import Generic, TypeVar

Number = TypeVar("Number", int, float)


@dataclass(frozen=True)
class Threshold(Generic[Number]):
    """A number that decides.

    Attributes
    ----------
    value : int or float
    unit : str
    meaning : str
        What it decides.
    reason : str
        Why it has this value: a source, or the judgement behind it.
    support : str
        The test or the experiment that supports it.
    """

    value: Number
    unit: str
    meaning: str
    reason: str
    support: str
