"""Files of other programs, each made by that program's writer, read by one command.

The table of docs/import.md is this one.
"""

import csv
import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import h5py
import nptdms
import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from numpy.typing import NDArray
from typer.testing import CliRunner

import edge_ident
from edge_ident.cli import app

Array = NDArray[np.float64]

ROOT: Final = Path(__file__).parents[3]
PERIOD_S: Final = 0.002
TIME_S: Final = PERIOD_S * np.arange(600)
POSITION_RAD: Final = 1.5 * np.sin(9.0 * TIME_S) + 0.2 * np.sin(31.0 * TIME_S)
TORQUE_NM: Final = np.cos(9.0 * TIME_S) + 0.3 * np.sin(40.0 * TIME_S)
TURNS: Final = POSITION_RAD / (2.0 * np.pi)
DEGREES: Final = np.degrees(POSITION_RAD)
COUNTS: Final = np.rint(TURNS * 2**20)
LEAD_MM: Final = 5.0
TRAVEL_MM: Final = LEAD_MM * TURNS
Cells = Sequence[Sequence[object]]


def rows_of(*columns: Array) -> list[list[float]]:
    return np.column_stack(columns).tolist()


def write_csv(
    path: Path, head: Cells, columns: Sequence[Array], *, comma: bool = False,
    encoding: str = "utf-8", **dialect: Any,
) -> None:  # fmt: skip
    """The csv module's writer, with the decimal sign of a German program where `comma`."""
    with path.open("w", newline="", encoding=encoding) as file:
        writer = csv.writer(file, **dialect)
        writer.writerows(head)
        for row in rows_of(*columns):
            writer.writerow([f"{v:.10g}".replace(".", "," if comma else ".") for v in row])


def contract(path: Path) -> None:
    write_csv(
        path, [["time_s", "x_position_rad", "x_torque_nm"]], [TIME_S, POSITION_RAD, TORQUE_NM]
    )


def german(path: Path) -> None:
    head = [["Zeit (ms)", "X.Istposition [mm]", "X.Drehmoment [Nm]"]]
    columns = [1e3 * TIME_S, TRAVEL_MM, TORQUE_NM]
    write_csv(path, head, columns, comma=True, encoding="utf-8-sig", delimiter=";")


def header_block(path: Path) -> None:
    head = [["Name", "Projekt 1"], ["Datum", "22.11.2026"], ["Abtastzeit [ms]", "2"], [],
            ["Winkel [°]", "Moment [mNm]"]]  # fmt: skip
    columns = [DEGREES, 1e3 * TORQUE_NM]
    write_csv(path, head, columns, comma=True, encoding="latin-1", delimiter=";")


def scope(path: Path) -> None:
    channels = {
        "Name": ("X.ActPos", "X.ActTorque"), "SymbolComment": ("", ""),
        "Data-Type": ("REAL64", "REAL64"), "SampleTime[ms]": ("2", "2"),
        "Offset": ("0", "0"), "ScaleFactor": ("1", "1"), "Unit": ("deg (Angle)", "Nm (Torque)"),
        "Unit ScaleFactor": ("1", "1"), "Unit Offset": ("0", "0"),
    }  # fmt: skip
    head = [["Name", "Axis"], ["File", "C:\\axis.tcscopex"], ["Starttime of export", "1329597"], []]
    head += [[key, one, key, other] for key, (one, other) in channels.items()] + [[]]
    columns = [1e3 * TIME_S, DEGREES, 1e3 * TIME_S, TORQUE_NM]
    write_csv(path, head, columns, encoding="utf-16", delimiter="\t")
    with path.open("a", encoding="utf-16-le") as file:
        file.write("EOF\r\n")


def unit_row(path: Path) -> None:
    head = [["Time", "Position", "Torque"], ["s", "rev", "N.m"]]
    write_csv(path, head, [TIME_S, TURNS, TORQUE_NM], delimiter="\t")


def quoted(path: Path) -> None:
    head = [["Time [s]", "Position [rad]", "Torque [Nm]"]]
    columns = [TIME_S, POSITION_RAD, TORQUE_NM]
    write_csv(path, head, columns, comma=True, quoting=csv.QUOTE_ALL)


def numpy_text(path: Path) -> None:
    head = "t_us  x_pos_deg  x_torque_nm"
    np.savetxt(path, np.column_stack([1e6 * TIME_S, DEGREES, TORQUE_NM]), header=head, fmt="%.10g")


