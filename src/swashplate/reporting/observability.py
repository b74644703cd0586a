"""What a sensor suite sees, as a page: hidden directions in words, and how well every state is known."""

from __future__ import annotations

from collections.abc import Sequence

from swashplate.control.lqg.observability import Observability, in_words
from swashplate.reporting.structure import Cell, Points, Report, Section, Table, Text
from swashplate.reporting.versions import date, versions


def compose_observability(
    model: str, speeds: Sequence[float], studies: Sequence[Observability], *, title: str | None
) -> Report:
    """The report's structure, a section for each speed [m/s]."""
    hidden = sum(len(one.hidden) for one in studies)
    summary = f"{hidden} directions leave no trace" if hidden else "nothing that lasts stays unseen"
    return Report(
        title=title or f"What sensors see of {model}",
        banners=(),
        summary=(
            ("Sensors", ", ".join(map(str, studies[0].sensors)), "plain"),
            ("Hidden", summary, "caution" if hidden else "good"),
        ),
        picture=None,
        sections=tuple(
            Section(f"at-{i}", f"At {speed:g} m/s", _blocks(one))
            for i, (speed, one) in enumerate(zip(speeds, studies, strict=True))
        ),
        made=f"swashplate {versions()['swashplate']}, {date()}",
    )


def _blocks(one: Observability) -> tuple[Text | Points | Table, ...]:
    rows = tuple((Cell(k.name), Cell(f"{k.sigma:.3g}", True), Cell(f"{k.before:.3g}", True)) for k in one.known)
    caption = f"How well each is known after {one.seconds:g} s (standard deviation)."
    blocks: list[Text | Points | Table] = []
    if one.hidden:
        blocks.append(Points(tuple(map(in_words, one.hidden)), "Not seen at all, and it does not fade"))
    if one.faint:
        blocks.append(Points(tuple(map(in_words, one.faint)), "Seen, but by less than the readings' noise"))
    return (*blocks, Table(caption, ("state", "known to", "without any reading"), rows))
