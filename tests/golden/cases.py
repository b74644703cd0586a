"""Every golden case; importing this fills `CASES`."""

from __future__ import annotations

from . import cases_control, cases_exports, cases_flights, cases_models, cases_responses

__all__ = ["cases_control", "cases_exports", "cases_flights", "cases_models", "cases_responses"]
