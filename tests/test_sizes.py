"""Files and functions are short enough to be read at once."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILE_LINES, FUNCTION_LINES = 600, 40
SOURCES = [
    path
    for package in ("edge_ident", "firmware_interface", "export", "tools")
    for path in sorted((ROOT / package).rglob("*.py"))
]
FIRMWARE = [
    path
    for folder in ("reference_firmware", "hdl")
    for kind in ("*.[chv]", "*.cpp")
    for path in sorted((ROOT / "firmware_interface" / folder).rglob(kind))
]
C_FUNCTION = re.compile(r"\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)


def function_lengths(tree: ast.Module) -> dict[str, int]:
    """Lines of each function, its docstring left out."""
    lengths = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first, lines = node.body[0], node.end_lineno - node.lineno + 1
            if ast.get_docstring(node) is not None:
                lines -= first.end_lineno - first.lineno + 1
            lengths[node.name] = max(lines, lengths.get(node.name, 0))
    return lengths


def test_files_are_short() -> None:
    every = [*SOURCES, *FIRMWARE]
    lengths = {str(path): len(path.read_text("utf-8").splitlines()) for path in every}
    assert not {path: lines for path, lines in lengths.items() if lines > FILE_LINES}


def test_functions_are_short() -> None:
    long = {}
    for path in SOURCES:
        for name, lines in function_lengths(ast.parse(path.read_text("utf-8"))).items():
            if lines > FUNCTION_LINES:
                long[f"{path}: {name}"] = lines
    assert not long


def test_functions_of_the_firmware_are_short() -> None:
    bodies = [(p, body) for p in FIRMWARE for body in C_FUNCTION.findall(p.read_text("utf-8"))]
    assert len(bodies) > 100
    assert not [str(path) for path, body in bodies if body.count("\n") > FUNCTION_LINES]
