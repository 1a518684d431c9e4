"""Pages in a real browser: no script error, no request, no sideways scrolling, charts enlarge."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from edge_ident.report.page.diagnosis_page import write_page
from edge_ident.report.page.rendering import Provenance
from edge_ident.report.page.run_page import write_run_page
from tests.browser import PROGRAM, Tab, opened
from tests.edge_ident.diagnosis import hand_made
from tests.edge_ident.report.page import hand_made_run, test_survey_page

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="no Chromium is installed")
LABELS = "[...document.querySelectorAll('[data-zoom] .x-ticks text')].map(t => t.textContent)"
CLICK = "document.querySelector('[data-zoom] [data-do={}]').click()"


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with opened(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    found = hand_made.diagnosis(doubtful=True, unexplained=True)
    provenance = Provenance((("monday.csv", "0" * 64),), "edge-ident diagnose monday.csv", "1.0")
    outcome, document = hand_made_run.run(folder)
    return {
        "run": write_run_page(outcome, document, folder),
        "diagnosis": write_page(found, provenance, folder / "diagnosis"),
        "survey": test_survey_page.written(
            test_survey_page.survey(8, friction=1.3, ripple=True, bad=True), folder / "survey"
        ),
    }


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("kind", ["diagnosis", "run", "survey"])
def test_a_page_opens_alone_and_fits_its_window(
    tab: Tab, pages: dict[str, Path], kind: str, width: int
) -> None:
    tab.complaints.clear()
    tab.requests.clear()
    tab.show(pages[kind], width)
    tab.value("document.querySelectorAll('details').forEach(part => { part.open = true; })")
    assert tab.value("document.documentElement.scrollWidth") == width
    clipped = "[...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth)"
    assert tab.value(f"{clipped}.map(e => e.getAttribute('aria-label')).join()") == ""
    assert tab.complaints == []
    assert tab.requests == [pages[kind].as_uri()]
    assert tab.value("getComputedStyle(document.body).margin") == "0px"  # the style is in force


def test_a_picture_is_enlarged_and_goes_back(tab: Tab, pages: dict[str, Path]) -> None:
    tab.show(pages["diagnosis"], 1280)
    whole = tab.value(LABELS)
    tab.value(CLICK.format("in"))
    assert tab.value("document.querySelector('[data-zoom] output').textContent") == "2.50 to 7.50 s"
    assert tab.value(LABELS) != whole
    tab.value(CLICK.format("all"))
    assert [float(text) for text in tab.value(LABELS)] == [float(text) for text in whole]


def test_curves_and_ticks_of_a_chart_stand_in_one_place(tab: Tab, pages: dict[str, Path]) -> None:
    """The plot is stretched, ticks stand in percent: both must mean the same place."""
    tab.show(pages["run"], 1280)
    box = "document.querySelector('svg.chart {}').getBoundingClientRect()"
    plot, line = (f"{box.format(part)}" for part in ("svg.plot", ".x-ticks line"))
    assert tab.value(f"{plot}.width") > 300
    assert abs(tab.value(f"{plot}.left - {line}.left")) < 1.0  # time zero is the first tick
