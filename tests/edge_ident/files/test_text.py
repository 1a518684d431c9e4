"""Text tables: any dialect reads as the numbers that were written, and bad files say where."""

import gzip
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from edge_ident.errors import DataError
from edge_ident.files.dialect import DECIMALS, DELIMITERS
from edge_ident.files.reading import read_table
from edge_ident.files.table import Table, split_heading
from edge_ident.files.text import read_text
from edge_ident.files.units import count_unit, known_unit, stated_unit
from tests.repetitions import examples


@dataclass(frozen=True)
class Written:
    """How a program writes."""

    delimiter: str
    decimal: str
    encoding: str
    newline: str
    lines_before: int
    unit_row: bool
    open_end: bool
    last_newline: bool = True

    def write(self, path: Path, rows: Sequence[Sequence[float]]) -> None:
        separator = DELIMITERS[self.delimiter]
        lines = [f"{key} 1: made by a test" for key in "abc"[: self.lines_before]]
        lines.append(separator.join(("zeit", "lage", "kraft")))
        if self.unit_row:
            lines.append(separator.join(("[ms]", "[µm]", "[kN]")))
        for row in rows:
            cells = (repr(v).replace(".", DECIMALS[self.decimal]) for v in row)
            lines.append(separator.join(cells) + (separator if self.open_end else ""))
        text = self.newline.join(lines) + self.newline * self.last_newline
        path.write_bytes(text.encode(self.encoding))


dialects = st.builds(
    Written,
    delimiter=st.sampled_from(list(DELIMITERS)),
    decimal=st.sampled_from(list(DECIMALS)),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"]),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    lines_before=st.integers(0, 3),
    unit_row=st.booleans(),
    open_end=st.booleans(),
    last_newline=st.booleans(),
).filter(lambda way: not way.delimiter == way.decimal == "comma")
numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
tables = st.lists(st.tuples(numbers, numbers, numbers), min_size=3, max_size=30)


