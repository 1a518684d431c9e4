"""The text of a network in C, from the templates."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from edge_ident.model.model import PARAMETERS
from edge_ident.support.version import VERSION
from export.c_source.arrays import literal
from export.c_source.layout import SourceLayer

# Pixels of real images are below ten; sums of larger ones could overflow.
_LARGEST_PIXEL: Final = "1e20"
_BYTES: Final = {"float": 4, "int8_t": 1}
_TEMPLATES: Final = {
    "{name}.h": "network.h.jinja",
    "{name}.c": "network.c.jinja",
    "{name}_weights.h": "weights.h.jinja",
}


@dataclass(frozen=True)
class Sizes:
    """What a network in C takes of the chip, the code aside.

    Attributes
    ----------
    constants_bytes : int
        Weights and other constant arrays.
    memory_bytes : int
        The struct that holds what the layers put out.
    image_bytes : int
    """

    constants_bytes: int
    memory_bytes: int
    image_bytes: int


@dataclass(frozen=True)
class _Field:
    """An array of the memory: what a layer puts out, or its input in another form."""

    kind: str
    name: str
    size: int


def sizes_of(layers: Sequence[SourceLayer]) -> Sizes:
    """The sizes of a network."""
    memory = sum(_BYTES[field.kind] * field.size for field in _memory(layers))
    alignment = _BYTES["float"]
    return Sizes(
        constants_bytes=sum(layer.constants_bytes for layer in layers),
        memory_bytes=-(-memory // alignment) * alignment,
        image_bytes=math.prod(layers[0].layer.input_shape) * _BYTES["float"],
    )


def render(layers: Sequence[SourceLayer], name: str, file: str, sha256: str) -> dict[str, str]:
    """The files of a network by their names.

    Parameters
    ----------
    layers : sequence of SourceLayer
    name : str
        A C identifier.
    file, sha256 : str
        Of the ONNX network.
    """
    environment = templates()
    first, last = layers[0].layer, layers[-1].layer
    outputs = last.output_shape[0]
    facts = {
        **asdict(sizes_of(layers)),
        "layers": layers,
        "name": name,
        "file": file,
        "sha256": sha256,
        "version": VERSION,
        "guard": name.upper(),
        "input_shape": first.input_shape,
        "pixels": math.prod(first.input_shape),
        "outputs": outputs,
        "output_names": PARAMETERS if outputs == len(PARAMETERS) else (),
        "largest_pixel": _LARGEST_PIXEL,
        "memory": sorted(_memory(layers), key=lambda field: -_BYTES[field.kind]),
        "calls": list(_calls(layers)),
    }
    return {
        form.format(name=name): environment.get_template(template).render(facts)
        for form, template in _TEMPLATES.items()
    }


def templates() -> Environment:
    """The templates of C."""
    environment = Environment(
        loader=PackageLoader("export.c_source"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
        autoescape=False,  # C, not HTML
    )
    environment.globals["literal"] = literal
    return environment


def _memory(layers: Sequence[SourceLayer]) -> Iterator[_Field]:
    for source in layers:
        yield from _converted(source)
        if source is not layers[-1]:
            kind = "int8_t" if source.layer.output else "float"
            yield _Field(kind, source.name, math.prod(source.layer.output_shape))


def _converted(source: SourceLayer) -> Iterator[_Field]:
    """The input of a dense layer, where it does not take it as it is."""
    used = source.size("inputs_used")
    if used:
        yield _Field("int8_t", f"{source.name}_inputs", used)
    elif not source.layer.integer and source.layer.input:
        yield _Field("float", f"{source.name}_inputs", source.layer.input_shape[0])


def _calls(layers: Sequence[SourceLayer]) -> Iterator[str]:
    """The statements that compute the layers, one after the other."""
    taken = "image"
    for source in layers:
        put_out = "residuals" if source is layers[-1] else f"memory->{source.name}"
        between = [f"memory->{field.name}" for field in _converted(source)]
        yield f"{source.name}({', '.join([taken, *between, put_out])})"
        taken = put_out
