"""Logs from memory: checked, and handed to the program as one NPZ table, without a detour over text."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from gapscope._errors import InputError, Interrupted, import_needed
from gapscope._experiment import Experiment
from gapscope._program import run
from gapscope.formats import Source, Table, format_of
from gapscope.formats.apart import convert, load_table

if TYPE_CHECKING:
    import pandas as pd

Floats: TypeAlias = npt.NDArray[np.float64]
SCHEMA = "gapscope.log/1"
_TIMES = {"time_s", "time", "t", "timestamp", "stamp", "__time", "time_ms", "time_us", "time_ns", "timestamp_ns"}


class Log:
    """A hardware log.

    ``data`` is a path to a file that the program reads: CSV, NPZ, bam JSON, a SAGE folder. Or it is one of another
    tool's format (docs/reference/formats.md): MAT, HDF5, Parquet, ROS bags, MCAP, LeRobot. In memory it is a pandas
    DataFrame, a structured array, or a mapping of names to arrays. Arrays are of shape (rows,), or (rows, n), which
    become ``NAME[0]`` ... ``NAME[n - 1]``. Values are in the units that the experiment file states; NaN is a missing
    value.

    ``time`` names the column of stamps; without it a DataFrame's index of times is taken, else a column named like a
    time. ``time_unit`` is "s", "ms", "us" or "ns"; without it the program guesses from name and size, and says so.
    Dates become seconds from the first. ``units`` says of columns in memory what they are in, {"q": "deg"}: `inspect`
    shows it, and an experiment that takes a column in another unit is refused. Nothing is converted. ``header`` holds
    numbers and texts of the whole log (``values: {header: kp}`` of an experiment). ``name`` is what results call the
    log.

    Stamps that are missing, repeat or go back are refused here: in memory they are a mistake. In files they are
    repaired as the experiment says.

    ``findings`` is what reading found; ``clock`` says of each column of a foreign format what its stamps are: "header"
    (the message's own), "receive", "sampled" or "synthetic".

    >>> log = Log({"time_s": [0.0, 0.1], "u": [1, 2], "q": [[0, 1], [2, 3]]}, name="step")
    >>> log.columns
    ('time_s', 'u', 'q[0]', 'q[1]')
    """

    def __init__(
        self,
        data: Any,
        *,
        time: str | None = None,
        time_unit: str | None = None,
        units: Mapping[str, str] | None = None,
        header: Mapping[str, float | str] | None = None,
        name: str = "",
    ) -> None:
        self.path: Path | None = None
        self.name = name
        self.time = time
        self._table: dict[str, Floats] = {}
        self._header = dict(header or {})
        self._units: dict[str, str] = {}
        self._stated: dict[str, str] = {}
        self._joined = False
        self.findings: tuple[str, ...] = ()
        self.clock: dict[str, str] = {}
        if isinstance(data, (str, os.PathLike)) and format_of(data) is not None:
            if time_unit is not None or header or units:
                raise InputError(
                    "a file says itself what its header and units are", os.fspath(data), cure="leave them out"
                )
            (table,) = convert(data, Source(time=time or ""), every=False)
            self._take_table(table)
            return
        if isinstance(data, (str, os.PathLike)):
            if time is not None or time_unit is not None or header or units:
                raise InputError(
                    "a file says itself what its time, units and header are",
                    where=os.fspath(data),
                    allowed="time, time_unit, units and header for data in memory",
                    cure="state them in the experiment file: log: {time: {column: NAME, unit: s}}",
                )
            self.path = Path(data)
            if not self.path.exists():
                raise InputError("no such file", where=str(self.path), cure="name the right log")
            return
        self._take(data)
        self._take_units(time_unit, units or {})
        self._check()

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, as the program reads them."""
        return tuple(self._load())

    @property
    def units(self) -> dict[str, str]:
        """Of the columns whose unit is known by the file, or was stated."""
        self._load()
        return dict(self._units)

    def check_units(self, experiment: Experiment) -> None:
        """Raises InputError: the experiment takes a column in another unit than was stated."""
        experiment.check_units(self.name or "Log", self._stated)

    def __getitem__(self, column: str) -> Floats:
        """A column, shape (rows,), in the log's own unit."""
        table = self._load()
        if column not in table:
            raise InputError("no such column", repr(self), repr(column), ", ".join(table))
        return table[column]

    def to_pandas(self) -> "pd.DataFrame":
        """The table of shape (rows, columns), time as a column, in the log's own units.

        Raises MissingLibrary: there is no pandas.
        """
        frame: pd.DataFrame = import_needed("pandas", "no pandas for a DataFrame", "pandas").DataFrame(self._load())
        return frame

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the table as NPZ (``gapscope.log/1``), which the program reads to the last bit."""
        target = Path(path)
        if self.path is not None:
            with converted(self.path) as table:
                return Path(shutil.copyfile(table, target))
        names = list(self._table)
        meta: dict[str, Any] = {"schema": SCHEMA, "name": self.name, "names": names}
        meta["units"] = [self._units.get(name, "") for name in names]
        meta["header"] = self._header
        meta["findings"] = [{"kind": "converted", "column": "", "count": 1, "text": text} for text in self.findings]
        if self.clock:
            meta["clock"] = [self.clock.get(name, "") for name in names]
        if self._joined:
            meta["missing"] = "keep"
        if self.time is not None:
            meta["time"] = self.time
        text = np.frombuffer(json.dumps(meta, allow_nan=False).encode(), dtype=np.uint8)
        with target.open("wb") as file:
            arrays: dict[str, Any] = {"meta": text, **{f"c{k}": self._table[name] for k, name in enumerate(names)}}
            np.savez(file, **arrays)
        return target

    def __repr__(self) -> str:
        if self.path is not None:
            return f"Log({str(self.path)!r})"
        rows = len(next(iter(self._table.values())))
        return f"Log({self.name + ': ' if self.name else ''}{rows} rows of {', '.join(self._table)})"

    def _load(self) -> dict[str, Floats]:
        if self.path is not None and not self._table:
            with converted(self.path) as table:
                read = load_table(table)
                self._table, self._units = dict(read.columns), dict(read.units)
        return self._table

    @classmethod
    def of_table(cls, table: Table) -> Log:
        """A log of what a reader gave."""
        log = cls.__new__(cls)
        log.path, log.name = None, ""
        log._take_table(table)
        return log

    def _take_table(self, table: Table) -> None:
        self._table, self.time, self._joined = dict(table.columns), table.time, table.joined
        self.name = self.name or table.name
        self._header, self._units, self._stated = dict(table.header), dict(table.units), {}
        self.findings, self.clock = table.findings, dict(table.clock)

    # How data in memory becomes the table.

    def _take(self, data: Any) -> None:
        if _is_frame(data):
            self._take_frame(data)
        elif isinstance(data, np.ndarray) and data.dtype.names:
            self._guess_time(data.dtype.names)
            for name in data.dtype.names:
                self._add(name, data[name])
        elif isinstance(data, Mapping):
            self._guess_time(data)
            for name, values in data.items():
                self._add(name, values)
        else:
            raise InputError(
                "not a log",
                "Log",
                type(data).__name__,
                "a path, a pandas DataFrame, a mapping of names to arrays, a structured array",
                "an array without names: {'time_s': a[:, 0], 'q': a[:, 1]}",
            )

    def _take_units(self, time_unit: str | None, units: Mapping[str, str]) -> None:
        for name, unit in units.items():
            columns = [one for one in self._table if one == name or re.fullmatch(re.escape(name) + r"\[\d+\]", one)]
            if not columns or not isinstance(unit, str):
                raise InputError("no unit of a column", "units", f"{name!r}: {unit!r}", ", ".join(self._table))
            self._stated.update(dict.fromkeys(columns, unit))
        of_time = self._stated.pop(self.time or "", None)
        if time_unit is not None and of_time not in (None, time_unit):
            raise InputError("two units of time", "time_unit, units", f"{time_unit!r}, {of_time!r}", "one")
        unit_of_time = time_unit or of_time
        if unit_of_time not in (None, "s", "ms", "us", "ns"):
            raise InputError("not a unit of time", "time_unit", repr(unit_of_time), "s, ms, us, ns")
        self._units.update(self._stated)
        if unit_of_time is not None and self.time is not None:
            self._units[self.time] = unit_of_time

    def _guess_time(self, names: Iterable[Any]) -> None:
        if self.time is None:
            self.time = next((name for name in names if isinstance(name, str) and name.lower() in _TIMES), None)

    def _take_frame(self, frame: Any) -> None:
        if frame.columns.nlevels > 1:
            raise InputError(
                "columns of several levels",
                "DataFrame.columns",
                f"a MultiIndex of {frame.columns.nlevels} levels",
                "one level of names",
                "df.columns = ['/'.join(map(str, c)) for c in df.columns]",
            )
        if frame.index.nlevels > 1:
            raise InputError(
                "an index of several levels",
                "DataFrame.index",
                f"a MultiIndex of {frame.index.nlevels} levels",
                "one log: one level",
                "pick one log, df.xs(KEY), or make the levels columns, df.reset_index()",
            )
        if self.time is None and frame.index.dtype.kind in "mM":
            self.time = str(frame.index.name or "time_s")
            if self.time in frame.columns:
                raise InputError(
                    "index and column of one name", "DataFrame", repr(self.time), "one", "df.index.name = 'time_s'"
                )
            self._add(self.time, frame.index)
        self._guess_time(frame.columns)
        for position, name in enumerate(frame.columns):
            self._add(name, frame.iloc[:, position])

    def _add(self, name: Any, values: Any) -> None:
        if not isinstance(name, str) or not name:
            raise InputError(
                "a column whose name is no text", "Log", repr(name), "text", "df.columns = df.columns.map(str)"
            )
        if name in self._table:
            raise InputError(
                "two columns of one name",
                "Log",
                repr(name),
                "each name once",
                "df = df.loc[:, ~df.columns.duplicated()]",
            )
        numbers = self._numbers(name, values)
        if numbers.ndim == 1:
            self._table[name] = numbers
            return
        if numbers.ndim != 2 or name == self.time:
            raise InputError("an array of no column's shape", repr(name), str(numbers.shape), "(rows,), (rows, n)")
        for k in range(numbers.shape[1]):
            self._table[f"{name}[{k}]"] = np.ascontiguousarray(numbers[:, k])

    def _numbers(self, name: str, values: Any) -> Floats:
        kind = getattr(getattr(values, "dtype", None), "kind", "")
        if hasattr(values, "to_numpy") and kind in "buif":
            # pandas' own numbers too, whose missing values are not NaN.
            return np.ascontiguousarray(values.to_numpy(dtype=np.float64, na_value=np.nan))
        if hasattr(values, "to_numpy") and kind in "mM":
            # With a time zone numpy would make objects of them.
            values = values.to_numpy(dtype="datetime64[ns]" if kind == "M" else "timedelta64[ns]")
        array = np.asarray(values)
        if array.dtype.kind in "mM":
            return self._seconds(name, array)
        if array.dtype.kind not in "buif":
            raise InputError(
                "a column that does not hold numbers",
                repr(name),
                f"dtype {getattr(values, 'dtype', array.dtype)}",
                "booleans, integers, floats; dates only as the time",
                f"df[{name!r}] = pd.to_numeric(df[{name!r}], errors='coerce'), or df = df.drop(columns=[{name!r}])",
            )
        return np.ascontiguousarray(array, dtype=np.float64)

    def _seconds(self, name: str, stamps: npt.NDArray[Any]) -> Floats:
        if self.time is None:
            self.time = name
        if name != self.time:
            raise InputError(
                "dates in a column that is not the time",
                repr(name),
                f"dtype {stamps.dtype}",
                "numbers",
                f"time={name!r}, or df = df.drop(columns=[{name!r}])",
            )
        if np.isnat(stamps).any():
            raise self._missing_stamp(name, int(np.flatnonzero(np.isnat(stamps))[0]), "NaT")
        self._units[name] = "s"
        steps = (stamps - stamps[0]).astype("timedelta64[ns]") if len(stamps) else stamps.astype("timedelta64[ns]")
        return np.asarray(steps.astype(np.int64) * 1e-9, dtype=np.float64)

    # What must hold for all of it.

    def _check(self) -> None:
        if not self._table:
            raise InputError("a log without columns", "Log", "nothing", "a time and signals")
        lengths = {name: len(values) for name, values in self._table.items()}
        rows = next(iter(lengths.values()))
        for name, length in lengths.items():
            if length != rows:
                raise InputError(
                    "columns of different lengths",
                    repr(name),
                    f"{length} rows, {rows} in {next(iter(lengths))!r}",
                    "one length",
                    "was one of them recorded at another rate? Put NaN where there is no value",
                )
        if self.time is None:
            return
        if self.time not in self._table:
            raise InputError("no such column for the time", "Log", repr(self.time), ", ".join(self._table))
        self._check_stamps(self.time, self._table[self.time])

    def _check_stamps(self, name: str, stamps: Floats) -> None:
        finite = np.isfinite(stamps)
        if not finite.all():
            row = int(np.flatnonzero(~finite)[0])
            raise self._missing_stamp(name, row, str(stamps[row]))
        steps = np.diff(stamps)
        if (steps > 0).all():
            return
        row = int(np.flatnonzero(~(steps > 0))[0]) + 1
        repeats = steps[row - 1] == 0
        raise InputError(
            "a time stamp that repeats" if repeats else "time goes back",
            f"column {name!r}, row {row}",
            f"{float(stamps[row])!r} after {float(stamps[row - 1])!r}",
            "stamps that grow from row to row",
            f"df = df.drop_duplicates({name!r})"
            if repeats
            else f"df = df.sort_values({name!r}); or were two recordings joined? Give each as a Log of its own",
        )

    @staticmethod
    def _missing_stamp(name: str, row: int, actual: str) -> InputError:
        return InputError(
            "a row without a time stamp",
            f"column {name!r}, row {row}",
            actual,
            "a time in every row",
            f"df = df.dropna(subset=[{name!r}])",
        )


@contextlib.contextmanager
def converted(path: Path) -> Iterator[Path]:
    """A file that the program reads, as this package's own table, alone in a folder that is gone afterwards.

    Raises InputError: as `read`. Interrupted: Ctrl-C came first.
    """
    with tempfile.TemporaryDirectory(prefix="gapscope_") as folder:
        if run(["convert", str(path), "--out", folder, "--json"]).interrupted:
            raise Interrupted
        (table,) = Path(folder).iterdir()
        yield table


def _is_frame(data: Any) -> bool:
    return hasattr(data, "iloc") and hasattr(data, "columns") and hasattr(data, "index")


def read(
    path: str | os.PathLike[str],
    exp: Experiment | str | os.PathLike[str] | Mapping[str, Any] | None = None,
    **source: str | Sequence[str],
) -> Log:
    """A log in a file of any format that is known (docs/reference/formats.md). Of a dataset's episodes: "dataset#3".

    Its columns are of shape (rows,), in the file's own units.

    >>> log = read("demo/qube.csv")
    >>> log.columns
    ('time_s', 'voltage_v', 'arm_rad', 'pendulum_rad')
    >>> log["arm_rad"].shape
    (5001,)

    ``exp`` is an experiment whose ``log: {source: {...}}`` says what to take of the file. ``source`` are the same keys,
    before those of the experiment. A bag has ``topics``, else all are read, and ``msgs``, a folder of .msg files.
    ``variable`` is of a MAT file, or a group of an HDF5 file. ``time`` is the column of stamps where its name does not
    say it; ``joints`` are names of the elements of arrays.

    Raises InputError: nothing is there, not a known format, its library is not installed, damaged, too large, several
    recordings.
    """
    if format_of(path) is None:
        return Log(path)
    (table,) = convert(path, _asked(path, exp, source), every=False)
    return Log.of_table(table)


def read_all(
    path: str | os.PathLike[str],
    exp: Experiment | str | os.PathLike[str] | Mapping[str, Any] | None = None,
    **source: str | Sequence[str],
) -> tuple[Log, ...]:
    """Every recording of a file or folder, as `read`: of a LeRobot dataset its episodes ("dataset#0:20": some)."""
    if format_of(path) is None:
        return (Log(path),)
    return tuple(Log.of_table(table) for table in convert(path, _asked(path, exp, source), every=True))


def _asked(path: str | os.PathLike[str], exp: Any, source: Mapping[str, Any]) -> Source:
    if exp is not None:
        source = {**(exp if isinstance(exp, Experiment) else Experiment(exp)).log_source(), **source}
    return Source.of(source, os.fspath(path))
