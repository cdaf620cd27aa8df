"""What a file is that no format recognises, and what to do with it."""

from pathlib import Path

# First bytes, what begins so, and what to do.
_KNOWN: tuple[tuple[bytes, str, str], ...] = (
    (b"%PDF", "a PDF document", "Export the numbers as text."),
    (b"\x1f\x8b", "compressed by gzip", "Unpack it first."),
    (b"BZh", "compressed by bzip2", "Unpack it first."),
    (b"\xfd7zXZ", "compressed by xz", "Unpack it first."),
    (b"7z\xbc\xaf", "a 7z archive", "Unpack it, and read a file of it."),
    (b"Rar!", "a rar archive", "Unpack it, and read a file of it."),
    (b"PK\x03\x04", "a zip archive", "Unpack it, and read a file of it."),
    (b"\x89PNG", "a picture", "Export the numbers as text."),
    (b"\xff\xd8\xff", "a picture", "Export the numbers as text."),
    (b"GIF8", "a picture", "Export the numbers as text."),
    (b"|CF,", "an imc FAMOS file", "Export it as text or MATLAB."),
    (b"CDF\x01", "a netCDF 3 file", "Convert it to netCDF 4 (nccopy -k nc4)."),
    (b"CDF\x02", "a netCDF 3 file", "Convert it to netCDF 4 (nccopy -k nc4)."),
    (b"SQLite format 3", "an SQLite database", "Export the table as text."),
    (b"\x80\x04\x95", "a Python pickle, which could run anything", "Save the arrays by numpy.savez."),
    (b"DIAEHDR", "a Dewesoft file", "Export it as text or MATLAB."),
)


def is_stranger(begins_with: bytes) -> bool:
    """Whether a file is known to be of a kind that is not read."""
    return any(begins_with.startswith(mark) for mark, _, _ in _KNOWN)


def refusal(begins_with: bytes, path: Path, meant: str | None) -> ValueError:
    """The one line on a file that cannot be read: what it is, if that can be told, and what to do.

    `meant` is what its ending stands for.
    """
    for mark, what, remedy in _KNOWN:
        if begins_with.startswith(mark):
            return ValueError(f"{path.name} is {what}, which is not read. {remedy}")
    if meant is not None:
        return ValueError(
            f"{path.name} must be a file of {meant}, by its ending; it begins with the bytes "
            f"{begins_with[:8].hex(' ')}, as none does. Write or copy it again."
        )
    return ValueError(
        f"{path.name} is a binary file of a kind that is not known here; it begins with the bytes "
        f"{begins_with[:8].hex(' ')}. Export it as text, MATLAB or HDF5."
    )
