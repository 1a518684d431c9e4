"""The command line goes through the doors: the public API, report and commissioning."""

import ast
from pathlib import Path

import pytest

import edge_ident

COMMANDS = sorted((Path(edge_ident.__file__).parent / "cli").glob("*.py"))
DOORS = {
    "edge_ident",
    "edge_ident.commissioning",
    "edge_ident.errors",
    "edge_ident.report",
    "edge_ident.support.atomic_files",
    "edge_ident.support.interrupts",
    "edge_ident.support.streams",
}


def imported(tree: ast.AST) -> set[str]:
    """Modules of this project that a file imports, in functions too."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    return {name for name in names if name.split(".")[0] in ("edge_ident", "firmware_interface")}


@pytest.mark.parametrize("file", COMMANDS, ids=lambda file: file.stem)
def test_a_command_imports_doors_alone(file: Path) -> None:
    found = imported(ast.parse(file.read_text(encoding="utf-8")))
    inside = {name for name in found if name.startswith("edge_ident.cli")}
    assert found - inside <= DOORS


@pytest.mark.parametrize("file", COMMANDS, ids=lambda file: file.stem)
def test_what_a_command_takes_from_a_door_is_offered_there(file: Path) -> None:
    """`edge_ident.NAME` and `commissioning.NAME` are names that the door lists."""
    from edge_ident import commissioning, report

    doors = {"edge_ident": edge_ident, "commissioning": commissioning, "report": report}
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            door = doors.get(node.value.id)
            assert door is None or node.attr in door.__all__, ast.unparse(node)
