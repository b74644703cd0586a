"""Packaged vehicles that stand in where nobody names one; light to import."""

from __future__ import annotations

USUAL = "coax"
"""Where no vehicle is named: the one with a published card, flights and bench records."""

HELICOPTER = "raptor50"
"""The usual single rotor."""

BY_CHANNELS = {USUAL: ("motor_lower", "omega_lower"), "x8": ("motor_8",), "crazyflie": ("motor_4",)}
"""By channels of which a log of their kind has one; a log without any of them is drawn as the usual single rotor."""
