"""Confines a child to the files that it needs: Landlock, of Linux 5.13 and later.

What the lists of `vo_core.sources` keep FFmpeg from opening, the kernel then refuses too, even to
code that a malicious video makes a decoder run: the token, the database, other programs' files and,
from Linux 6.7 on, TCP.  An older kernel, or one without Landlock, leaves it at the lists.

Interface: include/uapi/linux/landlock.h, Documentation/userspace-api/landlock.rst.
"""

from __future__ import annotations

import ctypes
import errno
import os
import site
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

import app
import vo_core

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
"""System calls; these have the same number on every architecture."""
_ASK_FOR_VERSION, _PATH_BENEATH, _PORT, _NO_NEW_PRIVILEGES = 1, 1, 2, 38
_WRITE_FILE, _READ_FILE, _READ_FOLDER = 1 << 1, 1 << 2, 1 << 3
_REMOVE_FILE, _MAKE_FILE, _TRUNCATE = 1 << 5, 1 << 8, 1 << 14
_FILES_OF_VERSION = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1}
"""Every right to files that a version knows; those after 3 are about devices."""
_TCP, _CONNECT, _TCP_SINCE = 0b11, 0b10, 4
_SCOPES, _SCOPES_SINCE = 0b11, 6
"""Abstract unix sockets and signals reach no process outside."""
_CODE = ("/usr", "/lib", "/lib64", "/proc/self", "/sys/devices/system/cpu")
_ABSENT = (errno.ENOSYS, errno.EOPNOTSUPP, errno.EPERM)
"""Not built in, not switched on, kept from a container."""


def confine(
    *, reads: Iterable[str] = (), writes: Iterable[str] = (), port: int | None = None
) -> None:
    """Let this process, from now on, open only its own code and what is named.  Not to be undone.

    To be called before a thread is started: it holds for those that come later.

    Args:
        reads: Files, and folders with all that is in them.
        writes: Files that may be changed too, and folders in which they may be made and deleted.
        port: Of TCP, that may be connected to; without it there is none.
    """
    version = landlock_version()
    if not version:
        return
    files = _FILES_OF_VERSION[min(version, 3)]
    tcp = _TCP if version >= _TCP_SINCE else 0
    scopes = _SCOPES if version >= _SCOPES_SINCE else 0
    rules = struct.pack("=QQQ", files, tcp, scopes)
    ruleset = _call(_CREATE_RULESET, rules, ctypes.c_size_t(len(rules)), 0)
    try:
        for path in (*_code(), *reads):
            _allow(ruleset, path, _READ_FILE | _READ_FOLDER)
        for path in _listed_by_imports():
            _allow(ruleset, path, _READ_FOLDER)
        change = _WRITE_FILE | _REMOVE_FILE | _MAKE_FILE | (_TRUNCATE & files)
        for path in writes:
            _allow(ruleset, path, _READ_FILE | _READ_FOLDER | change)
        if port is not None and tcp:
            _call(_ADD_RULE, ruleset, _PORT, struct.pack("=QQ", _CONNECT, port), 0)
        _libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
        _call(_RESTRICT_SELF, ruleset, 0)
    finally:
        os.close(ruleset)


def landlock_version() -> int:
    """Of the kernel's Landlock; 0 without it, or if it is switched off."""
    if sys.platform != "linux":
        return 0
    try:
        return _call(_CREATE_RULESET, None, ctypes.c_size_t(0), _ASK_FOR_VERSION)
    except OSError as error:
        if error.errno not in _ABSENT:
            raise
        return 0


def _code() -> list[str]:
    """The interpreter, its libraries and our packages."""
    ours = (str(Path(package.__file__).parent) for package in (app, vo_core) if package.__file__)
    installed = (*site.getsitepackages(), site.getusersitepackages())
    return [*_CODE, sys.prefix, sys.base_prefix, *installed, *ours]


def _listed_by_imports() -> list[str]:
    """Where modules are looked for: their names may be read, not all that lies there."""
    return [path for path in sys.path if Path(path).is_dir()]


def _allow(ruleset: int, path: str, rights: int) -> None:
    if not Path(path).exists():
        return
    if not Path(path).is_dir():
        rights &= _READ_FILE | _WRITE_FILE | _TRUNCATE
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        _call(_ADD_RULE, ruleset, _PATH_BENEATH, struct.pack("=Qi", rights, place), 0)
    finally:
        os.close(place)


_libc = ctypes.CDLL(None, use_errno=True)


def _call(number: int, *arguments: object) -> int:
    """What the kernel answers, or OSError."""
    answer = int(_libc.syscall(number, *arguments))
    if answer < 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))
    return answer
