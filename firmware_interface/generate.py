"""Writes registers.py, registers.h and docs/registers.md from registers.toml.

Run `python -m firmware_interface.generate`; with `--check` nothing is written, and the exit
code is 1 when a file is out of date.
"""

import re
import sys
import tomllib
import zlib
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, Final

from firmware_interface.register import WORDS, Register

# Reads registers.toml: expands the blocks, checks the layout, computes the map's CRC-32.

SOURCE: Final = Path(__file__).with_name("registers.toml")
_READ_LIMIT: Final = 125
_CRC_WORDS: Final = 2
_HEADER_WORDS: Final = 5
_SAMPLE_WORDS_PER_AXIS: Final = 4


@dataclass(frozen=True)
class Code:
    """One value of an enumeration; `since` as of a register."""

    name: str
    value: int
    meaning: str
    next_step: str | None = None
    since: int = 3


@dataclass(frozen=True)
class Enumeration:
    """A register's codes."""

    name: str
    description: str
    codes: tuple[Code, ...]


@dataclass(frozen=True)
class PageLayout:
    """Where the capture pages lie: page n in slot n mod slots."""

    address: int
    slots: int
    slot_registers: int
    samples: int


@dataclass(frozen=True)
class RegisterMap:
    """The whole map."""

    magic: int
    version: int
    float_test: float
    store_signature: int
    session_lease: float
    axes: tuple[str, ...]
    page: PageLayout
    enums: tuple[Enumeration, ...]
    registers: tuple[Register, ...]

    @property
    def crc(self) -> int:
        """CRC-32 of all that both sides must agree on; descriptions are left out."""
        lines = [f"magic {self.magic} version {self.version} axes {' '.join(self.axes)}"]
        lines.append(f"session lease {self.session_lease!r}")
        page = self.page
        lines.append(f"page {page.address} {page.slots} {page.slot_registers} {page.samples}")
        codes = [(e, c) for e in self.enums for c in e.codes if c.since <= self.version]
        lines += [f"{e.name} {c.name} {c.value}" for e, c in codes]
        lines += [f"{r.name} {r.address} {r.type} {r.count} {r.scale!r}" for r in self.registers]
        return zlib.crc32("\n".join(lines).encode())

    @property
    def page_words(self) -> int:
        """Modbus registers of one page: header, samples, CRC."""
        return (
            _HEADER_WORDS + self.page.samples * len(self.axes) * _SAMPLE_WORDS_PER_AXIS + _CRC_WORDS
        )


def load_map(path: Path = SOURCE) -> RegisterMap:
    """Read and check the map.

    Raises
    ------
    ValueError
        Two registers overlap, a name comes twice, or a page does not fit into one read.
    """
    data = tomllib.loads(path.read_text("utf-8"))
    structures = {entry["name"]: entry["registers"] for entry in data["structure"]}
    registers = [_register(entry, entry["group"]) for entry in data["register"]]
    for block in data["block"]:
        registers += _expand(block, structures)
    loaded = RegisterMap(
        magic=data["magic"],
        version=data["version"],
        float_test=data["float_test"],
        store_signature=data["store_signature"],
        session_lease=data["session_lease"],
        axes=tuple(data["axes"]),
        page=PageLayout(**data["page"]),
        enums=tuple(
            Enumeration(e["name"], e["description"], tuple(Code(**code) for code in e["values"]))
            for e in data["enum"]
        ),
        registers=tuple(sorted(registers, key=lambda register: register.address)),
    )
    _check(loaded)
    return loaded


def _register(entry: dict[str, Any], prefix: str, base: int = 0) -> Register:
    """One entry; an offset counts from the base."""
    fields = {key: value for key, value in entry.items() if key not in ("group", "offset", "name")}
    fields["address"] = entry.get("address", base + entry.get("offset", 0))
    return Register(name=f"{prefix}.{entry['name']}", **fields)


def _expand(block: dict[str, Any], structures: dict[str, list[dict[str, Any]]]) -> list[Register]:
    """All registers of all instances of a block."""
    entries = block["registers"]
    if isinstance(entries, str):
        entries = [entry | {"access": block["access"]} for entry in structures[entries]]
    if "since" in block:
        entries = [entry | {"since": block["since"]} for entry in entries]
    return [
        _register(entry, f"{block['group']}.{instance}", block["address"] + n * block["stride"])
        for n, instance in enumerate(block["instances"])
        for entry in entries
    ]


