"""The program as a child process: found, started, listened to, interrupted."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TypeAlias

from gapscope._errors import Bug, InputError

_DONE, _BELOW_THRESHOLD, _BAD_INPUT = 0, 1, 2
# Of the program's file: another platform's, no loader for it, a disk from which nothing is run.
CANNOT_RUN = (errno.ENOEXEC, errno.ENOENT, errno.EACCES, errno.EPERM)
_LOADER_FAILED = (1, 127)  # statuses of a program whose libraries the loader does not find
_ERROR = ("what", "where", "actual", "allowed", "cure")  # keys of an error, in the order of InputError's arguments


@dataclass(frozen=True)
class Progress:
    """How far a long call has come; None: not known.

    ``call``: a name that reports of one call share and no other call has; ``number``: which of them this is, from 0 on.
    """

    stage: str
    done: float | None
    total: float | None
    best: float | None  #: cost, of a fit
    elapsed_s: float
    call: str = ""
    number: int = 0


ProgressCallback: TypeAlias = Callable[[Progress], object]


class Reports:
    """The reports of one call, each told to its callback, if it has one."""

    def __init__(self, progress: ProgressCallback | None) -> None:
        self._progress = progress
        self._call = uuid.uuid4().hex
        self._number = 0

    def tell(
        self, stage: str, done: float | None, total: float | None, best: float | None, elapsed_s: float
    ) -> None:
        if self._progress is not None:
            report = Progress(stage, done, total, best, elapsed_s, self._call, self._number)
            self._number += 1
            self._progress(report)


@dataclass(frozen=True)
class Finished:
    stdout: str
    messages: tuple[str, ...]  # lines for people on stderr
    interrupted: bool


# A folder whose removal is a Ctrl-C to the children of this thread: it reaches those on other machines too.
_wanted: ContextVar[Path | None] = ContextVar("_wanted", default=None)
_LOOK_S = 0.2  # between looks whether it is there


@contextlib.contextmanager
def while_there(folder: Path) -> Iterator[None]:
    """Interrupts what `run` runs in this block once ``folder`` is gone."""
    before = _wanted.set(folder)
    try:
        yield
    finally:
        _wanted.reset(before)


def home() -> Path:
    """The package's folder in a wheel; in a checkout its build folder."""
    package = Path(__file__).resolve().parent
    return package if (package / "bin").is_dir() else package.parents[1] / "build"


def program() -> Path:
    """The program that is run: $GAPSCOPE_PROGRAM, else the wheel's own, else the checkout's build."""
    given = os.environ.get("GAPSCOPE_PROGRAM")
    path = Path(given) if given else home() / "bin" / "gapscope"
    if not os.access(path, os.X_OK):
        raise InputError(
            "the program is not there",
            where=str(path),
            allowed="a program of Linux on x86-64",
            cure="install the wheel, or build the checkout: cmake --build --preset release",
        )
    return path


# What the loader says before the program's first line: of a C library that is too old, of one that is not there.
_LOADERS = re.compile(r"version `[\w.]+' not found|error while loading shared libraries|Error (loading|relocating) ")


def not_executable(path: str | Path, reason: str) -> InputError:
    return InputError(
        "the program does not run on this machine",
        str(path),
        reason,
        "Linux on x86-64 with glibc 2.35 or newer (Ubuntu 22.04, Debian 12)",
        "install the wheel on such a machine or in a container of one, or build the checkout on this one: scripts/test",
    )


def _environment() -> dict[str, str]:
    """The program finds this package's converter even where the environment is not activated."""
    converter = Path(sys.executable).with_name("gapscope-convert")
    return {**({"GAPSCOPE_CONVERT": str(converter)} if converter.exists() else {}), **os.environ}


