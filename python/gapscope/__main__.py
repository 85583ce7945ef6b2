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
    beside = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "gapscope-convert")
    if os.path.exists(beside):
        os.environ.setdefault("GAPSCOPE_CONVERT", beside)
    os.execv(path, [path, *sys.argv[1:]])


if __name__ == "__main__":
    main()
