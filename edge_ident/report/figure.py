"""Empty figures; matplotlib is loaded for the first one."""

from typing import TYPE_CHECKING

from edge_ident.errors import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def new_figure(width_in: float, height_in: float) -> "Figure":
    """Make an empty figure that belongs to no window; a notebook shows it as it is.

    Raises
    ------
    DataError
        matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DataError(
            "drawing needs matplotlib", "install it with: pip install 'edge-ident[report]'"
        ) from error

    class ShownFigure(Figure):
        def _repr_png_(self) -> bytes:
            from io import BytesIO

            content = BytesIO()
            self.savefig(content, format="png")
            return content.getvalue()

    return ShownFigure(figsize=(width_in, height_in), layout="constrained")
