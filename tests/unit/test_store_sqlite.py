"""Rows go into SQLite and come back the same, whatever happens to the process that wrote them."""

import math
import os
import signal
import sqlite3
import subprocess
import sys
from dataclasses import astuple, fields

import pandas as pd
import pytest

from wsnsim.errors import OutputError
from wsnsim.records import ROW_TYPES, EnergyRow, EventRow, MessageRow, NodeRow, TruthRow, ViewRow
from wsnsim.store.derived import write_table
from wsnsim.store.reader import RunStore
from wsnsim.store.writer import SqliteSink


def event(i):
    return EventRow(i * 0.1, f"mote{i % 3}", "skipped", f"frame {i} — ünïcode 'quoted' \"too\"")


def test_every_record_type_has_its_table_with_its_fields(tmp_path):
    SqliteSink(tmp_path / "r.sqlite").close()
    store = RunStore(tmp_path / "r.sqlite")
    assert store.tables == tuple(row_type.table for row_type in ROW_TYPES)
    for row_type in ROW_TYPES:
        frame = store.table(row_type.table)
        assert list(frame.columns) == [field.name for field in fields(row_type)]
        assert len(frame) == 0


def test_rows_come_back_in_order_with_their_types(tmp_path):
    rows = [
        MessageRow(7, "weights", "c1", "base", 0.25, 0.3, 8080, 78, 2, "delivered"),
        MessageRow(8, "weights", "c2", "base", 0.25, None, 8080, 78, None, "dropped_queue"),
        MessageRow(9, "state", "base", "c1", 0.1 + 0.2, 1e-300, 80, 1, 1, "fused", fused_into=3),
    ]
    with SqliteSink(tmp_path / "r.sqlite") as sink:
        for row in rows:
            sink.write(row)
    frame = RunStore(tmp_path / "r.sqlite").table("messages")
    assert frame["message"].dtype == "int64"
    assert frame["hops"].dtype == "Int64"
    assert frame["delivered_s"].dtype == "float64"
    assert frame["fused_into"].tolist() == [pd.NA, pd.NA, 3]
    assert frame["created_s"].tolist() == [0.25, 0.25, 0.1 + 0.2]
    assert math.isnan(frame["delivered_s"][1])
    assert frame["outcome"].tolist() == ["delivered", "dropped_queue", "fused"]


def test_text_and_extreme_numbers_survive(tmp_path):
    with SqliteSink(tmp_path / "r.sqlite") as sink:
        sink.write(event(1))
        sink.write(ViewRow(0.1, "c1", "box", math.nan, math.inf))
        sink.write(EnergyRow("c1", "radio", "listen", 5e-324, -0.0))
    store = RunStore(tmp_path / "r.sqlite")
    assert store.table("events")["detail"][0] == event(1).detail
    assert math.isnan(store.table("views")["visible_px"][0])
    assert store.table("views")["pixel_share"][0] == math.inf
    assert store.table("energy")["seconds"][0] == 5e-324


def test_closing_leaves_one_single_file(tmp_path):
    sink = SqliteSink(tmp_path / "r.sqlite")
    sink.write(event(0))
    sink.close()
    sink.close()
    assert [file.name for file in tmp_path.iterdir()] == ["r.sqlite"]


def test_a_reader_that_holds_the_file_open_does_not_break_closing(tmp_path):
    sink = SqliteSink(tmp_path / "r.sqlite")
    sink.write(event(0))
    sink.flush()
    sink._connection.execute("PRAGMA busy_timeout = 10")
    other = sqlite3.connect(tmp_path / "r.sqlite")
    other.execute("BEGIN")
    other.execute("SELECT * FROM events").fetchall()
    sink.write(event(1))
    sink.close()
    other.close()
    assert len(RunStore(tmp_path / "r.sqlite").table("events")) == 2


KILLED = """
import os, signal, sys
from pathlib import Path
from wsnsim.records import EventRow
from wsnsim.store import writer
writer._BATCH_ROWS = 100
writer._BATCH_S = 1e9
sink = writer.SqliteSink(Path(sys.argv[1]))
for i in range(1050):
    sink.write(EventRow(i * 0.1, "mote", "kind", str(i)))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_run_keeps_all_but_its_last_batch(tmp_path):
    path = tmp_path / "r.sqlite"
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], env=_environment(), check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.with_name("r.sqlite-wal").exists()
    assert RunStore(path).table("events")["detail"].tolist() == [str(i) for i in range(1000)]


DISK_FULL = """
import resource, sys
from pathlib import Path
from wsnsim.errors import OutputError
from wsnsim.records import EventRow
from wsnsim.store.writer import SqliteSink
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
sink = SqliteSink(Path(sys.argv[1]))
try:
    for i in range(20_000):
        sink.write(EventRow(i * 0.1, "mote", "kind", "x" * 100))
