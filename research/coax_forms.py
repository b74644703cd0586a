"""The CoaX's rotor forms on the real flights: what each learns from one, and how it predicts the other. A table.

    python research/coax_forms.py

Some minutes of processor time. The table is in docs/explanation/coax-model.md.
"""

from __future__ import annotations

import sys
import time

import held_out
from flights import FLIGHTS

import swashplate as sp

FORMS = {"paper": {}, "blades": {"rotor": "inflow", "flapping": "blades"}}
"""The form that the flights are to beat, and the one that is to beat it."""
CHOICE, AHEAD = "full", (0.5, 1.0)


def main() -> int:
    flights = {name: sp.read(where).condition(rate=100.0, cutoff=0.0) for name, where in FLIGHTS.items()}
    for learnt, predicted in (("august", "july"), ("july", "august")):
        fits = {}
        for name, options in FORMS.items():
            began = time.process_time()
            fits[name] = sp.identify(sp.vehicle("coax", **options), flights[learnt], free=CHOICE, keep_unexcited=True)
            cost = time.process_time() - began
            told = f"-log-likelihood with priors {fits[name].history[-1]:.1f}, {cost:.0f} s of processor time"
            print(f"\n## {name}, learnt in {learnt}: {told}\n{fits[name]}", flush=True)
        for ahead in AHEAD:
            held_out.AHEAD = ahead
            paper, blades = (held_out.prediction_errors(fits[name], [flights[predicted]]) for name in FORMS)
            print(f"\n{learnt} predicts {predicted}, {ahead:g} s ahead: fit of each form [%], blades' lead and 95 %")
            scores = [
                100.0 - 100.0 * (sum(e.sum(axis=0) for e in one.errors) / sum(m.sum(axis=0) for m in one.moved)) ** 0.5
                for one in (paper, blades)
            ]
            for k, gain in enumerate(held_out.gains(paper, blades)):
                both = f"{scores[0][k]:6.1f} {scores[1][k]:6.1f}"
                print(f"{gain.channel:6s} {both} {gain.points:+6.1f} ({gain.low:+.1f} to {gain.high:+.1f})", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
