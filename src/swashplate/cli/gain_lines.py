"""Suggested autopilot gains as lines of text, the same for every verb that suggests them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swashplate.control.analysis.ardupilot_gains import Suggestion


def gain_words(suggestions: Sequence[Suggestion]) -> str:
    """Each axis: gains beside those that the log held, the margins of both, what to do first."""
    words = ""
    for s in suggestions:
        names = list(s.parameters) or list(s.flown)
        words += f"\n{s.axis}: {_margins(s.margins, s.peak)}\n" if s.parameters else f"\n{s.axis}: {s.words}\n"
        if s.flown:
            words += f"  {'parameter':<18}{'suggested':>10}{'flown':>10}\n"
        for name in names:
            cells = f"{s.parameters[name]:>10.4f}" if name in s.parameters else f"{'':>10}"
            words += f"  {name:<18}{cells}" + (f"{s.flown[name]:>10.4f}" if name in s.flown else "") + "\n"
        if s.flown:
            words += f"  as flown: {_margins(s.flown_margins, s.flown_peak)}\n"
        words += f"  {s.words}\n" if s.parameters else ""
    return words


def _margins(m: Any, peak: float) -> str:
    where = f" at {m.omega_180.value:.3g} rad/s" if m.omega_180.value > 0.0 else ""
    return (
        f"phase margin {m.phase_margin!r} deg, gain margin {m.gain_margin!r} dB{where}, largest sensitivity {peak:.2f}"
    )
