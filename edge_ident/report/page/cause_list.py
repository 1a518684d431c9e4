"""Causes of an axis as a ranked list with bars, with what speaks for and against each."""

from dataclasses import dataclass, field

from markupsafe import Markup

from edge_ident.diagnosis.measures import SpectralLine
from edge_ident.diagnosis.present import wording as terms
from edge_ident.diagnosis.result import AxisDiagnosis, Cause
from edge_ident.model.effects import named
from edge_ident.report.page.wording import digits, effort_word, sentence, unit_text
from edge_ident.support.words import spoken


@dataclass(frozen=True)
class Bar:
    """One line of the ranking.

    Attributes
    ----------
    kind : str
        Class of the style sheet: supported, suspected, minor or rest.
    title, term : str
        Everyday words, and the field's term.
    share : str
        Of the effort.
    bar : Markup
        The picture.
    facts : list of str
        Sentences below it.
    tests : list of str
        Why it was accepted, and what other effects do in its place; folded away.
    """

    kind: str
    title: str
    term: str
    share: str
    bar: Markup
    facts: list[str] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)


def cause_bars(axis: AxisDiagnosis) -> list[Bar]:
    """Supported causes, strongest first, then suspected and minor ones, and what is left."""
    groups = (("supported", axis.causes), ("suspected", axis.suspected), ("minor", axis.minor))
    shares = [cause.share for _, causes in groups for cause in causes]
    longest = max([*shares, axis.extended.fitted]) or 1.0
    bars = [_bar(kind, cause, axis, longest) for kind, causes in groups for cause in causes]
    rest = axis.extended.fitted
    noise = f"noise alone would leave {digits(100 * axis.noise_floor, 2)} %"
    return [
        *bars,
        Bar(
            "rest",
            "What is left over",
            noise,
            _share(rest, axis),
            _picture("rest", rest, longest, f"Left over: {_share(rest, axis)}; {noise}."),
        ),
    ]


def _bar(kind: str, cause: Cause, axis: AxisDiagnosis, longest: float) -> Bar:
    share, term = _share(cause.share, axis), spoken(cause.term.effect)
    facts = [sentence(cause.evidence)] if cause.evidence else []
    if kind == "supported":
        gain, interval = terms.gain(cause)
        facts.append(
            f"On kept-back parts it takes away {gain} of the error (95 % interval: {interval})."
        )
    else:
        facts.append(f"{kind.capitalize()}: {cause.decision}.")
    if shown_in := terms.recordings_of(cause, axis):
        facts.append(f"Seen in {shown_in}.")
    values = ", ".join(map(unit_text, terms.values(cause.term, axis.model)))
    return Bar(
        kind,
        sentence(named(cause.term.effect).advice.in_words).removesuffix("."),
        term,
        share,
        _picture(kind, cause.share, longest, f"{term}: {share}."),
        [*facts, f"Values ± one standard deviation: {values}." if values else ""],
        [
            *([sentence(f"accepted: {cause.decision}")] if kind == "supported" else []),
            *(sentence(terms.alternative_sentence(other)) for other in cause.alternatives),
        ],
    )


def other_remarks(axis: AxisDiagnosis) -> list[str]:
    """Effects that were tried and refused, external vibrations, and lines above the band."""
    said = [sentence(terms.refused_sentence(refused)) for refused in axis.refused]
    unit = unit_text(axis.model.effort_unit)
    said += [
        f"A vibration from outside acts on the axis: {one}. It is no property of the machine."
        for one in map(unit_text, terms.spoken_vibrations(axis))
    ]
    said += [
        f"Above the compared band, nothing explains {digits(line.amplitude, 3)} {unit} at "
        f"{_place(line)}."
        for line in axis.lines
    ]
    return said + _finding_sentences(axis)


def _place(line: SpectralLine) -> str:
    """Order or frequency of a line."""
    if line.order is not None:
        return f"order {digits(line.order, 4)} (repetitions per turn, or per metre)"
    if line.frequency_range_hz is not None:
        lowest, highest = line.frequency_range_hz
        return f"a frequency that moves between {digits(lowest, 3)} and {digits(highest, 3)} Hz"
    return f"{digits(line.frequency_hz or 0.0, 4)} Hz"


def _finding_sentences(axis: AxisDiagnosis) -> list[str]:
    return [f"{sentence(f.message)} Next: {f.next_step}." for f in axis.findings]


def _share(share: float, axis: AxisDiagnosis) -> str:
    return f"{digits(100 * share, 2)} % of the {effort_word(axis.model.effort_unit)}"


def _picture(kind: str, share: float, longest: float, title: str) -> Markup:
    return Markup(
        '<svg class="bar" role="img" height="14" width="100%"><title>{}</title>'
        '<line class="{}" x2="{:.2f}%" y1="7" y2="7"/></svg>'
    ).format(title, kind, max(0.3, 100.0 * share / longest))