def _check(loaded: RegisterMap) -> None:
    enums = {enum.name for enum in loaded.enums}
    taken: dict[int, str] = {}
    for register in loaded.registers:
        if register.type not in WORDS or (register.enum and register.enum not in enums):
            raise ValueError(f"{register.name}: unknown type or enumeration")
        for address in range(register.address, register.address + register.words):
            if address in taken:
                raise ValueError(f"{register.name} overlaps {taken[address]} at {address:#06x}")
            taken[address] = register.name
    if len({register.name for register in loaded.registers}) < len(loaded.registers):
        raise ValueError("a register name comes twice")
    if max(taken) >= loaded.page.address:
        raise ValueError("registers run into the capture pages")
    if loaded.page_words > min(loaded.page.slot_registers, _READ_LIMIT):
        raise ValueError(f"a page of {loaded.page_words} registers does not fit into one read")


_PACKAGE: Final = Path(__file__).parent
_FIRST_MAP: Final = 3  # oldest map that a host still drives a board of
_BANKS: Final = ("gain_maximum", "active", "shadow")
_NOTE: Final = "Generated from registers.toml by firmware_interface/generate.py; do not edit."
_C_TYPES: Final = {
    "u16": "uint16_t",
    "i16": "int16_t",
    "u32": "uint32_t",
    "i32": "int32_t",
    "f32": "float",
}


def render(source: RegisterMap, package: Path = _PACKAGE) -> dict[Path, str]:
    """The text of every generated file, by path."""
    return {
        package / "registers.py": "\n".join(_python(source)) + "\n",
        package / "registers.h": "\n".join(_header(source)) + "\n",
        package.parent / "docs" / "registers.md": "\n".join(_markdown(source)) + "\n",
    }


def out_of_date(files: dict[Path, str]) -> list[Path]:
    """Files that differ from what the map says."""
    return [
        path
        for path, text in files.items()
        if not path.is_file() or path.read_text("utf-8") != text
    ]


def main(arguments: list[str]) -> int:
    """Write the files, or check them."""
    files = render(load_map())
    stale = out_of_date(files)
    if arguments == ["--check"]:
        for path in stale:
            print(f"{path.relative_to(_PACKAGE.parent)} is out of date", file=sys.stderr)
        return 1 if stale else 0
    if arguments:
        print("usage: python -m firmware_interface.generate [--check]", file=sys.stderr)
        return 2
    for path in stale:
        path.parent.mkdir(exist_ok=True)
        path.write_text(files[path], "utf-8")
    return 0


def _python(source: RegisterMap) -> Iterator[str]:
    yield '"""The register map as data.'
    yield ""
    yield _NOTE
    yield '"""'
    yield "# ruff: noqa: E501"
    yield "# fmt: off"
    yield ""
    yield "from enum import IntEnum"
    yield "from typing import Final"
    yield ""
    yield "from firmware_interface.register import Register"
    yield ""
    yield from _python_constants(source)
    for enum in source.enums:
        yield from ("", "")
        yield f"class {enum.name}(IntEnum):"
        yield f'    """{enum.description}"""'
        yield ""
        yield from (f"    {code.name} = {code.value}" for code in enum.codes)
    yield ""
    for enum in source.enums:
        yield from _python_texts(enum)
    yield ""
    yield "_ALL = ("
    yield from map(_python_register, source.registers)
    yield ")"
    yield "REGISTERS: Final = {register.name: register for register in _ALL}"


def _python_constants(source: RegisterMap) -> Iterator[str]:
    page = source.page
    yield f"MAGIC: Final = 0x{source.magic:08X}"
    yield f"MAP_VERSION: Final = {source.version}"
    yield f"MAP_CRC: Final = 0x{source.crc:08X}"
    yield f"FLOAT_TEST: Final = {source.float_test}"
    yield f"STORE_SIGNATURE: Final = 0x{source.store_signature:08X}"
    yield f"SESSION_LEASE_S: Final = {source.session_lease}"
    axes = ", ".join(f'"{axis}"' for axis in source.axes)
    yield f"AXES: Final = ({axes})"
    yield f"PAGE_ADDRESS: Final = {page.address:#06x}"
    yield f"PAGE_SLOTS: Final = {page.slots}"
    yield f"PAGE_SLOT_REGISTERS: Final = {page.slot_registers}"
    yield f"PAGE_SAMPLES: Final = {page.samples}"
    yield f"PAGE_WORDS: Final = {source.page_words}"


def _python_texts(enum: Enumeration) -> Iterator[str]:
    if any(code.next_step for code in enum.codes):
        yield ""
        yield f"{enum.name.upper()}_TEXTS: Final = {{"
        for code in enum.codes:
            yield f'    {enum.name}.{code.name}: ("{code.meaning}", "{code.next_step}"),'
        yield "}"


def _python_register(register: Register) -> str:
    """One line: what every register has by its place, the rest where it is not the default."""
    values = {field: getattr(register, field.name) for field in fields(register)}
    given = [
        ("" if field.default is MISSING else f"{field.name}=")
        + (f'"{value}"' if isinstance(value, str) else repr(value))
        for field, value in values.items()
        if field.default is MISSING or value != field.default
    ]
    return f"    Register({', '.join(given)}),"


