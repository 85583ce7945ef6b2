"""The converter, a process of its own: gapscope-convert FILE --out TABLE.npz --options JSON; back, --to mcap.

The program starts it, and so does this package: libraries of formats may crash on a stranger's bytes. What is refused:
status 2, and five lines on stdout: what, where, actual, allowed, cure.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import resource
import sys
from pathlib import Path

from gapscope._errors import InputError
from gapscope._log import Log
from gapscope.formats import Source, _joint_states, episodes_of, format_of, read_table, read_tables
from gapscope.formats._cache import through_cache
from gapscope.formats.apart import load_table

_MOST_BYTES = 16 << 30  # of memory, and no more than the machine has, and of a file: a small one may unpack to more
_TABLE = "{:06d}.npz"  # of a recording, in the folder of all

# What pip installs as gapscope[EXTRA], and the modules that must be there then; of PACE it is torch itself.
_EXTRAS = {
    "mat": ("scipy", "h5py"),
    "hdf5": ("h5py",),
    "parquet": ("pyarrow",),
    "ros": ("rosbags",),
    "mcap": ("mcap", "mcap_protobuf"),
    "torch": ("torch",),
}


class _PrintExtras(argparse.Action):
    """A line for each extra, "EXTRA: MODULE...": the modules that are missing. `gapscope doctor` reads it."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object, **__: object) -> None:
        for extra, modules in _EXTRAS.items():
            missing = [module for module in modules if importlib.util.find_spec(module) is None]
            print(" ".join([f"{extra}:", *missing]))
        parser.exit()


def _limit(what: int, most: int) -> None:
    soft, hard = resource.getrlimit(what)
    for limit in (soft, hard):
        most = most if limit == resource.RLIM_INFINITY else min(most, limit)
    resource.setrlimit(what, (most, hard))


def _options(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError as error:
        raise InputError("options that are not JSON", "--options", str(error), '{"topics": [...]}') from None


def _convert(file: str, source: Source, out: Path, every: bool) -> None:
    """The one recording of a file; with ``every`` all of them, into a folder. What is slow to read has one."""

    def write(target: Path) -> None:
        Log.of_table(read_table(file, source)).save(target)

    form, place = format_of(file), Path(file)
    if form is not None and form.slow and (place.is_file() or place.is_dir()):
        through_cache(place, source, form.slow, out / _TABLE.format(0) if every else out, write)
    elif every:
        for k, table in enumerate(read_tables(file, source)):
            Log.of_table(table).save(out / _TABLE.format(k))
    else:
        write(out)


def main() -> int:
    """The status: 0, or 2 where the file is refused."""
    parser = argparse.ArgumentParser(prog="gapscope-convert", description="A log of another tool as one NPZ table.")
    parser.add_argument("file", help="MAT, HDF5, Parquet, Feather, ROS bag, MCAP, PACE, LeRobot dataset#EPISODE")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--out", help="the table, .npz; with --all a folder")
    what.add_argument("--episodes", action="store_true", help="say the numbers of a dataset's episodes, a line each")
    parser.add_argument("--all", action="store_true", help="every recording of the file, 000000.npz and so on")
    parser.add_argument("--to", choices=("npz", "mcap"), default="npz", help="mcap: of a table, joint states in MCAP")
    parser.add_argument("--options", default="{}", help="JSON: topics, msgs, variable ... (docs/reference/formats.md)")
    parser.add_argument("--extras", action=_PrintExtras, nargs=0, help="say which modules of formats are missing")
    given = parser.parse_args()
    _limit(resource.RLIMIT_AS, min(_MOST_BYTES, os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")))
    _limit(resource.RLIMIT_FSIZE, _MOST_BYTES)
    try:
        source = Source.of(_options(given.options), "--options")
        if given.episodes:
            print("\n".join(map(str, episodes_of(given.file))))
        elif given.to == "mcap":
            _joint_states.write(load_table(Path(given.file)), Path(given.out))
        else:
            _convert(given.file, source, Path(given.out), given.all)
    except (InputError, MemoryError) as failure:
        error = InputError("not enough memory for this log", given.file, cure="take a part of it")
        if isinstance(failure, InputError):
            error = failure
        for text in (error.what, error.where, error.actual, error.allowed, error.cure):
            print(" ".join(str(text).split()))
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
