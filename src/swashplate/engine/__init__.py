"""Equations as C: traced by CasADi, put in order, differentiated and printed."""
