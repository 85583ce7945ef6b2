"""What can go wrong, as exceptions whose fields say what to do about it."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gapscope._results import Diagnosis, Tune


class InputError(ValueError):
    """An input that cannot be used: a log, an experiment, an option.

    Fields: ``what`` is wrong, ``where``, what was there (``actual``), what is ``allowed``, and the ``cure``. Only
    ``what`` is never empty.
    """

    def __init__(self, what: str, where: str = "", actual: str = "", allowed: str = "", cure: str = "") -> None:
        super().__init__(what, where, actual, allowed, cure)
        self.what, self.where, self.actual, self.allowed, self.cure = what, where, actual, allowed, cure

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}" if self.where else self.what
        if self.actual:
            text += f": got {self.actual}"
        if self.allowed:
            text += (", " if self.actual else ": ") + f"allowed: {self.allowed}"
        return f"{text}; {self.cure}" if self.cure else text


class MissingLibrary(InputError, ModuleNotFoundError):
    """A library that this call needs cannot be imported; ``cure`` is what pip installs. Also a ModuleNotFoundError."""


def import_needed(module: str, what: str, install: str) -> Any:
    """A library when it is needed first. Raises MissingLibrary: it cannot be imported; ``what`` says whose need."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingLibrary(what, module, str(error), cure=f"pip install {install}") from None


class Bug(RuntimeError):
    """The program ended as it never should. ``command`` and ``stderr`` belong into the report of it."""

    def __init__(self, what: str, command: list[str], stderr: str) -> None:
        super().__init__(what, command, stderr)
        self.what, self.command, self.stderr = what, command, stderr

    def __str__(self) -> str:
        return f"{self.what}\ncommand: {' '.join(self.command)}\n{self.stderr}".rstrip()


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a search. ``partial`` is the best so far; None where there was nothing to save.

    Of `diagnose_many` a mapping, as the call would have returned.
    """

    def __init__(self, partial: "Tune | Diagnosis | Mapping[str, Diagnosis | Exception] | None" = None) -> None:
        super().__init__(partial)
        self.partial: Any = partial

    def __str__(self) -> str:
        return "interrupted" if self.partial is None else "interrupted; .partial holds the best so far"
