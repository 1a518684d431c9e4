"""What a diagnosis writes can be read again, and says the same to every command that takes it.

The residual of `diagnose` with the written model is that of the diagnosis that wrote it, within a
fiftieth or a thousandth of the effort: the parameters are fitted again. `identify` compares in a
wider band, where more noise is left; there the model must take away most of what it explains.
"""

from collections.abc import Callable
from pathlib import Path

import pytest

import edge_ident
from tests.synthetic import Synthetic, arm, carriage, motor

_SAME, _SHARE = 0.02, 1e-3


@pytest.mark.parametrize("machine", [carriage, arm, motor])
def test_a_written_model_leaves_the_same_residual_in_every_command(
    machine: Callable[[Path], Synthetic], tmp_path: Path
) -> None:
    recording = edge_ident.load_recording(machine(tmp_path).path)
    found = edge_ident.diagnose([recording])
    edge_ident.save_model(found.model, tmp_path / "model.json")
    known = edge_ident.load_model(tmp_path / "model.json")
    again = edge_ident.diagnose([recording], model=known)
    compensated = edge_ident.identify(recording, model=known, diagnose=False)
    plain = edge_ident.identify(recording, diagnose=False)
    for name, axis in found.axes.items():
        left = again.axes[name].base.fitted
        assert left == pytest.approx(axis.extended.fitted, rel=_SAME, abs=_SHARE)
        if axis.causes:
            before, after = (
                identified.axes[name].metric.relative_residual
                for identified in (plain, compensated)
            )
            assert after**2 < 0.6 * before**2
            codes = {finding.code for finding in compensated.axes[name].findings}
            assert "outside_support" not in codes, "it is the recording that supports the model"


@pytest.mark.parametrize("machine", [carriage, motor])
def test_a_written_model_can_be_simulated_along_its_recording(
    machine: Callable[[Path], Synthetic], tmp_path: Path
) -> None:
    recording = edge_ident.load_recording(machine(tmp_path).path)
    found = edge_ident.diagnose([recording])
    edge_ident.save_model(found.model, tmp_path / "model.json")
    known = edge_ident.load_model(tmp_path / "model.json")
    made = edge_ident.simulate(known, recording, effort_resolution=0.0)
    again = edge_ident.diagnose([made], model=known)
    for axis in again.axes.values():
        assert axis.base.fitted < 0.05, "the model knows what moved the simulated drive"