def option_words(options: Mapping[str, object] | None) -> list[str]:
    """Options by name as the program is given them: True is the flag alone, None and False are left out."""
    words: list[str] = []
    for name, value in (options or {}).items():
        if value is True:
            words.append(f"--{name}")
        elif value is not False and value is not None:
            for one in value if isinstance(value, (list, tuple)) else [value]:
                words += [f"--{name}", str(one)]
    return words


def run(arguments: Sequence[str], progress: ProgressCallback | None = None) -> Finished:
    """Runs a command to its end. Ctrl-C goes to the child exactly once, and what it then still writes is kept.

    A second Ctrl-C, or an exception in the callback, kills the child.
    """
    command = [str(program()), *arguments, "--progress", "json"]
    # stdout goes to a file: a pipe would have to be read beside stderr.
    with tempfile.TemporaryFile("w+", encoding="utf-8") as stdout:
        with _start(command, stdout) as child:
            listener = _Listener(child, progress)
            try:
                with listener.watching(_wanted.get()):
                    status, text = listener.listen(stdout)
            except BaseException:
                child.kill()
                raise
    loader = next((line for line in listener.messages if _LOADERS.search(line)), None)
    if status in _LOADER_FAILED and not text and loader is not None:
        raise not_executable(command[0], loader)
    if status in (_DONE, _BELOW_THRESHOLD):
        return Finished(text, tuple(listener.messages), listener.interrupted)
    if listener.interrupted:
        return Finished("", tuple(listener.messages), True)
    if status == _BAD_INPUT and listener.error is not None:
        raise listener.error
    raise Bug(f"gapscope ended with status {status}", command, "\n".join(listener.messages))


def _start(command: list[str], stdout: IO[str]) -> subprocess.Popen[str]:
    """A session of its own: the terminal's Ctrl-C reaches Python alone."""
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
            env=_environment(),
        )
    except OSError as error:
        if error.errno not in CANNOT_RUN:  # too many arguments, no memory ...
            raise
        raise not_executable(command[0], str(error.strerror)) from None


class _Listener:
    """Lines of a child's stderr: progress, the error, and messages; and the child's one interruption."""

    def __init__(self, child: subprocess.Popen[str], progress: ProgressCallback | None) -> None:
        self._child = child
        self._reports = Reports(progress)
        self._lock = threading.Lock()
        self.interrupted = False
        self.messages: list[str] = []
        self.error: InputError | None = None

    def listen(self, stdout: IO[str]) -> tuple[int, str]:
        """To the child's end: its status, and what it has written to ``stdout``. A second Ctrl-C is raised."""
        assert self._child.stderr is not None
        before = False
        while True:
            try:
                for line in self._child.stderr:
                    self._take(line)
                status = self._child.wait()
                stdout.seek(0)
                return status, stdout.read()
            except KeyboardInterrupt:
                if before:
                    raise
                before = True
                self._interrupt()

    @contextlib.contextmanager
    def watching(self, wanted: Path | None) -> Iterator[None]:
        """Interrupts the child once ``wanted`` is gone."""
        if wanted is None:
            yield
            return
        over = threading.Event()

        def look() -> None:
            while wanted.exists():
                if over.wait(_LOOK_S):
                    return
            self._interrupt()

        threading.Thread(target=look, daemon=True).start()
        try:
            yield
        finally:
            over.set()

    def _interrupt(self) -> None:
        with self._lock:
            if not self.interrupted:
                self.interrupted = True
                self._child.send_signal(signal.SIGINT)

    def _take(self, line: str) -> None:
        line = line.rstrip("\n")
        try:
            data = json.loads(line) if line.startswith("{") else None
        except json.JSONDecodeError:
            data = None
        if isinstance(data, dict) and "stage" in data:
            self._reports.tell(data["stage"], data["done"], data["total"], data["best"], data["elapsed_s"])
        elif isinstance(data, dict) and "error" in data:
            self.error = InputError(*(data["error"].get(name, "") for name in _ERROR))  # a newer program may say more
        elif line:
            self.messages.append(line)
