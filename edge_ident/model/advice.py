"""What an effect means to the person at the machine, in everyday words."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Advice:
    """Where an effect comes from on a machine, and what to do about it.

    Attributes
    ----------
    in_words : str
        What happens, as a person at the machine would say it; a part of a sentence.
    part : str
        The part of the machine to look at; a part of a sentence.
    action : str
        What to do next, with or without a board; whole sentences.
    size : str
        How large it is, over names of parameters in braces; a part of a sentence. Without it, its
        share of the effort says that.

    Examples
    --------
    >>> import edge_ident
    >>> edge_ident.Advice("drag fades with speed", "magnets near the axis", "Move them.").part
    'magnets near the axis'
    """

    in_words: str = ""
    part: str = ""
    action: str = ""
    size: str = ""
