"""Generate the API page from docstrings: `python -m tools.pages.api > docs/api.md`.

The sources are parsed, not imported. A package documents the names in its `__all__`; without one, everything public in
the modules that its docstring names.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("client", "motion")

INTRODUCTION = """\
# API

Made from docstrings by `python -m tools.pages.api`; a test keeps this page equal to the code. J is the number of
joints. Arrays are of float64; their shapes are in the docstrings. `m` stands for `client.messages`, whose fields
[protocol.md](protocol.md) lists: `m.Waypoint(time_from_start=0.5, positions=[…])`.
"""

MARGIN = 100
"""Longest signature, characters, that stays on one line."""

DECORATORS = ("staticmethod", "classmethod", "contextmanager", "asynccontextmanager")
"""Decorators that the page shows. The client's `SyncOrAsync` makes a blocking method and its awaitable twin."""

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

_SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Yields):$", re.MULTILINE)


def page() -> str:
    """Return the whole page, Markdown."""
    parts = [INTRODUCTION]
    for package in PACKAGES:
        if (ROOT / package / "__init__.py").exists():
            parts += package_section(package)
    return "\n".join(parts)


def package_section(package: str) -> list[str]:
    """Return the sections of a package: its docstring, and one section a module."""
    parts = [f"## {package}\n", prose(parse(package, "__init__"))]
    shown: set[str] = set()
    for module, names in public(package).items():
        tree = parse(package, module)
        parts += [f"### {package}.{module}\n", prose(tree)]
        for definition in definitions(tree):
            if names is None or definition.name in names:
                parts += entry(definition)
                for base in new_bases(package, tree, definition, shown):
                    parts += methods(base)
    return parts


def public(package: str) -> dict[str, set[str] | None]:
    """Return the documented modules of a package, each with its documented names; None: all public ones."""
    tree = parse(package, "__init__")
    found: dict[str, set[str] | None]
    if exported := names_in_all(tree):
        imports = [node for node in tree.body if isinstance(node, ast.ImportFrom) and own_module(package, node)]
        found = {own_module(package, node): {each.name for each in node.names} & exported for node in imports}
    else:
        found = dict.fromkeys(re.findall(r"`(\w+)`", ast.get_docstring(tree) or ""))
    return {module: names for module, names in found.items() if (ROOT / package / f"{module}.py").exists()}


def names_in_all(tree: ast.Module) -> set[str]:
    """Return the names in a module's `__all__`, or an empty set without one."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def parse(package: str, module: str) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse((ROOT / package / f"{module}.py").read_text(encoding="utf-8"))


def definitions(node: ast.Module | ast.ClassDef) -> Iterator[Definition]:
    """Yield the public functions and classes of a module or class, in the order of the source."""
    for child in node.body:
        if isinstance(child, Definition) and not child.name.startswith("_"):
            yield child


def entry(definition: Definition) -> list[str]:
    """Return a definition's heading, declaration and docstring, and a class's methods."""
    parts = [f"#### {definition.name}\n", code(definition), prose(definition)]
    return parts + methods(definition) if isinstance(definition, ast.ClassDef) else parts


def methods(definition: ast.ClassDef) -> list[str]:
    """Return the signatures and docstrings of a class's public methods."""
    return [part for method in definitions(definition) for part in (code(method), prose(method))]


def new_bases(package: str, tree: ast.Module, definition: Definition, shown: set[str]) -> Iterator[ast.ClassDef]:
    """Yield the direct and indirect bases that belong to the package and are not yet shown; mark them as shown."""
    for base in definition.bases if isinstance(definition, ast.ClassDef) else ():
        name = ast.unparse(base).partition("[")[0]
        for origin in (tree, *imported_from(package, tree, name)):
            found = [node for node in origin.body if isinstance(node, ast.ClassDef) and node.name == name]
            if found and name not in shown:
                shown.add(name)
                yield found[0]
                yield from new_bases(package, origin, found[0], shown)