except OutputError as error:
    print(error)
"""


def test_a_full_disk_is_told_with_the_file_and_what_to_do(tmp_path):
    path = tmp_path / "r.sqlite"
    done = subprocess.run(
        [sys.executable, "-c", DISK_FULL, str(path)],
        env=_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert str(path) in done.stdout
    assert "free some space, or choose a folder on another disk with --out" in done.stdout


def _environment():
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}


def test_a_sink_never_writes_over_a_file(tmp_path):
    (tmp_path / "r.sqlite").write_text("mine")
    with pytest.raises(OutputError, match="must not exist yet"):
        SqliteSink(tmp_path / "r.sqlite")
    assert (tmp_path / "r.sqlite").read_text() == "mine"


def test_a_folder_that_is_missing_is_told(tmp_path):
    with pytest.raises(OutputError, match=r"nowhere.*unable to open.*--out"):
        SqliteSink(tmp_path / "nowhere" / "r.sqlite")


def test_files_of_others_and_of_other_versions_are_refused(tmp_path):
    foreign = sqlite3.connect(tmp_path / "foreign.sqlite")
    foreign.execute("CREATE TABLE t (x)")
    foreign.close()
    with pytest.raises(OutputError, match="must be a results file of wsnsim"):
        RunStore(tmp_path / "foreign.sqlite")
    (tmp_path / "text.sqlite").write_text("no database at all, and long enough to be read as a header" * 20)
    with pytest.raises(OutputError, match="must be a readable results file"):
        RunStore(tmp_path / "text.sqlite")
    SqliteSink(tmp_path / "r.sqlite").close()
    newer = sqlite3.connect(tmp_path / "r.sqlite")
    newer.execute("PRAGMA user_version = 999")
    newer.close()
    with pytest.raises(OutputError, match="schema version must be 1, got 999"):
        RunStore(tmp_path / "r.sqlite")
    with pytest.raises(OutputError, match="results file must exist"):
        RunStore(tmp_path / "none.sqlite")


def test_unknown_tables_are_told_with_the_known_ones(tmp_path):
    SqliteSink(tmp_path / "r.sqlite").close()
    with pytest.raises(OutputError, match=r"table must be one of truth, views, .*; got 'stepps'"):
        RunStore(tmp_path / "r.sqlite").table("stepps")


def derived_table():
    return pd.DataFrame(
        {
            "time_s": [0.25, 0.5],
            "step": [1, 2],
            "track": ["box", None],
            "heard": pd.array([3, None], dtype="Int64"),
            "error_m": [0.1, math.nan],
            "lost": [False, True],
        }
    ).astype({"track": "str"})


def test_a_derived_table_keeps_its_types_and_replaces_an_older_one(tmp_path):
    path = tmp_path / "r.sqlite"
    SqliteSink(path).close()
    write_table(path, "steps", derived_table().head(1))
    write_table(path, "steps", derived_table())
    read = RunStore(path).table("steps")
    pd.testing.assert_frame_equal(read, derived_table())
    assert [file.name for file in tmp_path.iterdir()] == ["r.sqlite"]


def test_a_derived_table_never_replaces_records(tmp_path):
    path = tmp_path / "r.sqlite"
    SqliteSink(path).close()
    with pytest.raises(ValueError, match="got 'truth'"):
        write_table(path, "truth", derived_table())


def test_slots_records_and_columns_agree_for_wide_rows(tmp_path):
    values = {}
    for field in fields(NodeRow):
        values[field.name] = "n" if field.name in ("node", "role") else 1
    values["parent"] = None
    row = NodeRow(**values)
    truth = TruthRow(0.0, "box", *(float(i) for i in range(10)))
    with SqliteSink(tmp_path / "r.sqlite") as sink:
        sink.write(row)
        sink.write(truth)
    store = RunStore(tmp_path / "r.sqlite")
    assert tuple(store.table("truth").iloc[0]) == astuple(truth)
    read = store.table("nodes").iloc[0]
    assert [read[f.name] for f in fields(NodeRow) if f.name != "parent"] == [
        getattr(row, f.name) for f in fields(NodeRow) if f.name != "parent"
    ]
    assert pd.isna(read["parent"])
