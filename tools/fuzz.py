"""Fuzz the C firmware, guided by what its inputs reach: for a minute, or for an hour.

    python -m tools.fuzz --minutes 60

libFuzzer changes the inputs where clang and its runtime are installed (Debian: clang and
libclang-rt-14-dev), the project's own loop where they are not (gcc). Both know the targets of
simulated/fuzz_targets.c and begin with the corpus of the tests. What must hold stands in
simulated/fuzz_invariants.c; AddressSanitizer and UBSan watch as well. A finding is printed, with
the way to have it again, and ends with exit code 1. Part of the time simulated/explore.c tries
every sequence of operations, longer and longer ones.

`--merge` puts what the run reached into the corpus, as few and as short inputs as that takes.
"""

import argparse
import base64
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FIRMWARE: Final = ROOT / "firmware_interface" / "reference_firmware"
CORPUS: Final = ROOT / "tests" / "firmware_interface" / "corpus"
SHARES: Final = {"frames": 1, "plays": 4, "store": 1, "values": 2}
"""Of the time, by target."""
EXPLORING: Final = 2
"""The same, of the sequences of operations."""
_SHORTEST, _LONGEST = 4, 12
LONGEST_INPUT: Final = 1024
_SANITIZERS: Final = {"ASAN_OPTIONS": "abort_on_error=1", "UBSAN_OPTIONS": "abort_on_error=1"}
_NOTHING: Final = "int LLVMFuzzerTestOneInput(const char *b, long n) { return b && n > 9; }"


def main() -> int:
    """Fuzz every target, and say what came of it."""
    options = _parsed()
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        clang = not options.own and has_libfuzzer(work)
        program = built(work / ("clang" if clang else "gcc"), clang=clang)
        print(f"fuzzing with {'libFuzzer' if clang else 'the own loop'}, seed {options.seed}")
        share_s = options.minutes * 60.0 / (sum(SHARES.values()) + EXPLORING)
        found = [
            fuzzed(program, target, share * share_s, work, options.seed)
            for target, share in SHARES.items()
        ]
        found.append(explored(program.parents[1] / "explore", EXPLORING * share_s))
        if options.merge:
            merge(built(work / "gcc", clang=False), work)
    return 1 if any(found) else 0


def _parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n", 1)[0])
    parser.add_argument("--minutes", type=float, default=1.0, help="of all targets together")
    parser.add_argument("--own", action="store_true", help="the own loop, also where clang is")
    parser.add_argument("--merge", action="store_true", help="put what was reached into the corpus")
    parser.add_argument(
        "--seed", type=int, default=int.from_bytes(os.urandom(3)) + 1, help="of the changes"
    )
    return parser.parse_args()


def has_libfuzzer(work: Path) -> bool:
    """Whether clang is there, with its runtime."""
    if shutil.which("clang") is None:
        return False
    command = ["clang", "-fsanitize=fuzzer,address", "-x", "c", "-", "-o", str(work / "nothing")]
    tried = subprocess.run(command, input=_NOTHING, text=True, capture_output=True, check=False)
    return tried.returncode == 0


def built(folder: Path, *, clang: bool) -> Path:
    """The fuzzer, built into a folder."""
    make = ["make", "-s", "-j2", "-C", str(FIRMWARE), f"BUILD={folder}", "fuzz", "explore"]
    subprocess.run([*make, "CC=clang"] if clang else make, check=True)
    return folder / "covered" / "fuzz"


def fuzzed(program: Path, target: str, seconds: float, work: Path, seed: int) -> bool:
    """Fuzz a target; True where something was found."""
    new, found = work / "new" / target, work / "found" / target
    new.mkdir(parents=True)
    found.mkdir(parents=True)
    corpus = CORPUS / target
    command = [
        str(program), f"-max_total_time={max(round(seconds), 1)}", f"-seed={seed}",
        f"-max_len={LONGEST_INPUT}", f"-artifact_prefix={found}/",
    ]  # fmt: skip
    if program.parent.parent.name == "clang":
        command += ["-len_control=0", "-timeout=60", "-verbosity=0", "-print_final_stats=1"]
    environment = {**os.environ, **_SANITIZERS, "FUZZ_TARGET": target}
    ran = subprocess.run(
        [*command, str(new), *([str(corpus)] if corpus.is_dir() else [])],
        env=environment, text=True, capture_output=True, check=False, errors="replace",
    )  # fmt: skip
    if ran.returncode == 0:
        print(f"{target}: {_summary(ran.stdout + ran.stderr)}, {len(list(new.iterdir()))} new")
        return False
    print(f"{target}: FOUND, exit code {ran.returncode}\n{(ran.stdout + ran.stderr)[-4000:]}")
    for file in sorted(found.iterdir()):
        text = base64.b64encode(file.read_bytes()).decode()
        print(
            f"again: echo {text} | base64 -d >input; make -C {FIRMWARE.relative_to(ROOT)} sanitized"
        )
        print(f"       FUZZ_TARGET={target} build/sanitized/fuzz input")
    return True


def explored(program: Path, seconds: float) -> bool:
    """Try longer and longer sequences of operations; True where one breaks something."""
    said, end_s = "nothing, for there was no time", time.monotonic() + seconds
    for depth in range(_SHORTEST, _LONGEST + 1):
        left_s = max(end_s - time.monotonic(), 0.0)
        command = [str(program), str(depth)]
        try:
            ran = subprocess.run(
                command, timeout=left_s, text=True, capture_output=True, check=False
            )
        except subprocess.TimeoutExpired:
            break
        if ran.returncode:
            print(f"sequences: FOUND\n{ran.stderr}")
            return True
        said = ran.stdout.strip()
    print(f"sequences: {said}")
    return False


def _summary(output: str) -> str:
    """How many inputs ran."""
    for line in output.splitlines():
        if "number_of_executed_units" in line:
            return f"{line.split()[-1]} inputs"
        if " inputs, " in line:
            return line.split(";")[0]
    return output[-200:]


def merge(program: Path, work: Path) -> None:
    """Keep of corpus and new inputs what is needed to reach all that they reach."""
    for target in SHARES:
        fewest = work / "merged" / target
        fewest.mkdir(parents=True)
        given = [folder for folder in (CORPUS / target, work / "new" / target) if folder.is_dir()]
        subprocess.run(
            [str(program), "-merge=1", str(fewest), *map(str, given)],
            env={**os.environ, **_SANITIZERS, "FUZZ_TARGET": target}, check=True,
        )  # fmt: skip
        shutil.rmtree(CORPUS / target, ignore_errors=True)
        shutil.copytree(fewest, CORPUS / target)


if __name__ == "__main__":
    sys.exit(main())
