"""The report on a controller: what it stands, what it rejects, how it flies, and by which standard that is good."""

from __future__ import annotations

import math
from collections.abc import Sequence

from swashplate.control.analysis.check import ControlCheck
from swashplate.control.analysis.margins import AxisMargins
from swashplate.control.analysis.requirements import (
    ATTITUDE_COUPLING,
    GAIN_MARGIN,
    PHASE_MARGIN,
    REFERENCE_RADIUS,
    REJECTION,
    REJECTION_PEAK,
    Boundary,
)
from swashplate.flights.schema import channel
from swashplate.identification.frequency.handling import delay_words
from swashplate.reporting import figures_control as figures
from swashplate.reporting.structure import Block, Cell, Points, Report, Section, Text, tabulate
from swashplate.reporting.terms import first_screen
from swashplate.reporting.theme import unit_words
from swashplate.reporting.versions import card_hash, versions
from swashplate.reporting.words import counted, listed, mode_words, value_words

_TONES = {1: "good", 2: "caution", 3: "bad"}


def compose_check(check: ControlCheck, *, title: str | None = None) -> Report:
    """The report's structure."""
    sections = [
        _loops(check),
        _rejection(check),
        _handling(check),
        _steps(check),
        _gusts(check),
        _boundaries(check),
        _provenance(check),
    ]
    parts = [section for section in sections if section is not None]
    slowest = check.slowest
    slowest_mode = f"least stable {mode_words(slowest)}, at {check.rate:g} Hz"
    lines = (
        ("Modes", slowest_mode, "bad" if check.problems else "good"),
        ("Margins", *_margins_line(check)),
        ("Rejection", *_rejection_line(check)),
        ("Handling", *_handling_line(check)),
        ("Coupling", *_coupling_line(check)),
    )
    picture, folded = first_screen(parts, lines, of="steps")
    return Report(
        title=title or f"A controller on {check.vehicle.name}",
        banners=tuple(("bad", f"PROBLEM: {problem}") for problem in check.problems),
        summary=lines,
        picture=picture,
        sections=folded,
    )


def _tone(levels: Sequence[int | None]) -> str:
    """Of the worst level; no better than a caution where one was not judged, plain where there is nothing."""
    known = [level for level in levels if level is not None]
    worst = _TONES[max(known)] if known else "caution"
    return "plain" if not levels else "caution" if len(known) < len(levels) and worst == "good" else worst


def _decibel(factor: float) -> float:
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def _axis_level(a: AxisMargins, check: ControlCheck) -> int | None:
    """Level of one loop's margins."""
    levels = [
        GAIN_MARGIN.level(min(_decibel(a.gain), -_decibel(a.gain_down), 1e3)),
        PHASE_MARGIN.level(min(math.degrees(a.phase), 1e3)),
        check.delay_boundary.level(min(1e3 * a.delay, 1e6)),
    ]
    known = [level for level in levels if level is not None]
    return max(known) if known else None


def _margins_line(check: ControlCheck) -> tuple[str, str]:
    if check.margins is None:
        return "none: the loop does not stand.", "bad"
    t = check.margins.together
    levels = {a.name: _axis_level(a, check) or 0 for a in check.margins.axes}
    worst = max(check.margins.axes, key=lambda a: levels[a.name])
    short = check.margins.least_delay < 1e-3 * check.delay_boundary.level1
    return (
        f"all loops at once ±{_decibel(t.gain):.1f} dB or ±{math.degrees(t.phase):.0f}° (disc {t.alpha:.2f} at "
        f"{t.frequency:.3g} rad/s) or {delay_words(check.margins.delay)} of further delay; the weakest single loop is "
        f"{worst.name}, {math.degrees(worst.phase):.0f}° and {delay_words(worst.delay)}.",
        "bad" if short else "good" if levels[worst.name] == 1 else "caution",
    )


def _rejection_line(check: ControlCheck) -> tuple[str, str]:
    if not check.rejections:
        return ("not computed with an observer." if not check.omega.size else "no state is held."), "plain"
    worst = max(check.rejections, key=lambda r: r.peak)
    levels = [x for r in check.rejections for x in (r.level, r.peak_level) if x is not None]
    names = listed([r.state for r in check.rejections], most=8)
    unjudged = [r.state for r in check.rejections if r.level is None]
    beside = f" No standard judges {listed(unjudged, most=8)}." if unjudged else ""
    return f"{names} are held; largest peak {worst.peak:.1f} dB ({worst.state}).{beside}", _tone(levels)


