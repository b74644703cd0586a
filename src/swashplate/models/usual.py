"""Packaged vehicles that stand in where nobody names one; light to import."""

from __future__ import annotations

USUAL = "coax"
"""Where no vehicle is named: the one with a published card, flights and bench records."""

HELICOPTER = "raptor50"
"""The usual single rotor."""

BY_ROTORS = {4: "crazyflie", 8: "x8"}
"""Multirotors by their number of rotors."""
