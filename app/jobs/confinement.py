"""What a child may use: limits of memory, time and file size, and the files that it needs.

Files are confined by Landlock, of Linux 5.13 and later.

The lists of `vo_core.sources` keep FFmpeg from opening other files; the kernel then refuses them
too, even to code that a malicious video makes a decoder run: the token, the database, other
programs' files and, from Linux 6.7 on, TCP. With an older kernel, or without Landlock, only the
lists apply.

Interface: include/uapi/linux/landlock.h, Documentation/userspace-api/landlock.rst.
"""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import site
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

import app
from app.jobs.messages import Limits

_OPEN_FILES = 64
_CPU_GRACE_S = 5
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
"""System calls, whose numbers are the same on every architecture."""
_ASK_FOR_VERSION, _PATH_BENEATH, _PORT, _NO_NEW_PRIVILEGES = 1, 1, 2, 38
_WRITE_FILE, _READ_FILE, _READ_FOLDER = 1 << 1, 1 << 2, 1 << 3
_REMOVE_FILE, _MAKE_FILE, _TRUNCATE = 1 << 5, 1 << 8, 1 << 14
_FILES_OF_VERSION = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1}
"""All file rights known to each version; later ones concern devices."""
_TCP, _CONNECT, _TCP_SINCE = 0b11, 0b10, 4
_SCOPES = 0b11
"""Restrict abstract unix sockets and signals to this process."""
_SCOPES_SINCE = 6
"""First version with these scopes."""
_CODE = ("/usr", "/lib", "/lib64", "/proc/self", "/sys/devices/system/cpu")
_ABSENT = (errno.ENOSYS, errno.EOPNOTSUPP, errno.EPERM)
"""Errors if Landlock is not built in, not enabled, or blocked in a container."""


def set_limits(limits: Limits) -> None:
    """Limit address space, processor time and file size of this process; disable core dumps."""
    _set(resource.RLIMIT_AS, limits.memory_bytes)
    _set(resource.RLIMIT_NOFILE, _OPEN_FILES)
    _set(resource.RLIMIT_FSIZE, limits.file_bytes)
    _set(resource.RLIMIT_CORE, 0)
    if limits.cpu_s is not None:
        # The soft limit sends SIGXCPU, which names the reason; SIGKILL at the hard limit does not.
        _set(resource.RLIMIT_CPU, limits.cpu_s, limits.cpu_s + _CPU_GRACE_S)


def _set(kind: int, soft: int, hard: int | None = None) -> None:
    _, most = resource.getrlimit(kind)
    hard = soft if hard is None else hard
    hard = hard if most == resource.RLIM_INFINITY else min(hard, most)
    resource.setrlimit(kind, (min(soft, hard), hard))


def confine(
    *, reads: Iterable[str] = (), writes: Iterable[str] = (), port: int | None = None
) -> None:
    """Restrict this process to its own code and the named files; this cannot be undone.

    Call it before starting threads: it applies only to later ones.

    Args:
        reads: Files to read, and folders with their content.
        writes: Files to change, and folders in which files may be made and deleted.
        port: TCP port to connect to; None for no port.
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
    """Return the version of the kernel's Landlock; 0 if it is missing or disabled."""
    if sys.platform != "linux":
        return 0
    try:
        return _call(_CREATE_RULESET, None, ctypes.c_size_t(0), _ASK_FOR_VERSION)
    except OSError as error:
        if error.errno not in _ABSENT:
            raise
        return 0


def _code() -> list[str]:
    """Return the interpreter, its libraries and our packages."""
    # By its place: importing vo_core here would load the decoders before the limits are set.
    own = Path(app.__file__).parent
    ours = (str(own), str(own.parent / "vo_core"))
    installed = (*site.getsitepackages(), site.getusersitepackages())
    return [*_CODE, sys.prefix, sys.base_prefix, *installed, *ours]


def _listed_by_imports() -> list[str]:
    """Return folders that imports list: file names may be read there, not contents."""
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
    """Make a system call; return its result or raise OSError."""
    answer = int(_libc.syscall(number, *arguments))
    if answer < 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))
    return answer