def _handling_line(check: ControlCheck) -> tuple[str, str]:
    rows = [(a, a.handling) for a in check.attitudes if a.handling]
    if not rows:
        return (
            "not computed with an observer." if not check.omega.size else "no bandwidth could be read off."
        ), "caution"
    parts = [
        f"{figures.ATTITUDE_WORDS[a.state]} {h.bandwidth.value:.3g} rad/s, Level {a.level or '–'}" for a, h in rows
    ]
    return f"{'; '.join(parts)} (boundaries scaled, not checked).", _tone([a.level for a, _ in rows])


def _coupling_line(check: ControlCheck) -> tuple[str, str]:
    parts = [f"{c.name.split(' (')[0]} {value_words(c.value)} {c.unit}" for c in check.couplings]
    judged = [c.level for c in check.couplings if c.level]
    beside = f" {len(judged)} of {len(parts)} have a standard." if len(judged) < len(parts) else ""
    return f"{'; '.join(parts) or 'no step was flown'}.{beside}", _tone(judged)


def _level(level: int | None) -> Cell:
    return Cell("–" if level is None else f"Level {level}", tone=_TONES.get(level or 0, "quiet"))


def _number(value: float, form: str = ".3g") -> Cell:
    return Cell(format(value, form) if math.isfinite(value) else "∞" if value == math.inf else "–", number=True)


def _loops(check: ControlCheck) -> Section:
    blocks: list[Block] = []
    if check.margins is not None:
        rows = []
        for a in check.margins.axes:
            least = f"6 dB, 45°, {delay_words(check.delay_boundary.level1 / 1e3)}"
            good = _axis_level(a, check) == 1
            judgement = (f"meets {least}", "good") if good else (f"below one of {least}", "caution")
            rows.append(
                (a.name, _number(_decibel(a.gain_down), ".1f"), _number(_decibel(a.gain), "+.1f"),
                 _number(math.degrees(a.phase), ".0f"), _number(a.crossover), delay_words(a.delay),
                 _number(a.disc.alpha, ".2f"),
                 _number(_decibel(a.sensitivity), ".1f"),
                 Cell(judgement[0], tone=judgement[1]))
            )  # fmt: skip
        t = check.margins.together
        columns = (
            "loop",
            "gain down [dB]",
            "gain up [dB]",
            "phase [deg]",
            "crossover [rad/s]",
            "delay",
            "disc",
            "max |S| [dB]",
            "",
        )
        note = (
            f"All loops at once: gain ±{_decibel(t.gain):.1f} dB, phase ±{math.degrees(t.phase):.0f}° (disc "
            f"{t.alpha:.2f} at {t.frequency:.3g} rad/s), {delay_words(check.margins.delay)} of further delay; "
            "the disc by the diagonally scaled upper bound of the structured singular "
            "value: it never promises more than there is. Disc margins: Seiler, Packard and Gahinet (2020)."
        )
        blocks.append(tabulate("Margins at the inputs, one loop opened at a time", columns, rows, note=note))
    blocks += [Text(note, tone="caution") for note in check.notes]
    blocks += [figures.loops_figure(check)] if check.omega.size else []
    blocks.append(figures.modes_figure(check))
    return Section("margins", "How far are the loops from instability?", tuple(blocks), folded=True)


def _rejection(check: ControlCheck) -> Section | None:
    if not check.rejections:
        return None
    rows = tuple(
        (r.state, _number(r.bandwidth), _level(r.level), _number(r.peak, ".1f"), _level(r.peak_level),
         _number(r.peak_frequency))
        for r in check.rejections
    )  # fmt: skip
    columns = ("state", "bandwidth [rad/s]", "", "peak [dB]", "", "at [rad/s]")
    note = (
        "Bandwidth: the lowest frequency at which a disturbance added to the measured state is reduced by 3 dB. "
        "Where the place is held, the attitude follows slow disturbances: its bandwidth begins above them."
    )
    table = tabulate("Disturbance rejection", columns, rows, note=note)
    return Section(
        "rejection", "How well are disturbances rejected?", (table, figures.rejection_figure(check)), folded=True
    )


def _handling(check: ControlCheck) -> Section | None:
    if not check.attitudes:
        return None
    rows = []
    for a in check.attitudes:
        h = a.handling
        remark = a.problem or ("6 dB bandwidth lower or none: a pilot may oscillate" if a.oscillates else "")
        numbers = (h.bandwidth_phase, h.bandwidth_gain, h.bandwidth, h.phase_delay) if h else (None,) * 4
        rows.append(
            (f"{a.state} of {a.reference}", a.kind if h else "–",
             *(_number(math.nan if n is None else n.value) for n in numbers),
             _number(check.boundary(a.state).scaled(check.scale)[0]), _level(a.level), remark)
        )  # fmt: skip
    columns = (
        "response", "type", "45° [rad/s]", "6 dB [rad/s]", "bandwidth [rad/s]", "phase delay [s]",
        "Level 1 from [rad/s]", "", "remark"
    )  # fmt: skip
    note = (
        "ADS-33E-PRF: the bandwidth of an attitude response is the one by phase, that of a rate response the lower of "
        "the two. If the type was not given, the phase at a tenth of the bandwidth decides it."
    )
    table = tabulate("Bandwidth and phase delay", columns, rows, note=note)
    return Section("handling", "How does it follow a pilot?", (table, figures.attitude_figure(check)), folded=True)


