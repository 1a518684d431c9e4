"""The waterfall of a latency profile, in the terminal and as a picture."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from edge_ident.commissioning.latency import Profile, ProfileRun
from edge_ident.report.machine import bar_texts, bars, save_waterfall

STAGES = {"signals": [4.0, 4.0, 8.0], "network": [2.0, 2.0, 2.0], "gains": [6.0, 6.0, 12.0]}
RUN = ProfileRun("warm", "fp32", "rank_one", {**STAGES, "total": [12.0, 12.0, 22.0]})
SVG = "{http://www.w3.org/2000/svg}"


def test_each_stage_begins_where_the_median_of_the_last_ends() -> None:
    assert [bar.stage for bar in bars(RUN)] == ["signals", "network", "gains"]
    assert [bar.begin_ms for bar in bars(RUN)] == [0.0, 4.0, 6.0]


def test_the_terminal_draws_the_median_dark_and_the_rest_light() -> None:
    signals, network, gains = bar_texts(RUN)
    assert signals.strip("█") == "░" * signals.count("░") != ""
    assert network.strip("█ ") == ""
    assert len(gains) > len(network) > len(signals.rstrip("░"))
    assert gains.count("█") == pytest.approx(gains.count("░"), abs=1)
    assert gains.index("█") == network.rindex("█") + 1


def test_the_picture_has_every_stage_of_every_run(tmp_path: Path) -> None:
    file = tmp_path / "profile.svg"
    save_waterfall(Profile("a <board>", "here", 3, 1.0, 300.0, (RUN, RUN)), file)
    root = ElementTree.parse(file).getroot()
    medians = [r for r in root.iter(f"{SVG}rect") if r.get("class") == "median"]
    assert len(medians) == 6
    first, second, _ = medians[:3]
    assert float(first.get("x", 0)) + float(first.get("width", 0)) == pytest.approx(
        float(second.get("x", 0)), abs=0.2
    )
    assert "12.0 ms in the median" in "".join(root.itertext())
