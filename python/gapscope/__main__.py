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
    os.execv(path, [path, *sys.argv[1:]])


if __name__ == "__main__":
    main()
