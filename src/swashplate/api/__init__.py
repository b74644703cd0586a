"""The verbs: what the command line does, as one call each that returns an object."""