def counts(path: Path) -> None:
    head = [["Time [ms]", "Encoder [counts]", "Motor current [mA]"]]
    write_csv(path, head, [1e3 * TIME_S, COUNTS, TORQUE_NM / 0.63 * 1e3])


def percent(path: Path) -> None:
    write_csv(path, [["AxisPos", "Load"]], [1e3 * POSITION_RAD, TORQUE_NM / 2.4 * 100.0])


def frame() -> pd.DataFrame:
    index = pd.Index(1e3 * TIME_S, name="time [ms]")
    return pd.DataFrame({"position (deg)": DEGREES, "torque (Nm)": TORQUE_NM}, index=index)


def pandas_csv(path: Path) -> None:
    frame().to_csv(path, sep=";", decimal=",", float_format="%.10g")


def pandas_parquet(path: Path) -> None:
    stamped = frame()
    stamped.index = pd.to_datetime(TIME_S, unit="s").rename("timestamp")
    stamped.to_parquet(path)


def arrow(path: Path) -> None:
    table = pa.table({"t [s]": TIME_S, "x.pos [rad]": POSITION_RAD, "x.torque [Nm]": TORQUE_NM})
    pq.write_table(table, path)


def mat_v5(path: Path) -> None:
    data = {"t_s": TIME_S, "x_pos_rad": POSITION_RAD, "x_torque_nm": TORQUE_NM}
    scipy.io.savemat(path, {"data": data, "comment": "made by a test"})


def mat_v73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("t_s", TIME_S), ("pos_rad", POSITION_RAD), ("torque_nm", TORQUE_NM)):
            file[name] = values[None, :]
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file")


def tdms(path: Path) -> None:
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(
                    "axis", name, values, {"unit_string": unit, "wf_increment": PERIOD_S}
                )
                for name, values, unit in (
                    ("ActPosition", TRAVEL_MM, "mm"), ("Torque", TORQUE_NM, "Nm"),
                )
            ]
        )  # fmt: skip


def excel(path: Path) -> None:
    book = openpyxl.Workbook()
    for row in [["Axis test"], ["time", "angle", "torque"], ["ms", "deg", "Nm"]]:
        book.active.append(row)
    for row in rows_of(1e3 * TIME_S, DEGREES, TORQUE_NM):
        book.active.append(row)
    book.save(path)


def native(path: Path) -> None:
    np.savez(path, time_s=TIME_S, x_position_rad=POSITION_RAD, x_torque_nm=TORQUE_NM)


@dataclass(frozen=True)
class Format:
    """One row of the table.

    `writer` is the library that makes the file; `units` are those that the command finds or is
    told, in the order of the columns.
    """

    file: str
    what: str
    writer: str
    write: Callable[[Path], None]
    options: str
    units: str
    mm: bool = False


FORMATS: Final = (
    Format("contract.csv", "CSV with the contract's names", "csv", contract, "", "s, rad, Nm"),
    Format("native.npz", "NumPy archive with the contract's names", "NumPy", native, "",
           "s, rad, Nm"),
    Format("german.csv", "semicolons, decimal commas, UTF-8 with BOM", "csv", german, "",
           "ms, mm, Nm", True),
    Format("block.csv", "lines before the table, Latin-1, sampling time in them only", "csv",
           header_block, "", "°, mNm"),
    Format("scope.csv", "a time for each channel, tabs, UTF-16, as TwinCAT Scope exports", "csv",
           scope, "", "ms, deg, Nm"),
    Format("units.txt", "units in a row below the headings", "csv", unit_row, "", "s, rev, N.m"),
    Format("quoted.csv", "every cell quoted, comma as delimiter and decimal sign", "csv", quoted,
           "", "s, rad, Nm"),
    Format("savetxt.txt", "numpy.savetxt: blanks, headings behind #", "NumPy", numpy_text, "",
           "us, deg, Nm"),
    Format("counts.csv", "encoder counts and amperes", "csv", counts,
           "--resolution 1048576/turn --torque-constant 0.63", "ms, counts, mA"),
    Format("percent.csv", "names that say little, no time, percent of the rated torque", "csv",
           percent, "--column AxisPos=x_position_rad --unit AxisPos=mrad --column Load=x_torque_nm "
           "--unit Load=% --rated-effort 2.4Nm --period 0.002", "mrad, %"),
    Format("pandas.csv", "pandas.DataFrame.to_csv with decimal commas", "pandas", pandas_csv, "",
           "ms, deg, Nm"),
    Format("pandas.parquet", "pandas.DataFrame.to_parquet, time stamps as index", "pandas",
           pandas_parquet, "", "deg, Nm, s"),
    Format("arrow.parquet", "Parquet by pyarrow", "pyarrow", arrow, "", "s, rad, Nm"),
    Format("v5.mat", "MATLAB v5 to v7, a struct", "SciPy", mat_v5, "", "s, rad, Nm"),
    Format("v73.mat", "MATLAB v7.3", "h5py", mat_v73, "", "rad, s, Nm"),
    Format("labview.tdms", "LabVIEW waveforms with units", "npTDMS", tdms, "", "mm, Nm", True),
    Format("sheet.xlsx", "a spreadsheet with a title and a row of units", "openpyxl", excel, "",
           "ms, deg, Nm"),
)  # fmt: skip


