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
    (b"H Product:Blackbox", "a Betaflight log", "Convert it: `blackbox_decode FILE` writes csv."),
    (b"DIAdem", "a DIAdem file", "Export it from DIAdem as TDMS or text."),
    (b"CDF\x01", "a netCDF 3 file", "Convert it to netCDF 4 (nccopy -k nc4)."),
    (b"CDF\x02", "a netCDF 3 file", "Convert it to netCDF 4 (nccopy -k nc4)."),
    (b"SQLite format 3", "an SQLite database", "Export the table as text."),
    (b"\x80\x04\x95", "a Python pickle, which could run anything", "Save the arrays by numpy.savez."),
    (b"\x80\x05\x95", "a Python pickle, which could run anything", "Save the arrays by numpy.savez."),
    (b"\x80\x03c", "a Python pickle, which could run anything", "Save the arrays by numpy.savez."),
)


# Endings of recorders whose files have no mark of their own that is known here, and archives of theirs.
_ENDINGS: dict[str, tuple[str, str]] = {
    **dict.fromkeys((".dxz", ".d7z"), ("a packed Dewesoft file", "Export it from DewesoftX as MATLAB or text.")),
    **dict.fromkeys(
        (".dxd", ".d7d"), ("a Dewesoft file that does not begin as one", "Export it from DewesoftX as MATLAB or text.")
    ),
    **dict.fromkeys((".tdm", ".tdx"), ("a DIAdem file", "Export it from DIAdem as TDMS or text.")),
    **dict.fromkeys((".wfm", ".isf"), ("a file of an oscilloscope", "Save the waveform as csv.")),
    **dict.fromkeys((".bbl", ".bfl"), ("a Betaflight log", "Convert it: `blackbox_decode FILE` writes csv.")),
    ".ide": ("an enDAQ recording", "Export it by enDAQ Lab as csv or MATLAB."),
    ".rsp": ("an RPC file", "Export it as text or MATLAB."),
}


def is_stranger(begins_with: bytes, path: Path) -> bool:
    """Whether a file is known to be of a kind that is not read: by its bytes, or as a binary file by its ending."""
    return _stranger(begins_with, path) is not None


def _stranger(begins_with: bytes, path: Path) -> tuple[str, str] | None:
    binary = b"\0" in begins_with or begins_with.startswith(b"PK\x03\x04")
    if binary and path.suffix.lower() in _ENDINGS:
        return _ENDINGS[path.suffix.lower()]
    return next(((what, remedy) for mark, what, remedy in _KNOWN if begins_with.startswith(mark)), None)


def refusal(begins_with: bytes, path: Path, meant: str | None) -> ValueError:
    """The one line on a file that cannot be read: what it is, if that can be told, and what to do.

    `meant` is what its ending stands for.
    """
    known = _stranger(begins_with, path)
    if known is not None:
        what, remedy = known
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
