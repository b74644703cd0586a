"""Change a card, look at the hover and its modes, fly a doublet, save everything.

python examples/heavier_aircraft.py
"""

import swashplate as sp

coax = sp.vehicle("coax")
heavy = coax.with_values({"mass": 0.333}, source="weighed with the on-board computer", status="measured")
heavy.save("heavy.toml")

for name, vehicle in (("bare", coax), ("with computer", sp.vehicle("heavy.toml"))):
    hover = sp.trim(vehicle, voltage=11.1)
    slowest = max(sp.linearize(vehicle, hover).modes(), key=lambda mode: mode.eigenvalue.real)
    print(f"{name}: motors {hover.commands()['motor_lower']:.3f} and {hover.commands()['motor_upper']:.3f} at 11.1 V,")
    print(f"  least damped mode {slowest.eigenvalue:.2f} 1/s")

flight = sp.simulate(heavy, "doublet:pitch,0.3s,0.2", voltage=11.1)
flight.save("doublet.nc")
print(flight)
