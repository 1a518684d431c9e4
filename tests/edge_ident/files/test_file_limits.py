"""Files that ask for more than a recording has: each is a bad file that names the limit.

Sources of the kinds: zip bombs, entities of entities (CVE-2003-1564), lengths that a header states.
"""

import bz2
import contextlib
import gzip
import io
import json
import shutil
import struct
import tracemalloc
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.drive.description import BUILT_IN as DESCRIPTION
from edge_ident.errors import DataError, ModelError
from edge_ident.estimation.manifest import BUILT_IN, load_manifest
from edge_ident.files.dialect import BLANKS, Dialect, split, stated_period
from edge_ident.files.reading import joined_stamps
from edge_ident.files.table import Column, Table, joint_names, split_heading, split_unknown
from edge_ident.files.units import stated_unit
from edge_ident.signals.contract_columns import parse_name
from edge_ident.signals.read_columns import role_of, unit_may_be_name
from edge_ident.support import documents
from tests.edge_ident.files.test_bags import write as write_bag
from tests.edge_ident.files.test_formats import FORMATS, Format

MOST_MEMORY_BYTES = 300_000_000
"""Far below what these files ask for."""
BINARY = [known for known in FORMATS if not known.file.endswith((".csv", ".txt"))]
DRIVE = DESCRIPTION.read_text("utf-8")
NAMES = ("time_s", "x_position_rad", "x_torque_nm")


def npy_stating(shape: str, kind: str = "<f8", content: bytes = b"") -> bytes:
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content


def npz(path: Path, shape: str, kind: str = "<f8") -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name in NAMES:
            archive.writestr(f"{name}.npy", npy_stating(shape, kind))


def huge_npz(path: Path) -> None:
    npz(path, "(100000000000,)")
    assert path.stat().st_size < 1000


def cancelling_npz(path: Path) -> None:
    """A negative length does not make room for another one's."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, length in (("a", -(10**12)), ("b", 10**12)):
            archive.writestr(f"{name}.npy", npy_stating(f"({length},)"))


def empty_texts_npz(path: Path) -> None:
    """Of no bytes each, and still numbers once they are converted."""
    npz(path, "(100000000000,)", "<U0")


def wide_texts_npz(path: Path) -> None:
    npz(path, "(10,)", "<U100000000")


def many_members_npz(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(documents.MOST_COLUMNS + 1):
            archive.writestr(f"{k}.npy", npy_stating("(0,)"))


def stating_10_gb(path: Path) -> None:
    """An archive whose directory states 10 GB for a member, as one of zeros would."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("time_s.npy", npy_stating("(3,)", content=bytes(24)))
        archive.getinfo("time_s.npy").file_size = 10**10


