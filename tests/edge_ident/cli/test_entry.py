"""The script from its first moment on: signals, completion, version."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.processes import stop

COMMAND = [sys.executable, "-m", "edge_ident"]
SLOW_START = (
    # stands for slow imports: the command line is loaded after ten seconds
    "import sys, time, types\n"
    "class Slow:\n"
    "    def find_spec(self, name, *rest):\n"
    "        if name == 'edge_ident.cli':\n"
    "            print('loading', flush=True); time.sleep(10)\n"
    "sys.meta_path.insert(0, Slow())\n"
    "from edge_ident.__main__ import main\n"
    "sys.argv = ['edge-ident', '--version']\n"
    "main()\n"
)


def complete(shell: str, line: str) -> str:
    """What a shell gets when it asks for the completion of a line, in typer's protocol."""
    words = line.split(" ")
    environment = {
        "_EDGE_IDENT_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
        "_TYPER_COMPLETE_ARGS": line,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    done = subprocess.run(
        COMMAND, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    return done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_finds_commands(shell: str) -> None:
    begun = complete(shell, "edge-ident id")
    assert "identify" in begun
    assert "diagnose" not in begun


def test_completion_finds_options_and_commands_of_a_group() -> None:
    """Of any shell: what can stand there is found before it is put in the shell's form."""
    assert "--network" in complete("bash", "edge-ident identify --net")
    assert "rollback" in complete("bash", "edge-ident gains ro")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell_is_printed(shell: str) -> None:
    environment = os.environ | {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [*COMMAND, "--show-completion", shell],
        env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert f"_EDGE_IDENT_COMPLETE=complete_{shell}" in done.stdout
    assert "edge-ident" in done.stdout
    asked = os.environ | {"_EDGE_IDENT_COMPLETE": f"source_{shell}"}
    again = subprocess.run(COMMAND, env=asked, capture_output=True, text=True, check=True)
    assert again.stdout.strip() == done.stdout.strip()


def test_the_version_is_printed() -> None:
    import edge_ident

    done = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"edge-ident {edge_ident.__version__}\n"


@pytest.mark.parametrize(("given", "threads"), [(None, "1"), ("3", "3")])
def test_numpy_has_one_thread_unless_more_are_asked_for(given: str | None, threads: str) -> None:
    """It is told before it is loaded."""
    asked = (
        "import os, sys\n"
        "from edge_ident.__main__ import main\n"
        "class Loading:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'numpy': print(os.environ.get('OMP_NUM_THREADS'), flush=True)\n"
        "sys.meta_path.insert(0, Loading())\n"
        "sys.argv = ['edge-ident', 'identify', 'none.csv']\n"
        "main()\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    environment |= {"OMP_NUM_THREADS": given} if given else {}
    done = subprocess.run(
        [sys.executable, "-c", asked], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout == f"{threads}\n"


@contextmanager
def started(ignoring: bool = False) -> Iterator["subprocess.Popen[str]"]:
    """A process whose command line is still loading; it ends with the test."""
    how = signal.SIG_IGN if ignoring else signal.SIG_DFL
    with subprocess.Popen(
        [sys.executable, "-c", SLOW_START],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, how) and None,
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "loading\n"
            yield process
        finally:
            stop(process)


def test_little_is_loaded_before_the_signals_are_handled() -> None:
    """Ctrl-C before that gives Python's traceback."""
    code = "import sys; import edge_ident.support.process; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path = {sys.path!r}; {code}"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    loaded = set(done.stdout.split())
    assert not loaded & {"typing", "threading", "logging", "typer", "numpy"}


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_modules_load_ends_with_130_and_no_traceback(ending: signal.Signals) -> None:
    with started() as process:
        process.send_signal(ending)
        output, errors = process.communicate(timeout=60)
    assert (process.returncode, output, errors) == (130, "", "interrupted\n")


def test_a_background_job_that_ignores_ctrl_c_goes_on() -> None:
    with started(ignoring=True) as process:
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 130


def test_an_import_that_an_interrupt_breaks_is_an_interrupt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A C extension turns KeyboardInterrupt into ImportError while it loads."""
    from edge_ident.cli.command import INTERRUPTION, failure_of
    from edge_ident.support import process

    broken = ImportError("initialization failed")
    assert failure_of(broken) is None
    monkeypatch.setattr(process, "_received", [signal.SIGINT])
    assert failure_of(broken) is INTERRUPTION
