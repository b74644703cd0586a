"""Names that the top package does not offer: when modules move, this is the only file of the golden cases to change."""

from __future__ import annotations

from swashplate.control.analysis.ardupilot_gains import suggest_gains
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Provenance
from swashplate.identification.frequency.transfer_function_fit import as_state_space
from swashplate.identification.frequency.transfer_function_forms import suggest
from swashplate.identification.identify import identify
from swashplate.identification.time.equation_error import equation_error
from swashplate.validation.verify import verify_inside

__all__ = [
    "Flight",
    "Provenance",
    "as_state_space",
    "equation_error",
    "identify",
    "stream",
    "suggest",
    "suggest_gains",
    "verify_inside",
]