def sheet(path: Path, change: Callable[[str], str] = str, **more: str) -> None:
    """A workbook whose first sheet is changed as text."""
    book = openpyxl.Workbook()
    for row in (["time [s]", "angle [rad]", "torque [Nm]"], [0, 1, 2], [1, 2, 3], [2, 3, 4]):
        book.active.append(row)
    made = io.BytesIO()
    book.save(made)
    with (
        zipfile.ZipFile(made) as given,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name in given.namelist():
            text = given.read(name).decode()
            is_sheet = name == "xl/worksheets/sheet1.xml"
            archive.writestr(name, change(text) if is_sheet else more.get(name, text))


LAUGHS = "".join(
    f'<!ENTITY l{k} "{10 * f"&l{k - 1};"}">' if k else '<!ENTITY l0 "lol">' for k in range(10)
)


def laughing_sheet(path: Path) -> None:
    def laugh(text: str) -> str:
        kept = text.replace("<sheetData>", "<sheetData><row><c t='str'><v>&l9;</v></c></row>")
        return f"<!DOCTYPE lolz [{LAUGHS}]>{kept}"

    sheet(path, laugh)


def wide_rows(path: Path) -> None:
    wide = "".join(f'<row r="{k}"><c r="XFD{k}"><v>1</v></c></row>' for k in range(5, 3000))
    sheet(path, lambda text: text.replace("</sheetData>", f"{wide}</sheetData>"))


def long_number(path: Path) -> None:
    sheet(path, lambda text: text.replace("<v>3</v>", f"<v>{5000 * '9'}</v>"))


def mat_element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def mat_array(of_class: int, dimensions: tuple[int, ...], rest: bytes) -> bytes:
    flags = mat_element(6, struct.pack("<II", of_class, 0))
    shape = mat_element(5, struct.pack(f"<{len(dimensions)}i", *dimensions))
    return mat_element(14, flags + shape + mat_element(1, b"x") + rest)


def mat(path: Path, *elements: bytes) -> None:
    header = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    path.write_bytes(header + b"".join(elements))


def packed(content: bytes) -> bytes:
    squeezed = zlib.compress(content, 9)
    return struct.pack("<II", 15, len(squeezed)) + squeezed


def empty_cells(path: Path) -> None:
    mat(path, mat_array(1, (60_000, 60_000), b""))


def cells_in_a_struct(path: Path) -> None:
    """The structure is sound, and what it holds states more than it has."""
    names = mat_element(5, struct.pack("<i", 8)) + mat_element(1, b"field\0\0\0")
    mat(path, packed(mat_array(2, (1, 1), names + mat_array(1, (60_000, 60_000), b""))))


def deep_cells(path: Path) -> None:
    array = b""
    for _ in range(3000):
        array = mat_array(1, (1, 1), array)
    mat(path, packed(array))


def packed_zeros(path: Path) -> None:
    """An array of 2 GB in 2 MB, of which none is unpacked."""
    stated = struct.pack("<II", 14, 2**31)
    mat(path, packed(stated + bytes(1_000_000)))


def hdf5_of_nothing(path: Path) -> None:
    """Rows that were never written take no place in the file."""
    with h5py.File(path, "w") as file:
        for name in NAMES:
            file.create_dataset(name, shape=(10**11,), dtype="f8", chunks=(1024,))


def parquet_of_one_value(path: Path) -> None:
    """Runs of one value: 120 million rows in some kilobytes."""
    rows = pa.array(np.zeros(1_000_000))
    part = pa.table(dict.fromkeys(NAMES, rows))
    with pq.ParquetWriter(path, part.schema) as writer:
        for _ in range(40):
            writer.write_table(part)


def wide_parquet(path: Path) -> None:
    column = pa.array([1.0, 2.0, 3.0])
    pq.write_table(pa.table({str(k): column for k in range(documents.MOST_COLUMNS + 1)}), path)


def wide_text(path: Path) -> None:
    names = [f"c{k}" for k in range(documents.MOST_COLUMNS + 1)]
    row = ",".join("1" for _ in names)
    path.write_text("\n".join([",".join(names), row, row]))


def long_heading(path: Path) -> None:
    path.write_text(f"time_s,{40_000 * '('},x_torque_nm\n" + 3 * "1,2,3\n")


def long_line(path: Path) -> None:
    path.write_text(f"{','.join(NAMES)}\n1,2,3\n2,3,4\n{(documents.MOST_IN_LINE + 1) * '1'}\n")


BOMBS: dict[str, tuple[str, Callable[[Path], None], str]] = {
    f"{write.__name__}.{ending}": (ending, write, said)
    for ending, write, said in (
        ("npz", huge_npz, "it has 100,000,000,000 numbers, and at most 100,000,000 are read"),
        ("npz", cancelling_npz, "numbers, and at most 100,000,000 are read"),
        ("npz", empty_texts_npz, "it has 100,000,000,000 numbers"),
        ("npz", wide_texts_npz, "numbers, and at most 100,000,000 are read"),
        ("npz", many_members_npz, "it has 1,001 members, and at most 1,000 are read"),
        ("npz", stating_10_gb, "bytes unpacked, and at most 1,600,000,000 are read"),
        ("xlsx", stating_10_gb, "bytes unpacked, and at most 1,600,000,000 are read"),
        ("xlsx", laughing_sheet, "declares a document type"),
        ("xlsx", wide_rows, "columns, and at most 1,000 are read"),
        ("xlsx", long_number, "not a readable .xlsx file"),
        ("mat", empty_cells, "it has 3,600,000,000 numbers"),
        ("mat", cells_in_a_struct, "it has 3,600,000,001 numbers"),
        ("mat", deep_cells, "nested too deeply: at most 50 levels are read"),
        ("mat", packed_zeros, "it has 2,147,483,648 bytes unpacked"),
        ("h5", hdf5_of_nothing, "numbers, and at most 100,000,000 are read"),
        ("parquet", parquet_of_one_value, "it has 120,000,000 numbers"),
        ("parquet", wide_parquet, "it has 1,001 columns, and at most 1,000 are read"),
        ("csv", wide_text, "it has 1,001 columns, and at most 1,000 are read"),
        ("csv", long_heading, "it has 40,000 characters in a heading, and at most 1,000 are read"),
        ("csv", long_line, "characters in a line, and at most 1,000,000 are read"),
    )
}


@pytest.fixture
def memory() -> Iterator[None]:
    """What the body asks for, numpy's arrays included, is far below what these files state."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < MOST_MEMORY_BYTES
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("bomb", BOMBS)
def test_what_asks_for_more_than_a_recording_has_is_refused(
    bomb: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    ending, write, said = BOMBS[bomb]
    path = tmp_path / f"bomb.{ending}"
    write(path)
    request.getfixturevalue("memory")
    done = CliRunner().invoke(app, ["import", str(path)])
    assert done.exit_code == 5, done.exception
    told = " ".join(done.stderr.split())
    assert f"error: {path}: " in told
    assert said in told
    assert "next: " in told


def far_row(path: Path) -> None:
    sheet(path, lambda text: text.replace('<row r="4"', '<row r="40000000000"'))


def test_a_row_is_one_that_a_sheet_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rows between are gone through: fewer here, or the test takes a second of them."""
    monkeypatch.setattr("edge_ident.files.measurement_files._MOST_ROWS", 1000)
    far_row(tmp_path / "far.xlsx")
    with pytest.raises(DataError, match="it has 1,001 rows, and at most 1,000 are read"):
        edge_ident.load_recording(tmp_path / "far.xlsx")


def test_text_is_unpacked_as_far_as_a_recording_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = 1 << 21
    monkeypatch.setattr("edge_ident.support.documents.MOST_BYTES", most)
    path = tmp_path / "zeros.csv.gz"
    with gzip.open(path, "wt") as file:
        file.write(f"{','.join(NAMES)}\n1,2,3\n2,3,4\n" + most * "\n")
    assert path.stat().st_size < most // 100
    with pytest.raises(DataError, match="bytes unpacked, and at most 2,097,152 are read"):
        edge_ident.load_recording(path)
    plain = tmp_path / "zeros.csv"
    with plain.open("wb") as sparse:
        sparse.truncate(most + 1)
    with pytest.raises(DataError, match="it has 2,097,153 bytes, and at most 2,097,152 are read"):
        edge_ident.load_recording(plain)


def test_blank_rows_are_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(documents, "MOST_NUMBERS", 3000)
    path = tmp_path / "blank.csv"
    path.write_text(f"{','.join(NAMES)}\n1,2,3\n2,3,4\n" + 1500 * "\n")
    with pytest.raises(DataError, match="it has 4,509 numbers, and at most 3,000 are read"):
        edge_ident.load_recording(path)


@pytest.mark.parametrize("kind", ["bz2", "lz4"])
def test_a_chunk_of_a_bag_is_unpacked_as_far_as_a_recording_goes(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosbags.rosbag1 import Writer

    monkeypatch.setattr("edge_ident.support.documents.MOST_BYTES", 20_000)
    monkeypatch.setattr("tests.edge_ident.files.test_bags.Writer1", _packing(Writer, kind))
    path = write_bag(tmp_path, ".bag", {"/joint_states": ["pan", "tilt"]})
    with pytest.raises(DataError, match="bytes unpacked, and at most 20,000 are read"):
        edge_ident.load_recording(path)


def _packing(writer: Any, kind: str) -> Callable[[Path], Any]:
    def made(path: Path) -> Any:
        packing = writer(path)
        packing.set_compression(writer.CompressionFormat[kind.upper()])
        return packing

    return made


def test_unpackers_of_chunks_are_the_packages_own_again(tmp_path: Path) -> None:
    from rosbags.rosbag1 import reader

    before = dict(reader.decompressors)
    path = write_bag(tmp_path, ".bag", {"/joint_states": ["pan"]})
    edge_ident.inspect_recording(path)
    assert reader.decompressors == before
    assert reader.decompressors["bz2"](bz2.compress(b"x")) == b"x"


def test_a_long_description_of_a_bag_is_not_read(tmp_path: Path) -> None:
    path = write_bag(tmp_path, ".db3", {"/joint_states": ["pan"]})
    with (path.parent / "metadata.yaml").open("a") as file:
        file.write(documents.MOST_DESCRIPTION_BYTES * "#")
    with pytest.raises(DataError, match=r"bytes in metadata.yaml, and at most 262,144 are read"):
        edge_ident.load_recording(path.parent)


def test_folders_in_folders_end(tmp_path: Path) -> None:
    deep = tmp_path.joinpath(*documents.DEEPEST * ["d"])
    deep.mkdir(parents=True)
    (deep / "a.csv").write_text("1,2\n")
    done = CliRunner().invoke(app, ["survey", str(tmp_path)])
    assert done.exit_code == 5
    assert "nested too deeply: at most 50 levels are read" in done.stderr


@pytest.mark.parametrize("value", [1e16, -1e200, 1e-200])
def test_a_number_is_one_that_a_machine_has(value: float, tmp_path: Path) -> None:
    """Its square is one, too: sums of squares overflowed or vanished in what follows."""
    time_s = 0.001 * np.arange(1000)
    position, torque = np.sin(20.0 * time_s), value * np.cos(20.0 * time_s)
    path = tmp_path / "a.npz"
    np.savez(path, time_s=time_s, x_position_rad=position, x_torque_nm=torque)
    done = CliRunner().invoke(app, ["identify", str(path), "--no-diagnose"])
    assert done.exit_code == 5, done.exception
    assert ("in every sample" if abs(value) < 1.0 else "is more than 1e+15") in done.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"name = {5000 * '9'}\n", "characters in a line, and at most 1,000"),
        (f"[axes.x]\n[sampling]\nperiod_s = 0x{900 * 'f'}\n", "sampling.period_s is 5104866"),
        (f"[axes.x]\ngear_ratio{800 * '.a'} = 1\n", "characters in a line, and at most 1,000"),
        (f"[axes.x]\ngear_ratio{400 * '.a'} = 1\n", "nested too deeply: at most 50 levels"),
        (f"a = {300_000 * ' '}\n", "bytes or more, and at most 262,144 are read"),
        (f"{DRIVE}[board]\nbaud_rate = 0xffffffffffffffffffff\n", "board.baud_rate is 12089"),
    ],
    ids=["digits", "hexadecimal digits", "long line", "deep", "long", "a rate"],
)
def test_a_description_is_read_as_far_as_it_may_be_one(
    text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(text)
    with pytest.raises(DataError) as caught:
        edge_ident.load_drive(path)
    assert said in caught.value.cause
    assert len(caught.value.cause) < 400


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (5000 * "9", "it has 5,000 digits in an integer, and at most 1,000 are read"),
        (60 * "[" + 60 * "]", "nested too deeply: at most 50 levels are read"),
        (100_000 * "[", "nested"),
        (f'"{documents.MOST_DOCUMENT_BYTES * "a"}"', "at most 4,194,304 are read"),
        ("{" + "".join(f'"{k}":0,' for k in range(100_000)) + '"1":1}', "'1' twice in one place"),
    ],
    ids=["digits", "deep", "deeper", "long", "twice"],
)
def test_a_document_is_read_as_far_as_it_may_be_one(text: str, said: str, tmp_path: Path) -> None:
    """The last took the square of its names."""
    path = tmp_path / "a.json"
    path.write_text(text)
    for load in (edge_ident.load_model, edge_ident.load_motion):
        with pytest.raises((DataError, ModelError)) as caught:
            load(path)
        assert said in caught.value.cause
        assert caught.value.exit_code == 5


