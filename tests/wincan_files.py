"""WinCan projects as small .db3 files, with the tables known of the program."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

TABLES = {
    "SECTION": "OBJ_PK TEXT, OBJ_Key TEXT, OBJ_FromNode_REF TEXT, OBJ_ToNode_REF TEXT, "
    "OBJ_Material TEXT, OBJ_Shape TEXT, OBJ_Size1 REAL, OBJ_Size2 REAL, OBJ_Length REAL, "
    "OBJ_PipeLength REAL, OBJ_Street TEXT, OBJ_Deleted TEXT",
    "NODE": "OBJ_PK TEXT, OBJ_Key TEXT",
    "SECINSP": "INS_PK TEXT, INS_Section_FK TEXT, INS_StartDate TEXT, INS_StartTime TEXT, "
    "INS_InspectionDir TEXT, INS_Inspector TEXT",
    "SECOBS": "OBS_PK TEXT, OBS_Inspection_FK TEXT, OBS_Distance REAL, OBS_OpCode TEXT, "
    "OBS_Char1 TEXT, OBS_Char2 TEXT, OBS_Q1_Value TEXT, OBS_Q2_Value TEXT, OBS_ClockPos1 TEXT, "
    "OBS_ClockPos2 TEXT, OBS_Observation TEXT, OBS_TimeCtr TEXT, OBS_SortOrder INTEGER, "
    "OBS_Deleted TEXT",
    "SECOBSMM": "OMM_Observation_FK TEXT, OMM_FileName TEXT",
}
ROWS: dict[str, list[dict[str, Any]]] = {
    "SECTION": [
        {"OBJ_PK": "s1", "OBJ_Key": "CUL-7", "OBJ_FromNode_REF": "n1", "OBJ_ToNode_REF": "n2",
         "OBJ_Material": "Concrete", "OBJ_Shape": "Circular", "OBJ_Size1": 900, "OBJ_Length": 24.6,
         "OBJ_PipeLength": 2.44, "OBJ_Street": "Jalan Besar"},
        {"OBJ_PK": "s2", "OBJ_Key": "CUL-8"},
    ],
    "NODE": [{"OBJ_PK": "n1", "OBJ_Key": "HW-1"}, {"OBJ_PK": "n2", "OBJ_Key": "HW-2"}],
    "SECINSP": [
        {"INS_PK": "i1", "INS_Section_FK": "s1", "INS_StartDate": "2020-07-10 00:00:00",
         "INS_StartTime": "1899-12-30 09:42:00", "INS_InspectionDir": "U",
         "INS_Inspector": "Operator 1"},
        {"INS_PK": "i2", "INS_Section_FK": "s2"},
    ],
    "SECOBS": [
        {"OBS_PK": "o2", "OBS_Inspection_FK": "i1", "OBS_Distance": 3.2, "OBS_OpCode": "BABBA",
         "OBS_Q1_Value": "2,5", "OBS_ClockPos1": "11", "OBS_Observation": "crack",
         "OBS_TimeCtr": "00:00:41", "OBS_SortOrder": 2},
        {"OBS_PK": "o1", "OBS_Inspection_FK": "i1", "OBS_Distance": 0.0, "OBS_OpCode": "BCD",
         "OBS_Char1": "XP", "OBS_TimeCtr": "00:00:00", "OBS_SortOrder": 1},
        {"OBS_PK": "o3", "OBS_Inspection_FK": "i1", "OBS_Distance": 5.0, "OBS_OpCode": "BAC",
         "OBS_Deleted": "2020-07-11", "OBS_SortOrder": 3},
        {"OBS_PK": "o4", "OBS_Inspection_FK": "i1", "OBS_Distance": None, "OBS_OpCode": "BAC",
         "OBS_SortOrder": 4},
        {"OBS_PK": "o5", "OBS_Inspection_FK": "i1", "OBS_Distance": 24.6, "OBS_OpCode": "BCE",
         "OBS_Char1": "XP", "OBS_TimeCtr": "00:05:05", "OBS_SortOrder": 5},
        {"OBS_PK": "o6", "OBS_Inspection_FK": "gone", "OBS_Distance": 1.0},
    ],
    "SECOBSMM": [{"OMM_Observation_FK": "o2", "OMM_FileName": "Picture\\\\CUL-7_1.jpg"}],
}  # fmt: skip


def project(
    path: Path, *, without: tuple[str, ...] = (), more: tuple[str, ...] = (), wal: bool = False
) -> bytes:
    """Write a project with two inspections, one of them empty.

    Args:
        path: The file to write.
        without: Names of tables to leave out.
        more: Statements to run at the end.
        wal: Whether to use a write-ahead log.
    """
    with closing(sqlite3.connect(path)) as database:
        if wal:
            database.execute("PRAGMA journal_mode=WAL")
        for name, columns in TABLES.items():
            if name in without:
                continue
            database.execute(f"CREATE TABLE {name} ({columns})")
            for row in ROWS[name]:
                marks = ", ".join("?" * len(row))
                names = ", ".join(row)
                statement = f"INSERT INTO {name} ({names}) VALUES ({marks})"  # noqa: S608
                database.execute(statement, list(row.values()))
        for statement in more:
            database.execute(statement)
        database.commit()
    return path.read_bytes()
