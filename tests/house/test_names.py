"""Bare names are SI; a unit worn in a name is seen only at the doors."""

import ast

from looking import dotted, functions, modules, parsed

from cdhr_host.units import SUFFIXES

DOORS = ("cdhr_host.cli", "cdhr_host.report", "cdhr_host.console", "cdhr_host.drives", "cdhr_host.units")
INNER = (
    "cdhr_host.mechanism",
    "cdhr_host.motion",
    "cdhr_host.extrusion",
    "cdhr_host.plant",
    "cdhr_host.values",
)
WORN = tuple(suffix for suffix in SUFFIXES if suffix not in {"_n", "_s", "_counts"})
"""Suffixes that are no plain word or index: ``_n`` and ``_s`` end too many honest names."""


def _public_names(path: object) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.ClassDef):
            names |= {
                item.target.id
                for item in node.body
                if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
            }
    for function in functions(path):
        names.add(function.name)
        names |= {argument.arg for argument in function.args.args + function.args.kwonlyargs}
    return {name for name in names if not name.startswith("_")}


def test_inner_rooms_speak_si() -> None:
    worn = {
        f"{dotted(path)}: {name}"
        for path in modules()
        if dotted(path).startswith(INNER)
        for name in _public_names(path)
        if name.endswith(WORN)
    }
    assert not worn
