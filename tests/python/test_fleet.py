"""A merged fleet's tables, read as they were written."""

import sqlite3
from pathlib import Path

import pytest

import gapscope as gs
from gapscope import fleet

UNITS = """task,robot,day,log,state,error,verdict,probability,nominal,left,gap,report
01,007,2,"a, b.csv",done,,effects,0.9,0.2,0.02,3.5,reports/01/report.html
02,007,3,c.csv,failed,"""
PROBLEM = '"no ""time"" column"'


def work(folder: Path) -> Path:
    (folder / "units.csv").write_text(UNITS + PROBLEM + ",,,,,,\n")
    statements = "task,robot,day,statement,answer,probability\n01,007,2,backlash@arm,present,0.9\n"
    (folder / "statements.csv").write_text(statements)
    (folder / "parameters.csv").write_text("task,robot,day,parameter,unit,value,low,high\n01,007,2,arm.mass,kg,1.5,,\n")
    return folder


def test_sqlite_has_texts_as_texts_and_numbers_as_numbers(tmp_path: Path) -> None:
    path = fleet.to_sqlite(work(tmp_path))
    base = sqlite3.connect(path)
    done = base.execute("SELECT robot, log, gap FROM units WHERE state = 'done'").fetchall()
    assert done == [("007", "a, b.csv", 3.5)]
    assert base.execute("SELECT error, gap FROM units WHERE state = 'failed'").fetchone() == ('no "time" column', None)
    joined = "SELECT value, low, verdict FROM parameters JOIN units USING (task)"
    assert base.execute(joined).fetchall() == [(1.5, None, "effects")]
    base.close()
    assert fleet.to_sqlite(tmp_path) == path  # again, over it
    assert not [file for file in tmp_path.iterdir() if file.name.startswith(".")]


def test_dataframes_have_the_same(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    found = fleet.read_fleet(work(tmp_path))
    assert list(found.units.robot) == ["007", "007"]
    assert found.units.gap[0] == 3.5 and found.units.gap.isna()[1]
    assert found.statements.answer[0] == "present"


def test_what_is_not_merged_is_refused(tmp_path: Path) -> None:
    with pytest.raises(gs.InputError, match="fleet merge"):
        fleet.to_sqlite(tmp_path)
