"""The switches of the single-rotor helicopter's equations."""

from __future__ import annotations

from typing import Any, NamedTuple

from swashplate.errors import CardError
from swashplate.models.card import Card, no_option
from swashplate.physics.ground_effect import FORMS as GROUND_EFFECTS


class HelicopterOptions(NamedTuple):
    """What a card's `[options]` may say.

    Attributes:
        rotation: "ccw" or "cw", the main rotor's sense seen from above.
        inflow: "glauert" (momentum theory and Glauert's gradient), "uniform" (no gradient), or
            "pitt-peters" (three inflow states).
        coning: blades cone by themselves; False holds them at the precone (teetering hubs).
        bar: Bell-Hiller stabilizer bar.
        rotor_speed: "fixed", "governed" (a state under the governor) or "throttle" (the same with a fifth input).
        gyro: yaw gyro.
        servos: servo lags, speed limits and stops.
        delay: commands come late by the card's pure delay.
        engine_lag: the engine's power follows the governor with a lag; it needs a rotor speed that is not fixed.
        ground: skids touch ground at z = 0.
        grip: skids stick to the ground until friction gives way (eight states); it needs ground.
        phase_lag: use the card's aerodynamic phase lag.
        in_plane: "blade-element", or "thrust-tilt" for thrust perpendicular to the tip-path plane.
        yaw_at_blades: the blades meet the air at the rotor's speed less the yaw rate, as they do on any shaft whose
            speed is kept against the fuselage; most published tables and the packaged cards leave it out.
        yaw_at_hub: the hub feels the yaw rate, which rolls a shaft that leans forward and carries a hub ahead of the CG
            sideways; Padfield (2007) and what follows him leave both out.
        precession_torque: the shaft carries the torque with which a tilted rotor answers pitch and roll rates
            (`flapping.precession_torque`); the packaged cards, whose tables leave it out, do too.
        tip_loss: the main blades lift from `rotor_root_cutout` to `rotor_tip_loss` of the radius, not over all of it.
        induced_factor: the main rotor's induced power is `rotor_induced_factor` times that of an even inflow.
        delta3: flapping changes the main blades' pitch by `rotor_delta3` times the flapping angle.
        stiff_blades: the disc moves at the frequency of the regressing flap mode (`flapping.regressing_pace`), which
            first order alone makes too fast: 2 % at a flapping frequency of 1.04 per turn, 45 % at 1.9.
        tail_in_wake: the main rotor's wake reaches the tail rotor where flight sweeps it there, as it does the
            tailplane.
        cross_flow: air across the fuselage pushes it its own way (`fuselage.cross_flow_loads`); off, drag and slopes
            for air from ahead are taken in the downwash too, as in the packaged cards' tables.
        stabilator: the horizontal tail's incidence follows air speed, collective and pitch rate (`stabilator_*`), in
            place of `tailplane_incidence`.

        ground_effect: "cheeseman-bennett" or "hayden" over ground at z = 0 (`ground_effect.induced_share`), or "none".
    """

    rotation: str = "ccw"
    inflow: str = "glauert"
    coning: bool = False
    bar: bool = False
    rotor_speed: str = "fixed"
    gyro: bool = False
    servos: bool = False
    delay: bool = False
    engine_lag: bool = False
    ground: bool = False
    grip: bool = False
    phase_lag: bool = False
    in_plane: str = "blade-element"
    yaw_at_blades: bool = False
    yaw_at_hub: bool = True
    precession_torque: bool = False
    tip_loss: bool = False
    induced_factor: bool = False
    delta3: bool = False
    stabilator: bool = False
    stiff_blades: bool = False
    tail_in_wake: bool = False
    cross_flow: bool = False
    ground_effect: str = "none"

    @property
    def sense(self) -> float:
        """+1 for a counter-clockwise rotor, -1 for a clockwise one (Gamma)."""
        return 1.0 if self.rotation == "ccw" else -1.0

    @property
    def throttle(self) -> bool:
        return self.rotor_speed == "throttle"


_CHOICES: dict[str, tuple[Any, ...]] = {
    "rotation": ("ccw", "cw"),
    "inflow": ("glauert", "uniform", "pitt-peters"),
    "rotor_speed": ("fixed", "governed", "throttle"),
    "in_plane": ("blade-element", "thrust-tilt"),
    "ground_effect": GROUND_EFFECTS,
    **dict.fromkeys(
        (
            "coning",
            "bar",
            "gyro",
            "servos",
            "delay",
            "engine_lag",
            "ground",
            "grip",
            "phase_lag",
            "yaw_at_blades",
            "yaw_at_hub",
            "precession_torque",
            "tip_loss",
            "induced_factor",
            "delta3",
            "stabilator",
            "stiff_blades",
            "tail_in_wake",
            "cross_flow",
        ),
        (True, False),
    ),
}


def helicopter_options(card: Card) -> HelicopterOptions:
    """A card's options.

    Raises:
        CardError: naming the option that is not known or has no such value.
    """
    where, said = card.where, card.options
    for name, value in said.items():
        if name not in _CHOICES:
            raise no_option(name, _CHOICES, where=where)
        if not any(value is choice or (isinstance(value, str) and value == choice) for choice in _CHOICES[name]):
            expected = ", ".join(map(repr, _CHOICES[name]))
            raise CardError(f"is {value!r}, expected one of {expected}.", where=where, channel=name)
    chosen = HelicopterOptions(**said)
    if chosen.engine_lag and chosen.rotor_speed == "fixed":
        raise CardError(
            "needs a rotor speed that the engine can change.",
            where=where,
            channel="engine_lag",
            hint='Add rotor_speed = "governed", or "throttle".',
        )
    if chosen.grip and not chosen.ground:
        raise CardError("needs ground to hold.", where=where, channel="grip", hint="Add ground = true.")
    return chosen
