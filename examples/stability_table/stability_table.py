"""An export of your own: stability and control derivatives as a table that any spreadsheet opens."""

from swashplate.export.formats import Export, ExportRequest


def stability_table(asked: ExportRequest) -> Export:
    """NAME.csv: a row for every state's rate, a column for every state and input, with units.

    `asked.linear()` are the matrices of whatever model it is: a vehicle about `asked.about` (hover where no trim was
    given), or an identified linear model.
    """
    model = asked.linear()
    columns = (*model.states, *model.inputs)
    lines = [",".join(("rate of", "unit", *(f"{name} [{model.units.get(name) or '1'}]" for name in columns)))]
    for i, state in enumerate(model.states):
        numbers = (*model.A[i], *model.B[i])
        unit = f"{model.units.get(state) or '1'}/s"
        lines.append(",".join((state, unit, *(f"{number:.6g}" for number in numbers))))
    late = [f"{name} {1e3 * seconds:.3g} ms" for name, seconds in model.delays.items() if seconds]
    notes = [f"Delays are not in the table: {', '.join(late)}."] if late else []
    return Export({f"{asked.name}.csv": ("\n".join(lines) + "\n").encode()}, tuple(notes))
