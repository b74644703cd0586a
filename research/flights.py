"""What the studies of the two real CoaX flights have in common with the page of the real flights."""

FLIGHTS = {"august": "coax56/flight_2011-08-01_vertical", "july": "coax56/flight_2011-07-25_hover_crash"}
CHANNELS = ("u", "v", "w", "phi", "theta", "psi", "p", "q", "r")
CHOICE, HORIZON = "balanced", (0.25, 1.0)