@pytest.mark.parametrize("sha256", [{}, [], None, 1, "abc", {"fp32": {}}, {"fp32": 64 * "g"}])
def test_a_hash_in_a_manifest_is_one(sha256: object, tmp_path: Path) -> None:
    fields = json.loads(BUILT_IN.read_text("utf-8"))
    fields["sha256"] = sha256 if isinstance(sha256, dict) and sha256 else {"fp32": sha256}
    (tmp_path / "own.json").write_text(json.dumps(fields))
    shutil.copy(BUILT_IN.with_name("feed_drive_fp32.onnx"), tmp_path / "own_fp32.onnx")
    with pytest.raises(ModelError, match="64 hexadecimal digits") as caught:
        edge_ident.load_network(path=tmp_path / "own_fp32.onnx")
    assert caught.value.exit_code == 5


@pytest.mark.parametrize("field", ["motion", "mismatch_limit", "evaluation", "sha256", "effects"])
@pytest.mark.parametrize("value", [{}, [], None, 10**900, "a", [[]], {"a": {}}])
def test_a_manifest_holds_what_it_says(field: str, value: object, tmp_path: Path) -> None:
    """Whatever stands in a field, it is a manifest, or an error that names the file."""
    fields = json.loads(BUILT_IN.read_text("utf-8"))
    (fields["motion"] if field == "effects" else fields)[field] = value
    path = tmp_path / "own.json"
    path.write_text(json.dumps(fields))
    with contextlib.suppress(ModelError):
        load_manifest(path)