@settings(
    max_examples=examples(60), deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(way=dialects, rows=tables)
def test_what_is_written_is_read(tmp_path: Path, way: Written, rows: list[tuple[float]]) -> None:
    """Bit for bit: both ends write and read the nearest number."""
    path = tmp_path / "table.txt"
    way.write(path, rows)
    table = read_text(path)
    assert [column.name for column in table.columns] == ["zeit", "lage", "kraft"]
    assert [column.unit for column in table.columns] == (
        ["ms", "µm", "kN"] if way.unit_row else [None] * 3
    )
    np.testing.assert_array_equal(np.array([c.values for c in table.columns]).T, np.array(rows))


cells = st.text(st.sampled_from("0123456789.,-+eE \"'#%[]()=:aäµ\t"), max_size=8)
lines = st.lists(st.lists(cells, max_size=4).map(";".join), max_size=12).map("\n".join)


@settings(
    max_examples=examples(150), deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(content=st.one_of(st.binary(max_size=60), lines.map(str.encode)))
def test_anything_is_a_table_or_refused_in_words(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "anything.txt"
    path.write_bytes(content)
    found = read_or_refuse(path)
    if isinstance(found, DataError):
        assert "anything.txt" in found.cause
        assert found.next_step
    else:
        assert len(found.columns) >= 2


def read_or_refuse(path: Path) -> Table | DataError:
    try:
        return read_text(path)
    except DataError as error:
        return error


def text_of(rows: Sequence[str], head: str = "t [s];x [mm];F [N]") -> str:
    return "\n".join([head, *rows]) + "\n"


GOOD = [f"0,{i:03};{i},5;{i * i},25" for i in range(50)]


def changed(row: int, text: str) -> list[str]:
    return [*GOOD[:row], text, *GOOD[row + 1 :]]


BAD = {
    "empty": ("", "the file is empty"),
    "blank": ("\n \n\n", "the file is empty"),
    "no table": ("this is a letter\nand no table\n", "no table of numbers found"),
    "one column": ("x\n1\n2\n3\n", "one column of numbers"),
    "ragged, short": (text_of(changed(20, "0,020;20,5")), "row 22: 2 values but 3"),
    "ragged, long": (text_of(changed(20, "0,020;20,5;1;2")), "row 22: 4 values but 3"),
    "a word": (text_of(changed(20, "0,020;oops;1")), r"row 22, column x \[mm\]: 'oops'"),
    "a bad first row": (text_of(changed(0, "0,5;oops;1,5")), r"row 2, column x \[mm\]: 'oops'"),
    "mixed decimals": (
        text_of(changed(20, "0.020;20.5;1")),
        r"row 22, column t \[s\]: '0.020' is not a number with a decimal comma",
    ),
    "half of each": (
        text_of([*GOOD[1:25], *(row.replace(",", ".") for row in GOOD[1:25])]),
        r"row 26, column t \[s\]: '0.001' is not a number with a decimal comma",
    ),
    "comma twice": (
        text_of([row.replace(";", ",") for row in GOOD], "t [s],x [mm],F [N]"),
        "6 values per row but 3 column names",
    ),
    "two tables": (
        text_of([*GOOD, "", "t [s];x [mm];F [N]", *GOOD]),
        "row 53: text again",
    ),
    "thousands": (text_of([f"1.000,5;2.{i:03},5;3.000,5" for i in range(50)]), "no table"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_says_where_and_what_to_do(kind: str, tmp_path: Path) -> None:
    text, message = BAD[kind]
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=message) as error:
        read_text(path)
    assert "bad.csv" in error.value.cause
    assert error.value.next_step


@pytest.mark.parametrize("state", ["OK", "1.0.2", '"a ""word"""'])
def test_quoted_cells_and_text_beside_decimal_commas(state: str, tmp_path: Path) -> None:
    """A point in a column of text is no decimal sign."""
    rows = [f'"{i},5";{state};"{i},25"' for i in range(50)]
    path = tmp_path / "quoted.csv"
    path.write_text(text_of(rows, '"x [mm]";state;"F [N]"'))
    table = read_text(path)
    assert [(c.name, c.values[7]) for c in table.columns] == [("x", 7.5), ("F", 7.25)]
    path.write_text(text_of([*rows, f'"50.5";{state};"1,0"'], '"x [mm]";state;"F [N]"'))
    with pytest.raises(DataError, match=r"row 52, column x \[mm\]: '50.5'"):
        read_text(path)


def test_what_is_ambiguous_is_settled_by_the_option_that_the_message_names(tmp_path: Path) -> None:
    """1,234 is one and a bit, or more than a thousand; 0,234 is no thousands."""
    rows = [f"{i};1,{i:03};2,{i:03}" for i in range(50)]
    path = tmp_path / "thousands.csv"
    path.write_text(text_of(rows))
    with pytest.raises(DataError, match="or one of thousands") as error:
        read_text(path)
    assert "--decimal comma" in error.value.next_step
    assert read_text(path, decimal="comma").columns[1].values[7] == 1.007
    path.write_text(text_of([*rows, "50;0,007;2,001"]))
    assert read_text(path).columns[1].values[7] == 1.007


def test_a_table_of_mostly_text_is_read_where_the_delimiter_is_said(tmp_path: Path) -> None:
    rows = [f"a;b;c;d;e;f;{i}.5;{i}" for i in range(50)]
    path = tmp_path / "text.csv"
    path.write_text(text_of(rows, "a;b;c;d;e;f;x;y"))
    with pytest.raises(DataError, match="no table") as error:
        read_text(path)
    assert "--delimiter" in error.value.next_step
    assert [column.name for column in read_text(path, "semicolon").columns] == ["x", "y"]


def test_blanks_in_a_heading_are_no_delimiter_of_a_table_with_tabs(tmp_path: Path) -> None:
    path = tmp_path / "tabs.txt"
    path.write_text("t [s]\tFollowing Error\tF [N]\n" + "\n".join(["0.5\t1.5\t2.5"] * 9))
    assert [c.name for c in read_text(path).columns] == ["t", "Following Error", "F"]


def test_a_bad_cell_far_beyond_the_head_is_found(tmp_path: Path) -> None:
    rows = [f"{i};{i}.5;2.5" for i in range(30_000)]
    rows[29_000] = "29000;29000.5"
    path = tmp_path / "long.csv"
    path.write_text(text_of(rows))
    with pytest.raises(DataError, match="row 29002: 2 values but 3"):
        read_text(path)


def test_columns_of_text_are_left_out_and_named(tmp_path: Path) -> None:
    rows = [f"2026-11-22 10:00:{i:02};{i},5;OK;{i},25" for i in range(50)]
    path = tmp_path / "log.csv"
    path.write_text(text_of(rows, "date;x [mm];state;F [N]"))
    table = read_text(path)
    assert [column.name for column in table.columns] == ["date", "x", "F"]
    assert table.left_out == ("state (no numbers)",)
    path.write_text(text_of([*rows, "2026;1,5;OK"], "date;x [mm];state;F [N]"))
    with pytest.raises(DataError, match="row 52: 3 values but 4"):
        read_text(path)


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("Position [mm]", "Position", "mm"),
        ("Zeit (ms)", "Zeit", "ms"),
        ("X.ActPos", "X.ActPos", None),
        ("MAIN.Axis[1]", "MAIN.Axis[1]", None),
        ("Torque (actual)", "Torque (actual)", None),
        ("Kraft in N", "Kraft", "N"),
        ("Moment X/Nm", "Moment X", "Nm"),
        ("Ist-Position X/°", "Ist-Position X", "°"),
        ("M/Nm", "M", "Nm"),
        ("n/min-1", "n", "min-1"),
        ("m/s", "m/s", None),
        ("v m/s", "v m/s", None),
        ("Speed, 1/min", "Speed", "1/min"),
        ("pos_mm", "pos", "mm"),
        ("x_torque_nm", "x_torque", "Nm"),
        ("x_velocity_rad_s", "x_velocity", "rad/s"),
        ("[mm]", "[mm]", None),
    ],
)
def test_a_heading_is_a_name_and_a_unit(heading: str, name: str, unit: str | None) -> None:
    assert split_heading(heading) == (name, unit)


def test_case_of_a_unit_counts_where_two_units_differ_by_it() -> None:
    assert known_unit("MM") == known_unit("mm")
    assert known_unit("nm") != known_unit("Nm")
    assert known_unit("NM") is None
    assert known_unit("mn") == known_unit("mN")


def test_a_unit_may_be_a_number_of_another() -> None:
    step, count = stated_unit("1/8192 turn"), count_unit("8192/turn")
    assert step is not None
    assert count is not None
    assert step.factor == pytest.approx(2.0 * np.pi / 8192, rel=1e-15)
    assert count.factor == pytest.approx(step.factor, rel=1e-15)
    assert stated_unit("0 mm") is None
    assert stated_unit("1 furlong") is None
    assert count_unit("0/turn") is None
    assert count_unit("100/N") is None


def test_text_may_be_compressed(tmp_path: Path) -> None:
    """By gzip, whatever the file is called; the same table, the same sentences."""
    plain = tmp_path / "plain.csv"
    german = "Zeit [ms];x.pos [mm];x.kraft [N]\n"
    german += "".join(f"{2 * i};{i},5;{i},25\n" for i in range(300))
    plain.write_text(german, encoding="utf-8")
    for name, text in (("scope.csv.gz", german), ("scope.csv", german)):
        (tmp_path / name).write_bytes(gzip.compress(text.encode("utf-8")))
        read, expected = read_table(tmp_path / name), read_table(plain)
        assert read.how == expected.how
        for column, other in zip(read.columns, expected.columns, strict=True):
            assert (column.heading, column.unit) == (other.heading, other.unit)
            np.testing.assert_array_equal(column.values, other.values)
    bad = tmp_path / "bad.csv.gz"
    bad.write_bytes(gzip.compress(german.replace("7,25", "seven").encode("utf-8")))
    with pytest.raises(DataError, match=r"row 9, column x\.kraft"):
        read_table(bad)


@pytest.mark.parametrize("kept", [0.5, 0.99])
def test_a_damaged_compressed_file_is_refused(kept: float, tmp_path: Path) -> None:
    rows = np.random.default_rng(1).standard_normal((50_000, 3))
    text = "t,a,b\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist())
    whole, path = gzip.compress(text.encode("ascii")), tmp_path / "cut.csv.gz"
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(DataError, match="not a readable gzip file"):
        read_table(path)
    path.write_bytes(whole[:1000] + bytes(1000) + whole[2000:])
    with pytest.raises(DataError, match="not a readable gzip file"):
        read_table(path)


@pytest.mark.parametrize(
    ("encoding", "heading"),
    [
        ("cp932", "トルク[Nm]"),
        ("gb18030", "实际转矩(Nm)"),
        ("cp1251", "Положение [град]"),
        ("latin-1", "Größe [°]"),
        ("latin-1", "durée (µs)"),
        ("cp1252", "Lage – „Achse X“ [mm]"),
    ],
)
def test_letters_of_two_bytes_are_told_from_latin_ones(
    encoding: str, heading: str, tmp_path: Path
) -> None:
    rows = "".join(f"{k},{k / 2}\n" for k in range(300))
    (tmp_path / "a.csv").write_bytes(f"time,{heading}\n{rows}".encode(encoding))
    found = read_table(tmp_path / "a.csv").columns[1].heading
    assert found == heading.encode(encoding).decode(encoding.replace("cp1252", "latin-1"))
