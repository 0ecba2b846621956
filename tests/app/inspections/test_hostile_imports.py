"""Small files that want much: they are refused with a sentence, and the server stays as it is."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from multiprocessing.connection import Pipe
from pathlib import Path

import msgspec
import pytest
from reports import report
from wincan_files import project

from app.errors import InvalidImport
from app.imports import any_file
from app.imports.surveys import wincan
from app.imports.surveys.survey import ImportedFile
from app.inspections.brought_in.file_reader import FileReader
from app.jobs.confinement import landlock_version
from app.jobs.messages import Failed, Limits, encode
from app.jobs.requests.importer import ImportRequest
from app.reports.exchange.chainage_json import write

MIB = 2**20
MOST_GROWTH_BYTES = 150 * MIB
"""Of this process: the file, what is found in it, and what the allocator keeps."""

READER = FileReader(Limits(768 * MIB, cpu_s=30, reads=()))


def peak_bytes() -> int:
    """Largest memory of this process since `reset_peak`."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


def reset_peak() -> int:
    """Begin anew with what it has now, which is returned."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak_bytes()


def refused(content: bytes, read: Callable[[bytes], object] = READER.read) -> str:
    """The sentence; the server must not have grown by it, nor the reader where it reads here."""
    before = reset_peak()
    with pytest.raises(InvalidImport) as refusal:
        read(content)
    assert peak_bytes() - before < MOST_GROWTH_BYTES
    assert str(refusal.value).endswith(".")
    return str(refusal.value)


def report_with(**parts: object) -> bytes:
    return json.dumps(json.loads(write(report()).content) | parts).encode()


def test_a_report_in_which_all_is_missing_costs_the_server_nothing(is_long: bool) -> None:
    refused(report_with(track={"columns": {"status": ["x"] * 1_500_000}}))
    if is_long:
        refused(report_with(tags=[{}] * 1_500_000))
        refused(report_with(events=[{"x": 1}] * 1_000_000))
        refused(report_with(sightings=[[]] * 2_000_000))


def test_a_report_that_needs_more_memory_than_there_is_is_refused_in_a_sentence() -> None:
    reader = FileReader(Limits(512 * MIB, cpu_s=30, reads=()))
    nested = b'{"schema": "chainage-report/2", "x": [' + b"[]," * (6 * MIB) + b"[]]}"
    assert "more memory" in refused(nested, reader.read)


def test_a_report_that_takes_too_long_is_refused_in_a_sentence() -> None:
    reader = FileReader(Limits(2048 * MIB, cpu_s=1, reads=()))
    objects = b'{"schema": "chainage-report/2", "x": [' + b"{}," * (16 * MIB) + b"{}]}"
    assert "took longer" in refused(objects, reader.read)


@pytest.mark.long
def test_events_that_say_very_much_are_refused() -> None:
    at = "2026-09-14T09:42:00Z"
    hostile = {"at": at, "who": "x", "action": "created", "before": {"a": [[]] * 1_200_000}}
    content = json.loads(report_with(events=[hostile]))
    content["inspection"]["video"] |= {"width": 256, "height": 160}
    assert "events contain more" in refused(json.dumps(content).encode())


def test_one_name_that_stands_twice_among_many_is_found_at_once() -> None:
    names = b", ".join(b'"n%d": 0' % n for n in range(60_000))
    content = b'{"schema": "chainage-report/2", ' + names + b', "n59999": 1}'
    assert "'n59999' occurs twice" in refused(content, any_file.read)


def test_blank_lines_are_no_work() -> None:
    assert "none of the known formats" in refused(b"\n" * MIB, any_file.read)


def test_a_default_that_swells_every_row_is_refused(tmp_path: Path) -> None:
    more = (
        f"ALTER TABLE SECOBS ADD COLUMN OBS_Memo TEXT DEFAULT '{'x' * 500_000}'",
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 5000) "
        "INSERT INTO SECINSP (INS_PK) SELECT i FROM n",
        f"ALTER TABLE SECINSP ADD COLUMN INS_Memo TEXT DEFAULT '{'y' * 500_000}'",
    )
    assert "more than surveys do" in refused(project(tmp_path / "p.db3", more=more))


LAUGHS = b"""<?xml version="1.0"?>
<!DOCTYPE DATA [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<DATA><ZB><AAA>&b;</AAA></ZB></DATA>"""


def test_xml_that_grows_when_it_is_read_is_refused(is_long: bool) -> None:
    assert "defines a document type or entities" in refused(LAUGHS, any_file.read)
    if is_long:
        assert "more elements than surveys do" in refused(
            b"<DATA>" + b"<A/>" * 1_100_000 + b"</DATA>"
        )


_TAKEN_OVER = """
import sqlite3, sys
from app.errors import InvalidImport
from app.imports.surveys import wincan
from app.jobs.requests import importer

secret = sys.argv[2]

def attempt(action):
    try:
        action()
    except (OSError, sqlite3.OperationalError) as error:
        return f"refused ({error})"
    return "opened"

def read(content):
    text = attempt(lambda: open(secret).read())
    database = attempt(lambda: sqlite3.connect(secret).execute("SELECT * FROM sqlite_master"))
    new = attempt(lambda: open(secret + ".new", "w"))
    raise InvalidImport(f"text {text}; database {database}; new {new}.")

wincan.read = read
importer.main()
"""


def test_a_project_that_takes_over_its_reader_opens_no_other_file(tmp_path: Path) -> None:
    """The reader is replaced as if a fault in SQLite had let the file run its own code."""
    secret = tmp_path / "other.db3"
    content = project(secret)
    ours, theirs = Pipe()
    code = [sys.executable, "-P", "-c", _TAKEN_OVER, str(theirs.fileno()), str(secret)]
    root = str(Path(wincan.__file__).parents[3])
    with subprocess.Popen(code, pass_fds=[theirs.fileno()], env={"PYTHONPATH": root}):
        theirs.close()
        ours.send_bytes(encode(ImportRequest(Limits(768 * MIB, cpu_s=30), content)))
        answer = msgspec.msgpack.decode(ours.recv_bytes(), type=Failed)
        ours.close()
    done = "refused" if landlock_version() else "opened"  # an old kernel cannot refuse it
    for what in ("text", "database", "new"):
        assert f"{what} {done}" in answer.detail


def test_a_large_column_that_nobody_reads_is_no_matter(tmp_path: Path) -> None:
    unread = f"ALTER TABLE SECOBS ADD COLUMN OBS_Notes TEXT DEFAULT '{'x' * 900_000}'"
    before = reset_peak()
    found = READER.read(project(tmp_path / "p.db3", more=(unread,)))
    assert isinstance(found, ImportedFile)
    assert len(found.surveys) == 2
    assert peak_bytes() - before < MOST_GROWTH_BYTES


def test_a_survey_of_2000_defects_is_read() -> None:
    rows = "".join(f"{n / 10:.2f};BAB;remark number {n}\n" for n in range(2000))
    found = any_file.read(f"#B01=AAA;AAB;AAF\nC;N1;N2\n#C=I;A;F\n{rows}#Z\n".encode())
    assert isinstance(found, ImportedFile)
    assert len(found.surveys[0].observations) == 2000
    assert found.warnings == found.surveys[0].warnings == ()
