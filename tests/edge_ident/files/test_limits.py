"""Files that ask for more than a recording has: each is a bad file that names the limit.

Sources of the kinds: zip bombs, entities of entities (CVE-2003-1564), lengths that a header states.
"""

import bz2
import gzip
import io
import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import nptdms
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app
from edge_ident.errors import DataError
from edge_ident.support import limits
from tests.edge_ident.files.test_bags import write as write_bag

MOST_MEMORY_BYTES = 300_000_000
"""Far below what these files ask for."""
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
        for k in range(limits.MOST_COLUMNS + 1):
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


def far_row(path: Path) -> None:
    sheet(path, lambda text: text.replace('<row r="4"', '<row r="40000000000"'))


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
    pq.write_table(pa.table({str(k): column for k in range(limits.MOST_COLUMNS + 1)}), path)


def tdms_stating(path: Path) -> None:
    """Its last segment states that it goes on for 10^15 bytes."""
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [nptdms.ChannelObject("g", name, np.arange(3.0)) for name in ("a", "b")]
        )
    content = bytearray(path.read_bytes())
    content[12:20] = struct.pack("<Q", 10**15)
    path.write_bytes(content)


def wide_text(path: Path) -> None:
    names = [f"c{k}" for k in range(limits.MOST_COLUMNS + 1)]
    row = ",".join("1" for _ in names)
    path.write_text("\n".join([",".join(names), row, row]))


def long_heading(path: Path) -> None:
    path.write_text(f"time_s,{40_000 * '('},x_torque_nm\n" + 3 * "1,2,3\n")


def long_line(path: Path) -> None:
    path.write_text(f"{','.join(NAMES)}\n1,2,3\n2,3,4\n{(limits.MOST_IN_LINE + 1) * '1'}\n")


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
        ("xlsx", far_row, "rows, and at most 1,048,576 are read"),
        ("xlsx", wide_rows, "columns, and at most 1,000 are read"),
        ("xlsx", long_number, "not a readable .xlsx file"),
        ("mat", empty_cells, "it has 3,600,000,000 numbers"),
        ("mat", cells_in_a_struct, "it has 3,600,000,001 numbers"),
        ("mat", deep_cells, "nested too deeply: at most 50 levels are read"),
        ("mat", packed_zeros, "it has 2,147,483,648 bytes unpacked"),
        ("h5", hdf5_of_nothing, "numbers, and at most 100,000,000 are read"),
        ("parquet", parquet_of_one_value, "it has 120,000,000 numbers"),
        ("parquet", wide_parquet, "it has 1,001 columns, and at most 1,000 are read"),
        ("tdms", tdms_stating, "numbers, and at most 100,000,000 are read"),
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
