"""What a program gives as an argument."""

from numbers import Integral, Real
from os import PathLike
from pathlib import Path

from edge_ident.errors import DataError


def number(name: str, value: object, low: float, high: float, next_step: str) -> None:
    """Check that an argument is a number inside a range, both ends allowed.

    Raises
    ------
    DataError
        It is none, or outside.
    """
    if not isinstance(value, Real) or not low <= float(value) <= high:
        raise DataError(f"{name} is {value!r}", next_step)


def seed(value: object) -> None:
    """Check that an argument is a seed of random numbers.

    Raises
    ------
    DataError
        It is no whole number, or below zero.
    """
    if not isinstance(value, Integral) or int(value) < 0:
        raise DataError(f"seed is {value!r}", "give a whole number from 0 on")


def type_of(given: object) -> str:
    """What a thing is, with its article."""
    if given is None:
        return "None"
    name = type(given).__name__
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def path(given: object, of: str) -> Path:
    """The path that is given, of a thing in words.

    Raises
    ------
    DataError
        It is no path.
    """
    if not isinstance(given, str | PathLike):
        raise DataError(f"{type_of(given)} is no path", f"give that of {of}")
    return Path(given)


def check_type(given: object, wanted: type | tuple[type, ...], next_step: str) -> None:
    """Check that an argument is of a type.

    Raises
    ------
    DataError
        It is of another one.
    """
    if not isinstance(given, wanted):
        names = wanted if isinstance(wanted, tuple) else (wanted,)
        said = " or ".join(each.__name__ for each in names)
        raise DataError(f"{type_of(given)} is no {said}", next_step)