DAMAGES = (
    lambda content, at: content[:at],
    lambda content, at: content[:at] + b"\xff\xff\xff\x7f" + content[at + 4 :],
    lambda content, at: content[:at] + bytes(8) + content[at + 8 :],
    lambda content, at: content[:at] + bytes([content[at] ^ 0x55]) + content[at + 1 :],
    lambda content, at: content[:at] + content[at + 3 :],
)


@pytest.mark.parametrize("known", BINARY, ids=lambda known: known.file)
def test_a_damaged_file_is_a_bad_file(known: Format, tmp_path: Path) -> None:
    """Whatever the reader of its format makes of it: none of them knows all that may be wrong."""
    path = tmp_path / known.file
    known.write(path)
    content = path.read_bytes()
    places = np.random.default_rng(7).integers(0, len(content), 12)
    for at in (*map(int, places), *range(0, min(len(content), 400), 29)):
        for damage in DAMAGES:
            path.write_bytes(damage(content, at))
            with contextlib.suppress(DataError), warnings.catch_warnings(action="ignore"):
                edge_ident.load_recording(path)


@pytest.mark.parametrize("sign", "([{<_-/ .,;:#'\"a9=")
def test_a_heading_is_read_in_the_time_of_its_length(sign: str) -> None:
    """Five times as long as a heading that took a minute: what takes the square would take half an
    hour, and its cube a year."""
    run, pairs = 200_000 * sign, 100_000 * f"{sign}a"
    for text in (run, pairs, f"a{run}9", 50_000 * f"a {sign}"):
        split_heading(text)
        split_unknown(text)
        stated_unit(text)
        parse_name(text)
        split(text, BLANKS)
        Dialect("utf-8", "comma", "point").is_value(text)
        stated_period({text: text, f"sampl{text}!": f"1{text} ms"})
        joint_names([(text, {"a"})])
        role_of(text[:10_000])
        column = Column(text, text, "mm", np.zeros(3))
        joined_stamps(Table("", (column,)))
        unit_may_be_name(column)


def test_a_name_that_repeats_a_quantity_is_parsed_as_long_as_it_is() -> None:
    assert parse_name(f"a{100_000 * '_position'}9") is None
    assert parse_name(f"{100_000 * 'a_'}position_rad") is not None
    assert split_heading(f"lb{400_000 * ' '}x") == (f"lb{400_000 * ' '}x", None)
    assert stated_unit("1/0 turn") is None
