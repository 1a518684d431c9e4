"""Archives of zip, which other formats are: what they unpack to is known before it is unpacked."""

import zipfile
from pathlib import Path
from typing import IO, Final
from xml.parsers.expat import ParserCreate

from edge_ident.support.limits import MOST_BYTES, MOST_COLUMNS, check_size

_PART_BYTES: Final = 1 << 14


def open_archive(path: Path) -> zipfile.ZipFile:
    """Open an archive whose members unpack to what a recording may have.

    A member ends at the size that the archive states for it, whatever is packed.

    Raises
    ------
    BadZipFile, OSError
        It is damaged.
    TooLargeError
    """
    archive = zipfile.ZipFile(path)
    members = archive.infolist()
    try:
        check_size("members", len(members), MOST_COLUMNS)
        check_size("bytes unpacked", sum(one.file_size for one in members), MOST_BYTES)
    except ValueError:
        archive.close()
        raise
    return archive


def refuse_document_types(archive: zipfile.ZipFile) -> None:
    """Refuse XML whose text may be more than what stands there: Office documents have no such.

    A document type declares entities, and entities of entities multiply (ECMA-376, part 2, 8.3.1:
    a package has no document types). It stands before the first element.

    Raises
    ------
    ValueError
    """
    for name in archive.namelist():
        if name.lower().endswith((".xml", ".rels", ".vml")):
            with archive.open(name) as member:
                _refuse_document_type(name, member)


def _refuse_document_type(name: str, member: IO[bytes]) -> None:
    begun: list[str] = []

    def refuse(*_: object) -> None:
        raise ValueError(f"{name} declares a document type")

    parser = ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = lambda element, _: begun.append(element)
    while not begun and (part := member.read(_PART_BYTES)):
        parser.Parse(part)