def _steps(check: ControlCheck) -> Section | None:
    if not check.steps:
        return None
    rows = []
    for s in check.steps:
        known, m = channel(s.state), s.metrics
        rows.append(
            (s.reference, s.state, _number(m.peak * known.shown_factor), unit_words(known.shown_unit),
             _number(m.rise), _number(100.0 * m.overshoot, ".0f"), _number(m.settling), _number(m.quickness),
             _number(100.0 * m.error, ".1f"))
        )  # fmt: skip
    columns = (
        "step of", "answer", "largest", "unit", "rise [s]", "overshoot [%]", "settled [s]", "quickness [1/s]",
        "left [%]"
    )  # fmt: skip
    note = "Rise from 10 to 90 %, settled within 5 %; quickness: largest rate over largest change."
    couplings = tabulate(
        "What other axes do within 4 s of the step",
        ("coupling", "largest over largest", "unit", ""),
        tuple((c.name, _number(c.value), c.unit, _level(c.level)) for c in check.couplings),
        note="On the nonlinear vehicle. ADS-33E-PRF takes the on-axis attitude at 4 s, here it is the largest so far.",
    )
    steps = tabulate("Steps", columns, rows, note=note)
    return Section(
        "steps",
        "What does a step do, also to the other axes?",
        (steps, figures.steps_figure(check), couplings),
        folded=True,
    )


def _gusts(check: ControlCheck) -> Section | None:
    blown = check.in_gusts
    if blown is None:
        return None
    rows = tuple(
        (name, _number(factor * value), unit)
        for name, value, factor, unit in (
            ("place, level", blown.place, 1e3, "mm"),
            ("speed, level", blown.speed, 1.0, "m/s"),
            ("height", blown.height, 1e3, "mm"),
            ("heading", blown.heading, math.degrees(1.0), "°"),
            ("roll and pitch together", blown.lean, math.degrees(1.0), "°"),
        )
        if math.isfinite(value)
    )
    along, across, down = blown.gusts.sigma
    note = (
        f"{counted(blown.flights, 'flight')} of {blown.duration:g} s on the nonlinear vehicle in Dryden turbulence of "
        f"{along:.2g}, {across:.2g} and {down:.2g} m/s (along, across, down; no mean wind), the first 2 s left out."
    )
    table = tabulate("Root mean square of what it strays by", ("of", "RMS", "unit"), rows, note=note)
    return Section("gusts", "How far does it stray in gusts?", (table,), folded=True)


def _boundaries(check: ControlCheck) -> Section:
    used: list[Boundary] = [
        GAIN_MARGIN,
        PHASE_MARGIN,
        check.delay_boundary,
        *(check.boundary(a.state) for a in check.attitudes),
    ]
    used += [*(REJECTION[r.state] for r in check.rejections if r.state in REJECTION), REJECTION_PEAK, ATTITUDE_COUPLING]
    rows = []
    for b in used:
        first, second = b.scaled(check.scale)
        rows.append(
            (b.name, "at least" if b.least else "at most", _number(b.level1), _number(first),
             _number(second), Cell("yes", tone="good") if b.checked else Cell("no", tone="caution"), b.source)
        )  # fmt: skip
    columns = ("quantity", "", "Level 1, full size", "scaled", "Level 2, scaled", "checked", "source")
    boundary_note = (
        f"Frequencies are scaled by √N with N = {check.scale:.3g}: the rotor radius of the UH-60 ({REFERENCE_RADIUS} "
        "m) over this one's, unless a scale was given (Froude). The boundaries are for manned helicopters."
    )
    note = (
        "checked: whether the number was compared with the standard's text. Where it says no, treat it as provisional."
    )
    table = tabulate("Boundaries that were used", columns, rows, note=note)
    return Section("boundaries", "Where do the limits come from?", (Text(boundary_note), table), folded=True)


def _provenance(check: ControlCheck) -> Section:
    lines = [f"{name} {version}" for name, version in versions().items()]
    lines.append(f"card of {check.vehicle.name}, SHA-256 {card_hash(check.vehicle.card)}")
    lines.append(f"{counted(len(check.steps), 'step')} flown; task of the boundaries: {check.task}")
    return Section("made-with", "How was this made?", (Points(tuple(lines)),), folded=True)
