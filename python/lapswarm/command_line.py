"""The program ``lapswarm``, carried in the wheel."""

from __future__ import annotations

import sys

from . import _native


def main() -> None:
    """Runs the program with the arguments of this process and ends with its exit code."""
    sys.exit(_native.command_line(["lapswarm", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
