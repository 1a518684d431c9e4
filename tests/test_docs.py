"""The pages a person reads: links, paths, functions and commands that they name exist."""

import ast
import importlib.util
import re
import shlex
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest
import typer

from edge_ident.cli import app

ROOT: Final = Path(__file__).parents[1]
PAGES: Final = (*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")))
GENERATED: Final = ("commands.md", "effects.md", "registers.md", "paper.md")
LONGEST_LINE: Final = 110
_LINK: Final = re.compile(r"\[([^\]]*)\]\(([^)\s]+)\)")
FENCE: Final = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
_SPAN: Final = re.compile(r"`([^`\n]+)`")
_PATH: Final = re.compile(r"[\w*./-]+\.(?:py|c|h|toml)|(?:[a-z_]+/)+[\w*.]*")
_ROOTS: Final = ("edge_ident/", "export/", "firmware_interface/", "tests/", "tools/", "docs/")
_MODULE: Final = re.compile(r"(?:edge_ident|firmware_interface|export|tools)(?:\.\w+)+")
_ALONE: Final = re.compile(r"(--[a-z][a-z-]*|-o)\b")

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def prose(page: Path) -> str:
    return FENCE.sub("", page.read_text("utf-8"))


def whole_lines(page: Path) -> str:
    """The text of a page; what goes on after a backslash is one line."""
    return re.sub(r"\\\n *", "", page.read_text("utf-8"))


def spans(page: Path) -> list[str]:
    return _SPAN.findall(prose(page))


@cache
def files() -> tuple[str, ...]:
    """What the repository holds; what a build leaves beside it is no part of it."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return tuple(name for name in listed.stdout.split() if (ROOT / name).is_file())


@cache
def anchors(page: Path) -> frozenset[str]:
    """The headings of a page, as GitHub makes links of them."""
    titles = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    kept = (re.sub(r"[^\w\- ]", "", _LINK.sub(r"\1", title).lower()) for title in titles)
    return frozenset(title.replace(" ", "-") for title in kept)


@pages
def test_every_relative_link_resolves(page: Path) -> None:
    for _, target in _LINK.findall(prose(page)):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.exists(), f"{page.name}: {target}"
        if anchor and linked.suffix == ".md":
            assert anchor in anchors(linked), f"{page.name}: {target}"


@pages
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    for span in filter(_PATH.fullmatch, spans(page)):
        if span.startswith(_ROOTS) or span.endswith((".py", ".c", ".h")):
            found = "*" in span and any(ROOT.glob(span))
            found = found or any(_lies_at(file, span.rstrip("/")) for file in files())
            assert found, f"{page.name}: {span}"


def _lies_at(file: str, path: str) -> bool:
    """Whether a file is this one, or lies in this folder; its first folders may be left out."""
    return f"/{file}".endswith(f"/{path}") or f"/{path}/" in f"/{file}"


@pages
def test_every_module_that_a_page_names_exists(page: Path) -> None:
    for span in spans(page):
        if _MODULE.fullmatch(span) and not _resolves(span):
            raise AssertionError(f"{page.name}: {span}")


def _resolves(dotted: str) -> bool:
    """Whether this is a module, or a name in one."""
    parent, _, last = dotted.rpartition(".")
    if importlib.util.find_spec(parent) is None:
        return False
    module = importlib.import_module(parent)
    return hasattr(module, last) or importlib.util.find_spec(dotted) is not None


# ---- functions that a link's text names


@cache
def defined(path: Path) -> frozenset[str]:
    """Functions, classes, `Class.method` and constants of a Python file; words of any other."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return frozenset(re.findall(r"\w+", text))
    tree = ast.parse(text)
    return frozenset(_names(tree.body, ""))


def _names(body: list[ast.stmt], prefix: str) -> Iterator[str]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield prefix + node.name
            if isinstance(node, ast.ClassDef):
                yield from _names(node.body, f"{node.name}.")
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign):
            targets = [node.target]
        yield from (prefix + target.id for target in targets if isinstance(target, ast.Name))


