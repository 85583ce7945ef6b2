"""Tables of files that are slow to read, kept by the digest of all that they are made from."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import json
import os
import shutil
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from gapscope.formats._table import Source

MOST_BYTES = 2 << 30  # in all; what was used longest ago goes first


def folder() -> Path:
    """Where tables are kept: under $GAPSCOPE_CACHE_DIR, else under the user's own cache."""
    given = os.environ.get("GAPSCOPE_CACHE_DIR")
    users = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(given or Path(users) / "gapscope") / "tables"


def through_cache(
    path: Path, source: Source, libraries: Sequence[str], out: Path, convert: Callable[[Path], object]
) -> None:
    """Writes the table of ``path`` to ``out``, as ``convert`` does with ``libraries``: from the cache if it is there.

    Nothing that is wrong with the cache is an error: what is damaged there is replaced, what cannot be kept is not.
    """
    try:
        files = _files(path)
        if source.msgs:
            files |= {f"msgs/{name}": file for name, file in _files(Path(source.msgs)).items()}
        before = _stamps(files)
        entry = folder() / f"{_digest(path, source, libraries, files)}.npz"
        if _is_whole(entry):
            shutil.copyfile(entry, out)
            os.utime(entry)
            return
    except OSError:  # of the file: the converter tells it; of the entry: others have just removed it
        convert(out)
        return
    convert(out)
    with contextlib.suppress(OSError):
        if _stamps(files) == before and out.stat().st_size <= MOST_BYTES:  # else it is still being recorded
            _keep(out, entry)
            _prune(entry.parent)


def _files(path: Path) -> dict[str, Path]:
    """By their names in the folder; of a file itself."""
    if not path.is_dir():
        return {path.name: path}
    return {str(file.relative_to(path)): file for file in sorted(path.rglob("*")) if file.is_file()}


def _stamps(files: Mapping[str, Path]) -> list[tuple[int, int]]:
    return [(stat.st_size, stat.st_mtime_ns) for stat in map(os.stat, files.values())]


def _digest(path: Path, source: Source, libraries: Sequence[str], files: Mapping[str, Path]) -> str:
    """Of the bytes, the names, what is asked for, and the code that converts with its libraries."""
    package = Path(__file__).resolve().parents[1]
    code = {file.name: file for file in (package / "_log.py", *Path(__file__).parent.glob("*.py"))}
    asked = {**asdict(source), "msgs": "", "path": path.name, "libraries": [_version(name) for name in libraries]}
    digest = hashlib.blake2b(json.dumps(asked).encode(), digest_size=32)
    for name, file in sorted(code.items()) + list(files.items()):
        one = hashlib.blake2b()
        with file.open("rb") as stream:
            while chunk := stream.read(1 << 20):
                one.update(chunk)
        digest.update(name.encode("utf-8", "surrogateescape") + b"\0" + one.digest())
    return digest.hexdigest()


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return ""


def _is_whole(entry: Path) -> bool:
    try:
        with zipfile.ZipFile(entry) as archive:
            return archive.testzip() is None
    except Exception:  # whatever a ZIP of wrong bytes leads to
        return False


def _keep(table: Path, entry: Path) -> None:
    """A copy under a name of its own, renamed when it is whole: others may be at it too."""
    entry.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    number, name = tempfile.mkstemp(dir=entry.parent, suffix=".part")
    os.close(number)
    try:
        shutil.copyfile(table, name)
        os.replace(name, entry)
    finally:
        Path(name).unlink(missing_ok=True)


def _prune(kept: Path) -> None:
    entries = [(entry.stat(), entry) for entry in kept.iterdir()]
    left = sum(stat.st_size for stat, _ in entries)
    for stat, entry in sorted(entries, key=lambda one: one[0].st_mtime_ns):
        if left <= MOST_BYTES:
            return
        entry.unlink(missing_ok=True)
        left -= stat.st_size