def imported_from(package: str, tree: ast.Module, name: str) -> list[ast.Module]:
    """Return the modules of the package from which a module imports a name, at most one."""
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom) and own_module(package, node)]
    return [parse(package, own_module(package, node)) for node in imports if name in {each.name for each in node.names}]


def own_module(package: str, node: ast.ImportFrom) -> str:
    """Return the name of the package's module that an import names, or an empty string for other packages."""
    prefix, _, module = (node.module or "").rpartition(".")
    return module if prefix == package and (ROOT / package / f"{module}.py").exists() else ""


def code(definition: Definition) -> str:
    """Return a definition's declaration as a code block."""
    return f"```python\n{declaration(definition)}\n```\n"


def declaration(definition: Definition) -> str:
    """Return a function's signature; for a class, that of its constructor, or its bases."""
    if isinstance(definition, ast.ClassDef):
        given = constructor(definition) or [ast.unparse(base) for base in definition.bases]
        return wrapped(f"class {definition.name}", given, "")
    decorators = [ast.unparse(decorator) for decorator in definition.decorator_list]
    returns = f" -> {ast.unparse(definition.returns)}" if definition.returns else ""
    if any(name in ("property", "cached_property") for name in decorators):
        return f"{definition.name}: {returns.removeprefix(' -> ')}"
    awaited = isinstance(definition, ast.AsyncFunctionDef) and "SyncOrAsync" not in decorators
    prefix = "async def" if awaited else "def"
    kept = [f"@{name}\n" for name in decorators if name in DECORATORS]
    return "".join(kept) + wrapped(f"{prefix} {definition.name}", arguments(definition.args), returns)


def constructor(definition: ast.ClassDef) -> list[str]:
    """Return the arguments of a class: those of `__init__`, or the fields of a dataclass or struct."""
    for child in definition.body:
        if isinstance(child, ast.FunctionDef) and child.name == "__init__":
            return arguments(child.args)
    fields = [child for child in definition.body if isinstance(child, ast.AnnAssign)]
    return [text for field in fields if "init=False" not in (text := ast.unparse(field)) and not text.startswith("_")]


def arguments(given: ast.arguments) -> list[str]:
    """Return a function's arguments as in the source, without `self` and `cls`."""
    positional = [*given.posonlyargs, *given.args]
    defaults = [*[None] * (len(positional) - len(given.defaults)), *given.defaults]
    found = [*map(_argument, positional, defaults)]
    if given.vararg:
        found.append(f"*{_argument(given.vararg)}")
    elif given.kwonlyargs:
        found.append("*")
    found += map(_argument, given.kwonlyargs, given.kw_defaults)
    if given.kwarg:
        found.append(f"**{_argument(given.kwarg)}")
    return [argument for argument in found if argument not in ("self", "cls")]


def _argument(argument: ast.arg, default: ast.expr | None = None) -> str:
    kind = f": {ast.unparse(argument.annotation)}" if argument.annotation else ""
    equals = " = " if kind else "="
    return argument.arg + kind + (f"{equals}{ast.unparse(default)}" if default else "")


def wrapped(name: str, given: list[str], returns: str) -> str:
    """Return a signature on one line, or with one line an argument if it is too long."""
    line = f"{name}({', '.join(given)}){returns}"
    if len(line) <= MARGIN:
        return line
    return f"{name}(\n" + "".join(f"    {argument},\n" for argument in given) + f"){returns}"


def prose(node: ast.Module | Definition) -> str:
    """Return a docstring as Markdown, its sections as lists."""
    text = inspect.cleandoc(ast.get_docstring(node) or "")
    head, *rest = _SECTION.split(text)
    parts = [head.strip(), *(f"{name}\n\n{_items(body)}" for name, body in zip(rest[::2], rest[1::2], strict=True))]
    return "\n\n".join(parts) + "\n"


def _items(body: str) -> str:
    """Return the indented entries of a docstring's section as a list; a continued entry becomes one line."""
    body = inspect.cleandoc(body)
    return "\n".join(f"- {' '.join(item.split())}" for item in re.split(r"\n(?=\S)", body) if item.strip())


if __name__ == "__main__":
    print(page(), end="")
