"""H.264 in the form of cameras (start codes: ISO/IEC 14496-10 annex B) and of files."""

from __future__ import annotations

_START_CODE = b"\0\0\1"
_SPS, _PPS = 7, 8
_MOST_SPS = 31
"""Most sequence parameter sets of a configuration record."""
_MOST_PPS = 255
"""Most picture parameter sets of a configuration record."""
_LONGEST_SET = 0xFFFF
"""Bytes of the longest parameter set in a configuration record."""


def is_stream_form(extradata: bytes) -> bool:
    """Return whether start codes separate the units."""
    return extradata.startswith((b"\0\0\1", b"\0\0\0\1"))


def units(stream: bytes) -> list[bytes]:
    """Return the units of a packet in stream form; zeros after one belong to the next start
    code.
    """
    return [unit for unit in (part.rstrip(b"\0") for part in stream.split(_START_CODE)) if unit]


def file_form(stream: bytes) -> bytes:
    """Return a packet in file form: each unit follows its length."""
    return b"".join(len(unit).to_bytes(4, "big") + unit for unit in units(stream))


def configuration(extradata: bytes) -> bytes | None:
    """Return the decoder's configuration record (ISO/IEC 14496-15, 5.3.3.1).

    Args:
        extradata: The parameters in stream form.
    Returns:
        None if they are incomplete, or exceed the limits of a record.
    """
    found = units(extradata)
    sps = [unit for unit in found if unit[0] & 31 == _SPS and len(unit) > 3]
    pps = [unit for unit in found if unit[0] & 31 == _PPS]
    if not 0 < len(sps) <= _MOST_SPS or not 0 < len(pps) <= _MOST_PPS:
        return None
    if max(map(len, sps + pps)) > _LONGEST_SET:
        return None
    head = b"\1" + sps[0][1:4] + b"\xff"  # version, profile, compatibility, level; 4-byte lengths
    return head + _counted(sps, 0xE0) + _counted(pps, 0)


def _counted(parameter_sets: list[bytes], flags: int) -> bytes:
    sets = b"".join(len(each).to_bytes(2, "big") + each for each in parameter_sets)
    return bytes((flags | len(parameter_sets),)) + sets
