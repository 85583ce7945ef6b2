"""``gapscope ...`` and ``python -m gapscope ...``: the program itself, in place of this process."""

import os
import sys

from gapscope._errors import InputError
from gapscope._program import CANNOT_RUN, not_executable, program

_BAD_INPUT = 2


def main() -> None:
    try:
        _become(str(program()))
    except InputError as error:
        print(f"gapscope: {error}", file=sys.stderr)
        sys.exit(_BAD_INPUT)


def _become(path: str) -> None:
    for neighbour in (sys.argv[0], sys.executable):
        converter = os.path.join(os.path.dirname(os.path.abspath(neighbour)), "gapscope-convert")
        if os.path.exists(converter):
            os.environ.setdefault("GAPSCOPE_CONVERT", converter)
    try:
        os.execv(path, [path, *sys.argv[1:]])
    except OSError as error:
        if error.errno not in CANNOT_RUN:
            raise
        raise not_executable(path, str(error.strerror)) from None


if __name__ == "__main__":
    main()