def _c_name(register: Register) -> str:
    return register.name.upper().replace(".", "_")


def _c_member(register: Register) -> str:
    length = "" if register.count == 1 else f"[{register.count}]"
    return f"{_C_TYPES[register.type]} {register.name.split('.')[-1]}{length}"


def _header(source: RegisterMap) -> Iterator[str]:
    page = source.page
    yield f"/* The register map. {_NOTE} */"
    yield "#ifndef FEED_DRIVE_REGISTERS_H"
    yield "#define FEED_DRIVE_REGISTERS_H"
    yield ""
    yield "#include <stddef.h>"
    yield "#include <stdint.h>"
    yield ""
    yield f"#define FD_MAGIC {source.magic:#010x}u"
    yield f"#define FD_MAP_VERSION {source.version}u"
    yield f"#define FD_MAP_CRC {source.crc:#010x}u"
    yield f"#define FD_FLOAT_TEST {source.float_test}f"
    yield f"#define FD_STORE_SIGNATURE {source.store_signature:#010x}u"
    yield f"#define FD_SESSION_LEASE_S {source.session_lease}f"
    yield f"#define FD_AXES {len(source.axes)}u"
    yield f"#define FD_PAGE_ADDRESS {page.address:#06x}u"
    yield f"#define FD_PAGE_SLOTS {page.slots}u"
    yield f"#define FD_PAGE_SLOT_REGISTERS {page.slot_registers}u"
    yield f"#define FD_PAGE_SAMPLES {page.samples}u"
    yield f"#define FD_PAGE_WORDS {source.page_words}u"
    for enum in source.enums:
        yield ""
        yield f"/* {enum.description} */"
        yield f"enum fd_{enum.name.lower()} {{"
        for code in enum.codes:
            yield f"    FD_{enum.name.upper()}_{code.name} = {code.value}, /* {code.meaning} */"
        yield "};"
    yield ""
    for register in source.registers:
        yield f"#define FD_REG_{_c_name(register)} {register.address:#06x}u"
    yield from _header_table(source)
    yield from _header_layout(source)
    yield ""
    yield "#endif"


def _header_table(source: RegisterMap) -> Iterator[str]:
    """Access and ranges of all registers, as an X-macro."""
    last = source.registers[-1]
    yield f"#define FD_REG_END {last.address + last.words:#06x}u"
    yield ""
    yield "/* Every register, by address: FD_REGISTERS(X) expands to"
    yield " * X(address, words of a value, values, writable, smallest, largest raw value). */"
    yield "#define FD_REGISTERS(X) \\"
    for r in source.registers:
        lowest, highest = "0u", "0xffffffffu"
        if r.access == "rw" and r.minimum is not None and r.maximum is not None:
            lowest, highest = (f"{round(limit / r.scale)}u" for limit in (r.minimum, r.maximum))
        tail = "" if r is last else " \\"
        yield (
            f"    X({r.address:#06x}u, {r.words // r.count}u, {r.count}u, {r.access == 'rw':d}u, "
            f"{lowest}, {highest}){tail}"
        )


def _header_layout(source: RegisterMap) -> Iterator[str]:
    """Word images of the structures that travel in one transfer."""
    bank = [r for r in source.registers if r.name.startswith(f"active.{source.axes[0]}.")]
    yield ""
    yield "/* Fails to compile where a condition does not hold (C99 has no _Static_assert). */"
    yield "#define FD_ASSERT(name, condition) typedef char fd_assert_##name[(condition) ? 1 : -1]"
    yield ""
    yield "/* One axis of a gain bank; in the map those of map 4 stand in another place. */"
    yield "struct fd_gain_bank {"
    yield from (f"    {_c_member(r)};" for r in bank)
    yield "};"
    offset = 0
    for register in bank:
        name = register.name.split(".")[-1]
        yield f"FD_ASSERT({name}, offsetof(struct fd_gain_bank, {name}) == {offset}u);"
        offset += 2 * register.words
    yield f"FD_ASSERT(gain_bank, sizeof(struct fd_gain_bank) == {offset}u);"
    yield ""
    yield "/* A capture page as words on the wire, high word first; short pages are zero-padded. */"
    yield "struct fd_page {"
    yield "    uint16_t index[2];"
    yield "    uint16_t first_sample[2];"
    yield "    uint16_t count;"
    yield "    struct {"
    yield "        uint16_t position[2]; /* int32_t counts */"
    yield "        uint16_t effort; /* int16_t counts */"
    yield "        uint16_t following_error; /* int16_t counts, saturating */"
    yield "    } sample[FD_PAGE_SAMPLES][FD_AXES];"
    yield "    uint16_t crc[2]; /* CRC-32 of the words before, big-endian */"
    yield "};"
    yield "FD_ASSERT(page, sizeof(struct fd_page) == 2u * FD_PAGE_WORDS);"
    yield "FD_ASSERT(page_fits_its_slot, FD_PAGE_WORDS <= FD_PAGE_SLOT_REGISTERS);"
    yield "FD_ASSERT(page_fits_one_read, FD_PAGE_WORDS <= 125u);"


