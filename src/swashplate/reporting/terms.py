"""The words of reports and pages, one line a term: for the documentation's glossary and at the end of every report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from swashplate.reporting.structure import Figure, Section, Table, Text, tabulate

TERMS: dict[str, str] = {
    "at its bound": "a parameter ended at a limit that physics sets; the equations lack something that it stands for",
    "autocorrelation": "how much an error resembles the error some time earlier: 1 fully, 0 not at all",
    "band": "the range in which a prediction promises to find the flight, for example 95 % of the time",
    "bandwidth": "the frequency up to which an attitude follows a pilot's command (ADS-33)",
    "best rival": "the best of three simple predictions: the published card, the last value, constant rates",
    "block bootstrap": "an interval from pieces of the flight that are drawn again and again",
    "card": "the file of a vehicle's numbers, each with unit, source and status",
    "cannot be judged": "the flight does not tell the aircraft from its controller, or nothing can predict this motion",
    "ceiling": "the best fit that a regression on the recorded data reaches; a model cannot be asked for more",
    "coherence": "the share of an output that an input explains at a frequency: 1 all, below 0.6 not to be used",
    "coloured": "errors that are related to the errors before them; plain bounds are then too narrow",
    "constant rates": "a prediction in which the angular rates and the velocities stay as they were",
    "corrected": "a standard deviation that allows for coloured errors (Morelli and Klein 1997)",
    "correlation": "how far the errors of two parameters go together: near 1 or -1 only their combination is known",
    "Cramér-Rao bound": "the smallest standard deviation that the information in the data allows",
    "crossover": "the frequency at which a loop's gain is one",
    "damping": "how fast an oscillation dies out, as a share of the critical one; negative: it grows",
    "delay": "the time by which the motion is late against the logged command",
    "disc margin": "how far gain and phase of all loops may change together before the loop is unstable",
    "drift": "a disturbance that wanders and does not come back, such as a battery that runs down",
    "eigenvalue": "the rate [1/s] at which a motion of its own grows (positive) or dies out, with its frequency",
    "excitation": "what moved an input from outside: a sweep, a maneuver, a pilot's stick",
    "filter": "the Kalman filter: it joins model and measurements, and knows nothing of what comes later",
    "fit": "100 % where a prediction is perfect, 0 % where it is as good as holding the last value",
    "gain margin": "by how much a loop's gain may grow before it is unstable",
    "gust": "a disturbance that fades within some tenths of a second to seconds",
    "hold": "the prediction that nothing changes: the last value stays",
    "hold-out": "a flight that the fit has not seen",
    "horizon": "how far ahead a prediction looks",
    "insensitivity": "how far a parameter may move, the others held, before the fit gets noticeably worse",
    "innovation": "measurement minus what the filter expected one sample before",
    "J": "the cost of a fit to responses: 50 hardly to be told from the flight, above 100 not acceptable",
    "likelihood": "how probable the measurements are under a model; fits make it as large as they can",
    "lever": "from the centre of gravity to the point that the cameras track",
    "mode": "a motion that the aircraft has of its own, with its frequency and damping",
    "one-step prediction": "a prediction one sample ahead; good with nearly any model",
    "past alone": "a regression on past motion and past inputs: what the past tells without later inputs",
    "phase margin": "by how much a loop's phase may fall before it is unstable",
    "prior": "what was known of a number before the flight, with its standard deviation",
    "prior share": "how much of the information about a number is the prior's; near 100 % the flight said nothing",
    "residual": "measurement minus model",
    "rms": "root of the mean square: a typical size",
    "sensitivity": "how much a loop makes disturbances larger at its worst frequency; 2 or less is robust",
    "sweep": "a command whose frequency rises slowly, so that each frequency is told by itself",
    "Theil's coefficient": "0 for a perfect prediction, 1 for one that is no better than the opposite",
    "tied": "a parameter that follows from others by a formula",
    "trim": "the constant command that holds the aircraft in place",
    "verdict": "what may be said of an axis: good, usable, poor, or cannot be judged",
    "white": "errors that have nothing to do with the errors before them",
    "σ": "standard deviation: the truth lies within two of them in 95 of 100 cases, where errors are as assumed",
}


def terms_in(texts: Iterable[str]) -> dict[str, str]:
    """The terms that occur in some texts, in alphabetical order."""
    text = " ".join(texts)
    return {
        term: meaning
        for term, meaning in sorted(TERMS.items(), key=lambda item: item[0].lower())
        if re.search(rf"(?<!\w){re.escape(term)}(?:s|es)?(?!\w)", text, 0 if len(term) < 3 else re.IGNORECASE)
    }


def with_terms(sections: Sequence[Section], lines: Sequence[tuple[str, str, str]] = ()) -> tuple[Section, ...]:
    """Sections with one more at the end: what the words in them mean."""
    texts = [text for line in lines for text in line[:2]]
    for section in sections:
        texts.append(section.title)
        for block in section.blocks:
            if isinstance(block, Table):
                texts += [
                    block.caption,
                    block.note,
                    *block.columns,
                    *(cell.words for row in block.rows for cell in row),
                ]
            elif isinstance(block, Figure):
                texts.append(block.caption)
            else:
                texts += [block.words] if isinstance(block, Text) else block.items
    rows = tuple((term, text) for term, text in terms_in(texts).items())
    table = tabulate("Words of this page", ("word", "meaning"), rows)
    return (*sections, Section("words", "What do the words mean?", (table,), folded=True)) if rows else tuple(sections)


def first_screen(
    sections: Sequence[Section], lines: Sequence[tuple[str, str, str]] = (), *, of: str = ""
) -> tuple[Figure | None, tuple[Section, ...]]:
    """The picture of a page's first screen, and the sections without it; the last one says what the words mean.

    The picture is the first figure that would be folded.

    Args:
        sections, lines: of the page.
        of: identifier of the section whose figure is preferred.
    """
    folded = sorted((one for one in sections if one.folded), key=lambda one: one.identifier != of)
    picture = next((block for one in folded for block in one.blocks if isinstance(block, Figure)), None)
    rest = (
        replace(one, blocks=tuple(b for b in one.blocks if b is not picture)) for one in with_terms(sections, lines)
    )
    return picture, tuple(rest)
