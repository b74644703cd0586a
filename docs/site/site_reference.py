"""The Python reference: every public name of `swashplate` with signature and docstring, as MyST text for the site.

The sources are read, not imported: signatures stand on the page as they are written, and no library is loaded. A verb's
is made of its question's fields.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from swashplate import public

SOURCE = Path(__file__).resolve().parents[2] / "src"
GROUPS = {
    "flights": "Flights: reading, checking, conditioning, manoeuvres",
    "identification": "Identification",
    "validation": "Validation",
    "models": "Models and cards",
    "physics": "Vectors",
    "simulation": "Simulation, trim and linear models",
    "control": "Controllers",
    "bench": "The test bench",
    "export": "Other programs' files",
    "reporting": "Reports",
    "links": "Replay",
    "api": "Verbs that join several steps",
    "errors": "Errors",
}
"""Headings by the package's folder, in the order of the page."""

_SECTION = re.compile(r"^(Args|Returns|Raises|Attributes|Yields):[ \t]*", re.MULTILINE)
_ENTRY = re.compile(r"^    (\*{0,2}[\w., ()*]+?): ", re.MULTILINE)
_TITLES = {"Args": "Arguments"}
_Function = ast.FunctionDef | ast.AsyncFunctionDef


def places() -> dict[str, str]:
    """Every public name and where it is defined, "package.module:name"."""
    return {name: public.place(name) for name in public.NAMES}


def reference() -> str:
    """The whole page's body.

    Raises:
        LookupError: where a public name has no definition in its module, or its folder no heading.
    """
    grouped: dict[str, list[str]] = {folder: [] for folder in GROUPS}
    for name, place in sorted(places().items(), key=lambda item: item[0].lower()):
        folder = place.split(":")[0].split(".")[1]
        grouped[folder].append(entry(name, place))
    parts = [f"## {GROUPS[folder]}\n\n" + "\n\n".join(made) for folder, made in grouped.items() if made]
    return "```{py:module} swashplate\n```\n\n" + "\n\n".join(parts)


def entry(name: str, place: str) -> str:
    """One public name: a function, a class with its members, or a value."""
    module, _, attribute = place.partition(":")
    node, docstring = _definition(module, attribute)
    if isinstance(node, ast.ClassDef):
        members = "\n\n".join(_members(module, node))
        return f"`````{{py:class}} {name}\n{_markdown(docstring, _types(node))}\n\n{members}\n`````"
    if isinstance(node, _Function):
        return f"`````{{py:function}} {name}{signature(node)}\n{_markdown(docstring)}\n`````"
    if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("verb("):
        asked = public.resolve(name)  # of its question: nothing heavy is loaded
        fields = re.sub(r"(: |-> )'([^']*)'", r"\1\2", str(inspect.signature(asked)))
        return f"`````{{py:function}} {name}{fields}\n{_markdown(inspect.getdoc(asked))}\n`````"
    return f"`````{{py:data}} {name}\n{_markdown(docstring)}\n`````"


def signature(function: _Function, *, method: bool = False) -> str:
    """A signature in one line, as it stands in the source."""
    arguments = ast.unparse(function.args)
    if method:
        arguments = re.sub(r"^(self|cls)(, )?", "", arguments)
    return f"({arguments})" + (f" -> {ast.unparse(function.returns)}" if function.returns else "")


@lru_cache
def _tree(module: str) -> ast.Module:
    path = SOURCE / module.replace(".", "/")
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(file.read_text(encoding="utf-8"))


def _definition(module: str, name: str) -> tuple[ast.stmt, str]:
    """The statement that defines a name, and its docstring (of a value, the text after it)."""
    body = _tree(module).body
    for number, node in enumerate(body):
        if isinstance(node, ast.ClassDef | _Function) and node.name == name and not _is_overload(node):
            return node, ast.get_docstring(node) or ""
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        if any(isinstance(target, ast.Name) and target.id == name for target in targets):
            after = body[number + 1] if number + 1 < len(body) else None
            said = after.value.value if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) else ""
            return node, str(said)
    raise LookupError(f"{module} does not define {name}")


def _is_overload(node: ast.ClassDef | _Function) -> bool:
    return any(ast.unparse(decorator) == "overload" for decorator in node.decorator_list)


def _members(module: str, made: ast.ClassDef) -> Iterator[str]:
    """Fields that the docstring does not name, then methods, of a class and of its bases in the same module."""
    documented = set(_types(made)) & set(re.findall(r"^    ([\w, ]+): ", ast.get_docstring(made) or "", re.MULTILINE))
    classes = [made]
    for base in made.bases:
        root = base.value if isinstance(base, ast.Subscript) else base
        bases = [n for n in _tree(module).body if isinstance(n, ast.ClassDef) and ast.unparse(root) == n.name]
        classes += bases
    rows, methods = [], []
    for node in (node for one in classes for node in one.body):
        if isinstance(node, ast.AnnAssign):
            if ast.unparse(node.target).startswith("_") or ast.unparse(node.target) in documented:
                continue
            rows.append(f"* `{ast.unparse(node.target)}`: `{ast.unparse(node.annotation)}`")
        elif isinstance(node, _Function) and not node.name.startswith("_"):
            kinds = {ast.unparse(decorator) for decorator in node.decorator_list}
            if kinds & {"property", "cached_property", "functools.cached_property"}:
                rows.append(f"* `{node.name}`: {_first_words(node)}")
            elif ast.get_docstring(node):
                kind = "\n:classmethod:" if "classmethod" in kinds else ""
                line = signature(node, method="staticmethod" not in kinds)
                methods.append(
                    f"````{{py:method}} {node.name}{line}{kind}\n\n{_markdown(ast.get_docstring(node))}\n````"
                )
    if rows:
        yield "**Fields**\n\n" + "\n".join(rows)
    yield from methods


def _first_words(function: _Function) -> str:
    words = (ast.get_docstring(function) or "").split("\n\n")[0].replace("\n", " ")
    return words or (f"`{ast.unparse(function.returns)}`" if function.returns else "")


def _types(made: ast.ClassDef) -> dict[str, str]:
    """The annotated fields of a class."""
    fields = (node for node in made.body if isinstance(node, ast.AnnAssign))
    return {ast.unparse(node.target): ast.unparse(node.annotation) for node in fields}


def _markdown(docstring: str | None, types: Mapping[str, str] | None = None) -> str:
    """A docstring as Markdown: its sections of arguments, returns and errors become lists; fields get their types."""
    kinds = {name: f" (`{kind}`)" for name, kind in (types or {}).items()}
    parts = _SECTION.split(inspect.cleandoc(docstring or ""))
    made = [parts[0].strip()]
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        lead, *pairs = _ENTRY.split(body if body.startswith("\n") else f"\n    {body}")
        lines = [f"**{_TITLES.get(title, title)}**" + (f": {_joined(lead)}" if lead.strip() else ""), ""]
        lines += [
            f"* `{name}`{kinds.get(name, '')}: {_joined(words)}"
            for name, words in zip(pairs[::2], pairs[1::2], strict=True)
        ]
        made.append("\n".join(lines))
    return "\n\n".join(made)


def _joined(words: str) -> str:
    return re.sub(r"\s*\n\s*", " ", words.strip())
