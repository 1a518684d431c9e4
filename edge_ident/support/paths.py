"""What stands where a file should be."""

from pathlib import Path


def no_file(path: Path) -> str:
    """Why a path is no file that can be read, with the path."""
    if path.is_dir():
        return f"{path}: it is a folder"
    return f"{path}: {'it is no file' if path.exists() else 'no such file'}"
