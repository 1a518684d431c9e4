"""The pages build as a site: strict about links, with search and the docstrings of the API."""

import subprocess
import sys
from pathlib import Path

import pytest

import edge_ident

ROOT = Path(__file__).parents[1]
for package in ("sphinx", "myst_parser", "furo"):
    pytest.importorskip(package, reason="needs the extra docs: pip install -e '.[docs]'")


def build(source: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """A warning is an error."""
    strict = ("-q", "-W", "--keep-going", "-c", ROOT / "docs")
    return subprocess.run(
        [sys.executable, "-m", "sphinx", *strict, source, folder],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from this checkout."""
    folder = tmp_path_factory.mktemp("site")
    done = build(ROOT, folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_every_page_is_in_the_site_and_in_its_search(site: Path) -> None:
    index = (site / "searchindex.js").read_text("utf-8")
    for page in (ROOT / "docs").rglob("*.md"):
        name = page.relative_to(ROOT).with_suffix("").as_posix()
        assert (site / f"{name}.html").is_file()
        assert f'"{name}"' in index


def test_every_public_name_has_its_docstring_there(site: Path) -> None:
    page = (site / "docs" / "api.html").read_text("utf-8")
    for name in edge_ident.__all__:
        if not name.startswith("_"):
            assert f'id="edge_ident.{name}"' in page, name


def test_the_site_fetches_nothing(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text("utf-8")
        assert 'src="http' not in text, page
        assert 'rel="stylesheet" type="text/css" href="http' not in text, page


def test_an_anchor_that_leads_nowhere_ends_the_build(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "README.md").write_text("# One\n\n[two](#nowhere)\n")
    done = build(tmp_path, tmp_path / "out")
    assert done.returncode != 0
    assert "nowhere" in done.stderr
