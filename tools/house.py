"""How large the project is: files, code, comments, imports, words, and what one path loads.

    python -m tools.house

Code lines are those that are neither blank nor comment nor docstring.
"""

import ast
import io
import subprocess
import sys
import tokenize
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
LOADED = """
import sys
import edge_ident
edge_ident.identify(edge_ident.simulate(), diagnose=False)
print(sum(name.startswith("edge_ident.") for name in sys.modules))
"""


class Size(NamedTuple):
    """Of a package."""

    files: int
    code: int
    comments: int
    imports: int


def main() -> None:
    """Print the table."""
    for package in ("edge_ident", "firmware_interface", "export", "tools", "tests"):
        size = _size(sorted((ROOT / package).rglob("*.py")))
        print(
            f"{package}: {size.files} files, {size.code} code lines, "
            f"{100 * size.comments / size.code:.1f} comments and "
            f"{100 * size.imports / size.code:.1f} lines of imports in a hundred"
        )
    loaded = subprocess.run(
        [sys.executable, "-c", LOADED], capture_output=True, text=True, check=True, cwd=ROOT
    )
    print(f"one identify without a diagnosis loads {loaded.stdout.strip()} modules of edge_ident")
    print(f"README: {_words([ROOT / 'README.md'])} words")
    print(f"docs: {_words((ROOT / 'docs').glob('*.md'))} words")


def _size(files: list[Path]) -> Size:
    sizes = [_of_file(file.read_text("utf-8")) for file in files]
    return Size(len(files), *map(sum, zip(*sizes, strict=True)))


def _of_file(text: str) -> tuple[int, int, int]:
    """Lines of code, comments, and lines of imports."""
    skipped: set[int] = set()
    imports: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        lines = range(getattr(node, "lineno", 0), (getattr(node, "end_lineno", 0) or 0) + 1)
        if isinstance(node, ast.Import | ast.ImportFrom):
            imports.update(lines)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            skipped.update(lines)  # a docstring, or one below a constant
    code: set[int] = set()
    comments = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            comments += 1
        elif token.string.strip():
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - skipped), comments, len(imports)


def _words(pages: Iterable[Path]) -> int:
    return sum(len(page.read_text("utf-8").split()) for page in pages)


if __name__ == "__main__":
    main()
