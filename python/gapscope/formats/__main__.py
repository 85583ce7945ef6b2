"""The converter that the program starts: gapscope-convert FILE --out TABLE.npz.

Findings go to stdout, a line each. What is refused: status 2, and five lines: what, where, actual, allowed, cure.
"""

from __future__ import annotations

import argparse
import sys

from gapscope._errors import InputError
from gapscope._log import read


def main() -> int:
    parser = argparse.ArgumentParser(prog="gapscope-convert", description="A log of another tool as one NPZ table.")
    parser.add_argument("file", help="MAT, HDF5, Parquet, Feather, ROS bag, LeRobot dataset#EPISODE")
    parser.add_argument("--out", required=True, help="the table, .npz")
    parser.add_argument("--topic", action="append", default=[], help="of a bag; more than once")
    parser.add_argument("--variable", default="", help="of a MAT file, or a group of an HDF5 file")
    parser.add_argument("--time", default="", help="the column of stamps")
    given = parser.parse_args()
    try:
        log = read(given.file, topics=given.topic, variable=given.variable, time=given.time)
        log.save(given.out)
    except InputError as error:
        for text in (error.what, error.where, error.actual, error.allowed, error.cure):
            print(" ".join(str(text).split()))
        return 2
    for finding in log.findings:
        print(finding)
    return 0


if __name__ == "__main__":
    sys.exit(main())