@pages
def test_what_a_link_to_code_names_stands_in_that_file(page: Path) -> None:
    for text, target in _LINK.findall(prose(page)):
        linked = (page.parent / target.partition("#")[0]).resolve()
        for name in _SPAN.findall(text):
            if re.fullmatch(r"[\w.]+", name) and linked.is_file() and name != linked.name:
                assert name in defined(linked), f"{page.name}: [{text}]({target})"


@pytest.mark.parametrize("row", re.findall(r"^\| .+ \|$", prose(ROOT / "docs/glossary.md"), re.M))
def test_what_the_glossary_says_of_the_code_is_in_the_code(row: str) -> None:
    for name in _SPAN.findall(row.rsplit("|", 2)[1]):
        assert name in _words_of_the_code(), name


@cache
def _words_of_the_code() -> frozenset[str]:
    code = [name for name in files() if name.endswith((".py", ".toml"))]
    code = [name for name in code if not name.startswith("tests/")]
    return frozenset(
        word for name in code for word in re.findall(r"\w+", (ROOT / name).read_text("utf-8"))
    )


# ---- commands


@cache
def commands() -> dict[str, frozenset[str]]:
    """Options of every command, by its full name; those of a group by the group's."""
    return dict(_commands(typer.main.get_command(app), ""))


def _commands(command: Any, name: str) -> Iterator[tuple[str, frozenset[str]]]:
    options = {text for one in command.params for text in (*one.opts, *one.secondary_opts)}
    below = getattr(command, "commands", {})
    for verb, sub in below.items():
        yield from _commands(sub, f"{name} {verb}".strip())
    if "design" in below:  # `gains FILE` is short for `gains design FILE`
        options |= commands_of(below["design"])
    yield name, frozenset(options | {"--help"})


def commands_of(command: Any) -> set[str]:
    return {text for one in command.params for text in one.opts}


def named_commands(page: Path) -> Iterator[list[str]]:
    """Command lines of a page, as words: those in its blocks and those in its sentences."""
    blocks = "\n".join(FENCE.findall(whole_lines(page)))
    for line in blocks.splitlines():
        for part in line.split("&&"):
            if re.match(r"\s*(?:\$ )?(?:\S*/)?edge-ident ", part):
                # a remark stands two blanks behind its command
                yield _words(re.split(r"edge-ident ", part, maxsplit=1)[1].split("  ")[0])
    for span in spans(page):
        if span.startswith("edge-ident "):
            yield _words(span.removeprefix("edge-ident "))


def _words(text: str) -> list[str]:
    return shlex.split(text.replace("…", " ").replace("'", " "))


@pages
def test_every_command_that_a_page_names_exists_with_its_options(page: Path) -> None:
    for words in named_commands(page):
        # an option in the command's place belongs to all commands
        name = "" if words[0].startswith("-") else words[0].rstrip(",")
        assert name in commands() or name.isupper(), f"{page.name}: edge-ident {name}"
        verbs = [
            word.rstrip(",") for word in words[1:] if f"{name} {word.rstrip(',')}" in commands()
        ]
        allowed = commands()[f"{name} {verbs[0]}" if verbs else name]
        for word in words[1:]:
            option = _ALONE.match(word)
            assert not option or option[0] in allowed, f"{page.name}: {' '.join(words)}"


# ---- the set of pages


def test_the_index_lists_every_page() -> None:
    linked = {
        target.partition("#")[0] for _, target in _LINK.findall(prose(ROOT / "docs/README.md"))
    }
    assert {page.name for page in PAGES if page.parent == ROOT / "docs"} - {"README.md"} <= linked


@pytest.mark.parametrize(
    "page", [p for p in PAGES if p.name not in GENERATED], ids=lambda p: p.name
)
def test_lines_of_prose_fit_an_editor(page: Path) -> None:
    long = [line for line in prose(page).splitlines() if len(line) > LONGEST_LINE]
    assert [line for line in long if not line.lstrip().startswith(("|", "!["))] == []


@pages
def test_every_row_of_a_table_has_the_cells_of_its_head(page: Path) -> None:
    for table in re.findall(r"(?:^\|.*\|$\n?)+", prose(page), re.MULTILINE):
        head, *rows = (len(re.split(r"(?<!\\)\|", row)) for row in table.splitlines())
        assert set(rows) == {head}, f"{page.name}: {table.splitlines()[0]}"
