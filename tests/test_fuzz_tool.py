"""tools/fuzz.py: what it makes of a fuzzer's end."""

import base64
from pathlib import Path

import pytest

from tools import fuzz


def program(folder: Path, script: str) -> Path:
    """A stand-in for a fuzzer, where the tool would have built it."""
    path = folder / "gcc" / "covered" / "fuzz"
    path.parent.mkdir(parents=True)
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return path


def test_a_finding_is_told_with_the_way_to_have_it_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = 'echo "broken: $FUZZ_TARGET" >&2; printf again >"${4#*=}crash-1"; exit 134'
    assert fuzz.fuzzed(program(tmp_path, script), "plays", 1.0, tmp_path, 7)
    said = capsys.readouterr().out
    assert "plays: FOUND, exit code 134\nbroken: plays" in said
    assert f"echo {base64.b64encode(b'again').decode()} | base64 -d >input" in said
    assert "FUZZ_TARGET=plays build/sanitized/fuzz input" in said


def test_what_is_new_is_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The folder for new inputs comes before the corpus."""
    script = 'touch "$5/1" "$5/2"; echo "812 inputs, 9 edges; nothing found"'
    assert not fuzz.fuzzed(program(tmp_path, script), "store", 1.0, tmp_path, 7)
    assert capsys.readouterr().out == "store: 812 inputs, 9 edges, 2 new\n"


def test_sequences_grow_longer_until_the_time_is_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    waits = program(tmp_path, "[ $1 = 7 ] && exec sleep 60; echo depth $1")
    clock = iter([0.0, 0.0, 0.0, 0.0, 59.9])
    with monkeypatch.context() as patched:
        patched.setattr(fuzz.time, "monotonic", lambda: next(clock))
        assert not fuzz.explored(waits, 60.0)
    assert capsys.readouterr().out == "sequences: depth 6\n"
    waits.write_text("#!/bin/sh\necho after: ENABLE >&2; exit 134\n")
    assert fuzz.explored(waits, 60.0)
    assert "after: ENABLE" in capsys.readouterr().out


def test_without_clang_the_own_loop_fuzzes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert not fuzz.has_libfuzzer(tmp_path)
