"""Logs in the formats of other tools, each read into one table (docs/reference/formats.md)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gapscope._errors import InputError
from gapscope.formats import _arrow, _hdf5, _lerobot, _mat, _mcap, _pace, _ros
from gapscope.formats._table import MOST_COLUMNS, Format, Source, Table, named_elements

__all__ = ["FORMATS", "Format", "Source", "Table", "episodes_of", "format_of", "read_table", "read_tables"]

# The first that knows a path reads it.
FORMATS: tuple[Format, ...] = (
    _lerobot.FORMAT,
    _mcap.FORMAT,
    _ros.FORMAT,
    _mat.FORMAT,
    _arrow.FORMAT,
    _hdf5.FORMAT,
    _pace.FORMAT,
)


def format_of(path: str | os.PathLike[str]) -> Format | None:
    """The format of a file or folder; None: one that the program reads itself, or none that is known."""
    place = Path(_without_episodes(os.fspath(path))[0])
    return next((form for form in FORMATS if form.knows(place)), None)


def read_tables(path: str | os.PathLike[str], source: Source = Source()) -> tuple[Table, ...]:
    """One table for each recording in a file or folder: of a LeRobot dataset its episodes, else one.

    Raises InputError: nothing is there, no known format, its library is not installed, damaged, too large.
    """
    text, episodes, form = _known(path)
    with _refusing(text, form):
        tables = form.read(Path(text), source if episodes is None else source.of_episodes(episodes))
    for table in tables:
        if len(table.columns) > MOST_COLUMNS:
            raise InputError("too many columns", text, str(len(table.columns)), f"at most {MOST_COLUMNS}")
        if any(len(values) == 0 for values in table.columns.values()):
            raise InputError("a log without rows", text, cure="was the recording stopped before anything was written?")
    return tuple(named_elements(table, source.joints) for table in tables) if source.joints else tables


def episodes_of(path: str | os.PathLike[str]) -> list[int]:
    """The numbers of a LeRobot dataset's episodes, or of those that the path asks for. Raises InputError, as above."""
    text, episodes, form = _known(path)
    if form is not _lerobot.FORMAT:
        raise InputError("no dataset of episodes", text, form.name, "a LeRobot dataset")
    with _refusing(text, form):
        return _lerobot.episodes(Path(text), episodes or "")


def _known(path: str | os.PathLike[str]) -> tuple[str, str | None, Format]:
    """The path without episodes, the episodes, the format."""
    text, episodes = _without_episodes(os.fspath(path))
    place, form = Path(text), format_of(path)
    if not place.exists():
        raise InputError("no such file", where=text, cure="name the right log")
    if form is None:
        raise InputError("not a known format", text, place.suffix or "no suffix", ", ".join(f.name for f in FORMATS))
    if episodes is not None and form is not _lerobot.FORMAT:
        raise InputError("episodes of what has none", text, f"#{episodes}", "a LeRobot dataset")
    return text, episodes, form


@contextmanager
def _refusing(text: str, form: Format) -> Iterator[None]:
    """Whatever a format's library raises is a refusal."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise InputError(f"not a readable {form.name}", text, reason, cure=form.cure) from None


def read_table(path: str | os.PathLike[str], source: Source = Source()) -> Table:
    """As `read_tables`, where there is one recording. Raises InputError: there are several."""
    tables = read_tables(path, source)
    if len(tables) != 1:
        raise InputError("several recordings", os.fspath(path), str(len(tables)), "one", f"{path}#0, or gs.read_all")
    return tables[0]


def _without_episodes(text: str) -> tuple[str, str | None]:
    """"dataset#3" and "dataset#0:20": where a file of that very name is there, it is that."""
    head, mark, tail = text.rpartition("#")
    if not mark or os.path.exists(text) or not tail.replace(":", "").isdigit():
        return text, None
    return head, tail