def _markdown(source: RegisterMap) -> Iterator[str]:
    page = source.page
    yield "# Registers of the board"
    yield f"<!-- {_NOTE} -->"
    yield (
        f"Map version {source.version}, CRC-32 `{source.crc:#010x}`. Modbus holding registers, "
        "device 1; 32-bit values have the high word first; value = raw × scale, a scale of 1 where "
        f"none is given. Where two addresses stand, they are those of {' and '.join(source.axes)}. "
        "A number in brackets is the map that brought a register."
    )
    yield ""
    yield "| address | name | type | unit | access, range | what it is |"
    yield "| --- | --- | --- | --- | --- | --- |"
    gains, others = _rows_of(source)
    for same in others:
        name = same[0].name.replace(f".{source.axes[0]}.", "._axis_.")
        yield (
            f"| {_addresses(same)} | {name}{_since(same[0])} | {_kind(same[0])} | {same[0].unit} "
            f"| {same[0].access}{_limits(same[0])} | {same[0].description} |"
        )
    yield from _markdown_gains(source, gains)
    yield ""
    yield "## Capture pages"
    yield (
        f"Page n lies at `{page.address:#06x}` + (n mod {page.slots}) × {page.slot_registers}, "
        f"{source.page_words} registers: index (u32), first sample (u32), count (u16), "
        f"{page.samples} samples, CRC-32 of the words before (u32). A sample holds, for each of "
        f"{', '.join(source.axes)}: position (i32, encoder counts), effort (i16, PWM counts), "
        "following error (i16, encoder counts, saturating)."
    )
    for enum in source.enums:
        yield from _markdown_codes(enum)


def _markdown_gains(source: RegisterMap, gains: list[list[Register]]) -> Iterator[str]:
    yield from ("", "## Gains", "")
    yield f"Each bank holds these for {' and '.join(source.axes)}. A host writes the shadow bank."
    yield ""
    yield f"| gain | {' | '.join(_BANKS)} | type | unit | what it is |"
    yield f"| --- |{' --- |' * len(_BANKS)} --- | --- | --- |"
    for same in gains:
        banks = [[r for r in same if r.name.startswith(f"{bank}.")] for bank in _BANKS]
        first, where = same[0], " | ".join(map(_addresses, banks))
        yield (
            f"| {first.name.split('.')[-1]}{_since(first)} | {where} "
            f"| {_kind(first)} | {first.unit} | {first.description} |"
        )


def _rows_of(source: RegisterMap) -> tuple[list[list[Register]], list[list[Register]]]:
    """Registers that one row describes: those of the gain banks, and all others."""
    axis = re.compile(rf"\.({'|'.join(source.axes)})\.")
    rows: dict[tuple[str, str], list[Register]] = {}
    for register in source.registers:
        name = axis.sub(".axis.", register.name)
        bank = name.partition(".axis.")[0]
        name = name.replace(bank, "bank") if bank in _BANKS and bank != name else name
        rows.setdefault((name, register.description), []).append(register)
    gains = [row for (name, _), row in rows.items() if name.startswith("bank.")]
    return gains, [row for row in rows.values() if row not in gains]


def _addresses(registers: list[Register]) -> str:
    return ", ".join(f"`{r.address:#06x}`" for r in registers)


def _kind(r: Register) -> str:
    kind = r.type if r.count == 1 else f"{r.type}[{r.count}]"
    return kind if r.scale == 1 else f"{kind} × {r.scale:g}"


def _limits(r: Register) -> str:
    if r.minimum is None or r.maximum is None:
        return ""
    if r.minimum == -r.maximum:
        return f", ±{r.maximum:g}"
    return f", {r.minimum:g} to {r.maximum:g}"


def _since(r: Register) -> str:
    return f" ({r.since})" if r.since > _FIRST_MAP else ""


def _markdown_codes(enum: Enumeration) -> Iterator[str]:
    """Codes with their meaning; what to do next is in the messages of the host."""
    versions = {code.since for code in enum.codes}
    one = len(versions) == 1 and min(versions) > _FIRST_MAP
    yield ""
    yield f"## {enum.name}"
    yield enum.description + (f" Since map {min(versions)}." if one else "")
    yield ""
    yield "| code | name | meaning |"
    yield "| --- | --- | --- |"
    for code in enum.codes:
        since = f" (since map {code.since})" if code.since > _FIRST_MAP and not one else ""
        yield f"| {code.value} | {code.name} | {code.meaning}{since} |"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
