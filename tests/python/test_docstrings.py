"""Every public name of the package says what it is; what holds arrays says their shape and unit."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterator
from typing import Any

import gapscope as gs
import pytest

ARRAYS = ("Floats", "ndarray", "NDArray", "Traces", "DataFrame")  # in an annotation


def members(kind: type) -> Iterator[tuple[str, str, Any]]:
    """Name, docstring and annotations of a class's own public functions and properties."""
    for base in kind.__mro__:
        if not base.__module__.startswith("gapscope"):
            continue
        for name, value in vars(base).items():
            function = getattr(value, "fget", None) or getattr(value, "__func__", value)
            if inspect.isfunction(function) and not name.startswith("_"):
                yield f"{kind.__name__}.{name}", function.__doc__ or "", function.__annotations__


def documented() -> dict[str, tuple[str, dict[str, Any]]]:
    """By name the docstring and the annotations of all that is public."""
    found = {}
    for name in gs.__all__:
        public = getattr(gs, name)
        doc = public.__doc__ or ""
        if dataclasses.is_dataclass(public) and doc.startswith(f"{name}("):
            doc = ""  # made of its fields
        found[name] = (doc, dict(getattr(public, "__annotations__", {})))
        if inspect.isclass(public):
            found.update((member, (text, notes)) for member, text, notes in members(public))
    return found


DOCUMENTED = documented()


@pytest.mark.parametrize("name", DOCUMENTED)
def test_a_public_name_says_what_it_is(name: str) -> None:
    doc, annotations = DOCUMENTED[name]
    assert doc.strip(), f"{name} has no docstring"
    if any(kind in str(note) for note in annotations.values() for kind in ARRAYS):
        assert "shape" in doc, f"{name} holds arrays and does not say their shape"
        assert "unit" in doc or "SI" in doc, f"{name} holds arrays and does not say their unit"
