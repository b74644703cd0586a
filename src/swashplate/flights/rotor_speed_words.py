"""Lines of rotors as a user names them, and what was found of them in words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from swashplate.errors import SwashError

_LINE = re.compile(r"(?P<name>[a-z]\w*)=(?P<low>[-+]?[\d.]+)\.\.(?P<high>[-+]?[\d.]+)")


def lines_of(texts: Sequence[str]) -> dict[str, tuple[float, float]] | None:
    """`omega_upper=-40..-30` each as bands [Hz] by channel; None for no text.

    Raises:
        SwashError: for a text that is no line.
    """
    bands = {}
    for text in texts:
        match = _LINE.fullmatch(text)
        try:
            bands[match["name"]] = (float(match["low"]), float(match["high"]))  # pyrefly: ignore[unsupported-operation]
        except (TypeError, ValueError):
            hint = "For example --settings line=omega_upper=-40..-30."
            raise SwashError(f"'{text}' is no line.", channel="line", hint=hint) from None
    return bands or None


def line_words(lines: Mapping[str, Any]) -> Iterator[str]:
    """What `rotor_speed` found, a text each."""
    for name, told in lines.items():
        start, stop = told["runs"]
        if told.get("logged"):
            yield (
                f"{name}: {told['mean']:.4g} rad/s on average, spread {told['spread']:.2g}, from {start:.1f} to "
                f"{stop:.1f} s, as the log has it. Vibration was not asked; --settings line=... asks it."
            )
        else:
            folded = " or ".join(f"{hertz:+.1f}" for hertz in told["folded_from_hertz"])
            yield (
                f"{name}: {told['mean']:.1f} ± {told['sigma_of_mean']:.2g} rad/s on average, spread "
                f"{told['spread']:.2g}, from {start:.1f} to {stop:.1f} s; line at {told['hertz']:+.2f} Hz in "
                f"{', '.join(told['signals'])}, {told['decibel']:.0f} dB over its surroundings. A line at {folded} Hz "
                "would look the same."
            )
        yield from (f"! {words}." for words in told["remarks"])
