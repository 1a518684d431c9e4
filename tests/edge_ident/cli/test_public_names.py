"""The command line uses public names alone: of edge_ident, of report and of commissioning."""

import ast
from pathlib import Path

import pytest

import edge_ident

COMMANDS = sorted((Path(edge_ident.__file__).parent / "cli").glob("*.py"))
PUBLIC = {
    "edge_ident",
    "edge_ident.commissioning",
    "edge_ident.errors",
    "edge_ident.report",
    "edge_ident.support.documents",
    "edge_ident.support.console",
    "edge_ident.support.next_step",
    "edge_ident.support.process",
    "edge_ident.support.stopwatch",
    "edge_ident.support.words",
}


def imported(tree: ast.AST) -> set[str]:
    """Modules of this project that a file loads, in functions too; not those of types alone."""
    names = set()
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
        names |= imported(node)
    return {name for name in names if name.split(".")[0] in ("edge_ident", "firmware_interface")}


@pytest.mark.parametrize("file", COMMANDS, ids=lambda file: file.stem)
def test_a_command_imports_public_packages_alone(file: Path) -> None:
    found = imported(ast.parse(file.read_text(encoding="utf-8")))
    inside = {name for name in found if name.startswith("edge_ident.cli")}
    assert found - inside <= PUBLIC


@pytest.mark.parametrize("file", COMMANDS, ids=lambda file: file.stem)
def test_what_a_command_takes_from_a_package_is_offered_there(file: Path) -> None:
    """`edge_ident.NAME` is a name that the package lists."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            of_api = node.value.id == "edge_ident"
            assert not of_api or node.attr in edge_ident.__all__, ast.unparse(node)
