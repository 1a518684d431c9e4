"""Reads registers.toml: expands the blocks, checks the layout, computes the map's CRC-32."""

import tomllib
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from firmware_interface.register import WORDS, Register

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
