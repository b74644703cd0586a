"""`Shown`: what every result can do to be seen. The drawing itself lies layers above and is found by name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from swashplate.atomic import write_json
from swashplate.public import resolve

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Saved:
    """A result that can be kept as a file."""

    def to_document(self) -> Any:
        """All of it as what becomes JSON."""
        return resolve("encode")(self)

    def save(self, path: str | Path, /) -> Path | tuple[Path, ...]:
        """Write its numbers as a JSON file; what has a file of its own kind (a controller, a flight) says so there."""
        return write_json(path, self.to_document())


class Shown(Saved):
    """A result that plots itself, can be explored, and shows itself in a notebook."""

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that `plot` and `explore` can draw, the main one first."""
        names: tuple[str, ...] = resolve("figure_names")(self)
        return names

    def plot(
        self,
        figure: str | None = None,
        *,
        theme: Literal["paper", "light", "dark"] = "paper",
        frequency: Literal["Hz", "rad/s"] = "Hz",
        **choice: Any,
    ) -> Figure:
        """One figure as a matplotlib figure; `savefig` writes it as PDF, SVG or PNG.

        Args:
            figure: its name (see `figures`); the main one where None.
            theme: "paper" (for print: small type, no title), "light" or "dark".
            frequency: unit of axes of frequency.
            choice: `channels` of a flight (a panel each; the usual groups if not given), `pairs` (output, input) of
                responses (all that answer coherently if not given), `row` of derivatives (X, Y, Z, L, M or N).

        Raises:
            SwashError: a figure, a theme or a unit that there is not; matplotlib missing.
        """
        drawn: Figure = resolve("plot")(self, figure, theme=theme, frequency=frequency, **choice)
        return drawn

    def explore(
        self,
        figure: str | None = None,
        *,
        theme: Literal["paper", "light", "dark"] = "light",
        frequency: Literal["Hz", "rad/s"] = "Hz",
        **choice: Any,
    ) -> Any:
        """One figure as a `plotly.graph_objects.Figure`, to zoom and point at; arguments and errors as of `plot`."""
        return resolve("explore")(self, figure, theme=theme, frequency=frequency, **choice)

    def report(self, path: str | Path, *, title: str | None = None) -> Path:
        """A page about it: see `swashplate.report`."""
        written: Path = resolve("report")(self, path=path, title=title)
        return written

    def _repr_html_(self) -> str:
        page: str = resolve("html_of")(self)
        return page