def run(*arguments: str) -> tuple[int, Any, str]:
    result = CliRunner().invoke(app, list(arguments))
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.stdout or "null"), result.stderr


def check(recording: edge_ident.Recording, *, mm: bool) -> None:
    (axis,) = recording.axes.values()
    np.testing.assert_allclose(recording.time_s, TIME_S, rtol=1e-9, atol=1e-9)
    position = LEAD_MM * 1e-3 * TURNS if mm else POSITION_RAD
    np.testing.assert_allclose(axis.position, position, rtol=1e-8, atol=4e-6)
    np.testing.assert_allclose(axis.effort, TORQUE_NM, rtol=1e-8, atol=1e-9)
    assert (axis.position_unit, axis.effort_unit) == ("m" if mm else "rad", "N*m")


@pytest.mark.parametrize("known", FORMATS, ids=lambda known: known.file)
def test_one_command_reads_it(known: Format, tmp_path: Path) -> None:
    path, made = tmp_path / known.file, tmp_path / "made.npz"
    known.write(path)
    code, document, messages = run(
        "import", str(path), *shlex.split(known.options), "-o", str(made), "--json"
    )
    assert code == 0, (messages, document)
    used = [column for column in document["columns"] if column["contract_name"]]
    assert ", ".join(column["unit"] for column in used) == known.units
    check(edge_ident.load_recording(made), mm=known.mm)


def test_the_page_has_this_table() -> None:
    page = (ROOT / "docs" / "import.md").read_text("utf-8")
    rows = [
        f"| {known.what} | {known.writer} | `edge-ident import {known.file}"
        f"{f' {known.options}' if known.options else ''}` | {known.units} |"
        for known in FORMATS
    ]
    missing = [row for row in rows if row not in page]
    assert not missing, "\n".join(missing)


def test_a_data_frame_is_read_and_stays_as_it_is() -> None:
    given = frame()
    before = given.copy()
    check(edge_ident.load_recording(given), mm=False)
    pd.testing.assert_frame_equal(given, before)
    with pytest.raises(edge_ident.DataError, match="an int is no recording"):
        edge_ident.load_recording(42)


PACKAGES: Final[Mapping[str, tuple[str, Callable[[Path], None]]]] = {
    "tdms": ("labview.tdms", tdms),
    "mat": ("v73.mat", mat_v73),
    "parquet": ("arrow.parquet", arrow),
    "xlsx": ("sheet.xlsx", excel),
}


@pytest.mark.parametrize("extra", PACKAGES)
def test_a_missing_package_names_its_extra(
    extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, write = PACKAGES[extra]
    write(tmp_path / file)
    for package in ("nptdms", "h5py", "pyarrow.parquet", "openpyxl"):
        monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(edge_ident.DataError, match="which is not installed") as error:
        edge_ident.load_recording(tmp_path / file)
    assert f"pip install 'edge-ident[{extra}]'" in error.value.next_step


@pytest.mark.parametrize(
    "file", ["a.mat", "a.h5", "a.tdms", "a.parquet", "a.xlsx", "a.npz", "a.csv"]
)
def test_junk_is_refused_by_every_reader(file: str, tmp_path: Path) -> None:
    (tmp_path / file).write_bytes(np.random.default_rng(1).bytes(5000))
    with pytest.raises(edge_ident.DataError, match=r"not a (readable|text)"):
        edge_ident.load_recording(tmp_path / file)
