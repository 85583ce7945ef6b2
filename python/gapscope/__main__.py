"""``gapscope ...`` and ``python -m gapscope ...``: the program itself, in place of this process."""

import os
import sys

from gapscope._errors import InputError
from gapscope._program import program


def main() -> None:
    try:
        path = str(program())
    except InputError as error:
        sys.exit(f"gapscope: {error}")
    for neighbour in (sys.argv[0], sys.executable):
        converter = os.path.join(os.path.dirname(os.path.abspath(neighbour)), "gapscope-convert")
        if os.path.exists(converter):
            os.environ.setdefault("GAPSCOPE_CONVERT", converter)
    os.execv(path, [path, *sys.argv[1:]])


if __name__ == "__main__":
    main()
