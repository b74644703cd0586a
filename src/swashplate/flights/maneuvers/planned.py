"""The verb `plan_maneuver`: an excitation to fly, its design rules checked, and ArduPilot's parameters for it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from swashplate.atomic import write_text
from swashplate.errors import ManeuverError
from swashplate.flights.maneuvers.ardupilot_chirp import AXES, MIXER, Chirp
from swashplate.flights.maneuvers.maneuver_design import ExpectedResponse, RuleCheck, checks, sampled
from swashplate.flights.maneuvers.series import FADE, Maneuver, parse
from swashplate.flights.tabular import as_csv
from swashplate.shown import Shown
from swashplate.text_table import text_table


@dataclass(frozen=True, repr=False)
class PlannedManeuver(Shown):
    """An excitation to fly.

    Attributes:
        maneuver: what is flown.
        checks: its design rules, met or not.
        rate: of the series and of the log [Hz].
        chirp: ArduPilot's own schedule of the sweep, where it was asked for.
    """

    maneuver: Maneuver
    checks: tuple[RuleCheck, ...]
    rate: float
    chirp: Chirp | None = None

    def save(self, path: str | Path) -> tuple[Path, ...]:
        """Write the series as .csv and, beside it, ArduPilot's parameters as .param; returns the files."""
        file = Path(path)
        written = [write_text(file, as_csv(sampled(self.maneuver, rate=self.rate, chirp=self.chirp)))]
        if self.chirp is not None:
            written.append(write_text(file.with_suffix(".param"), self.chirp.parameter_file()))
        return tuple(written)

    def to_document(self) -> dict[str, object]:
        """All of it as what becomes JSON."""
        return {
            "maneuver": vars(self.maneuver),
            "checks": [vars(check) for check in self.checks],
            "ardupilot": None if self.chirp is None else self.chirp.parameters(),
        }

    def rows(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heading and cells of a table of the rules."""
        return ("rule", "found", "expected", "met"), [
            (c.rule, c.found, c.expected, "yes" if c.met else "NO") for c in self.checks
        ]

    def __repr__(self) -> str:
        rules = text_table(*self.rows(), left=(0, 1, 2, 3))
        return rules if self.chirp is None else f"{rules}\n\n{self.chirp.parameter_file().rstrip()}"


def plan_maneuver(
    maneuver: Maneuver | str,
    *,
    rate: float = 100.0,
    noise: float | None = None,
    gain: float | None = None,
    coherence: float = 0.8,
    bandwidth: float | None = None,
    f180: float | None = None,
    ardupilot: bool = False,
    sid_axis: int | None = None,
) -> PlannedManeuver:
    """Check an excitation against the design rules of its kind; `.save` writes the series for an autopilot to fly.

    Args:
        maneuver: one, or its words: "sweep:pitch,0.5-8Hz,60s,0.1".
        rate: of the series and of the log [Hz].
        noise: standard deviation of the output's noise, in its unit; gain: output over input where it is weakest in
            the band. The amplitude's check needs both.
        coherence: wanted everywhere in the band.
        bandwidth: of the response, or of the mode of interest [Hz].
        f180: frequency at which the response's phase is -180 deg [Hz].
        ardupilot: a sweep on ArduPilot's schedule, with SID_ parameters.
        sid_axis: ArduPilot's SID_AXIS; the mixer, behind the rate controller, where None.

    Raises:
        ManeuverError: for words that are no maneuver, one of noise and gain, or what ArduPilot does not fly.
    """
    if (noise is None) != (gain is None):
        raise ManeuverError("only one of --noise and --gain is given.", hint="The amplitude's check needs both.")
    planned = parse(maneuver) if isinstance(maneuver, str) else maneuver
    if not planned.axes:
        raise ManeuverError(f"a {planned.kind} moves nothing: there is nothing to plan.", channel="maneuver")
    chirp = _chirp(planned, sid_axis) if ardupilot else None
    known = ExpectedResponse(noise, gain, coherence, bandwidth, f180)
    return PlannedManeuver(planned, tuple(checks(planned, rate=rate, vehicle=known, chirp=chirp)), rate, chirp)


def _chirp(planned: Maneuver, axis: int | None) -> Chirp:
    """The chirp that ArduPilot flies in place of a sweep."""
    if planned.kind != "sweep" or planned.band is None:
        raise ManeuverError(
            f"ArduPilot's System ID mode flies sweeps only, not a {planned.kind}.",
            channel="--ardupilot",
            hint="Fly it from a companion computer, or by hand.",
        )
    number = MIXER.get(planned.axes[0]) if axis is None else axis
    if number is None or number not in AXES:
        raise ManeuverError(
            f"'{planned.axes[0]}' has no SID_AXIS." if axis is None else f"{axis} is no SID_AXIS.",
            channel="sid_axis",
            hint="; ".join(f"{n} {name} [{unit}]" for n, (name, unit) in AXES.items()) + ".",
        )
    name, unit = AXES[number]
    mixer = MIXER.get(planned.axes[0])
    if mixer is not None and number <= max(MIXER.values()) and name.split()[0] != AXES[mixer][0].split()[0]:
        raise ManeuverError(f"{number} is the {name}, and the sweep is one of {planned.axes[0]}.", channel="sid_axis")
    if unit == "1" and planned.amplitude > 1.0:
        raise ManeuverError(
            f"an amplitude of {planned.amplitude:g} is beyond the mixer's range of one.",
            channel="--ardupilot",
            hint="Give the mixer's share, for example 0.1; in deg/s with --settings sid_axis=7, 8 or 9.",
        )
    return Chirp.planned(number, planned.amplitude, planned.band, record=planned.duration, fade=FADE * planned.duration)
