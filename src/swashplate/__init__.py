"""From a small helicopter's flight log to a validated model, in the words of the command line.

    import swashplate as sp
    flight = sp.read("a.mat").condition(rate=100, cutoff=0)
    fit = sp.identify(sp.vehicle("coax"), flight)
    validation = sp.validate(fit, sp.read("b.mat").condition(rate=100, cutoff=0))
    sp.report(fit, validation, path="report.html")

Importing this package loads nothing heavy and changes no setting of any library.
"""


def __getattr__(name: str) -> object:
    """Names of `__init__.pyi` are loaded when first used (PEP 562)."""
    from importlib import import_module

    if name == "__version__":
        value = import_module("importlib.metadata").version("swashplate")
    elif name.startswith("__") and name != "__all__":
        raise AttributeError(f"module 'swashplate' has no attribute '{name}'")
    else:
        public = import_module("swashplate.public")
        if name == "__all__":
            value = ["__version__", *public.NAMES]
        elif name in public.NAMES:
            value = public.resolve(name)
        else:
            raise AttributeError(f"module 'swashplate' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({name for name in globals() if name.startswith("__")} | set(__getattr__("__all__")))  # type: ignore[call-overload]
