"""Errors of lapswarm. Each says where it is: in which file, on which line, in which field."""

from __future__ import annotations

from pathlib import Path


class Error(Exception):
    """What all errors of lapswarm are.

    file: the file, or the name of what was given; line: the line of a text file, from 1; field: the setting, field, column or
    channel. Each is None where it does not apply.
    """

    def __init__(
        self,
        message: str,
        file: str | None = None,
        line: int | None = None,
        field: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.field = field


class InputError(Error, ValueError):
    """A file, a setting or an array holds something that it must not."""


class MemoryLimitError(InputError):
    """Something takes more memory than is allowed."""


class FileError(Error):
    """A file cannot be read or written."""


class DeviceError(Error, RuntimeError):
    """No device fits what was asked for, or one failed while it worked."""


class StudyError(Error, RuntimeError):
    """A study did not come to a result."""


class Interrupted(Error):
    """A study was interrupted before it had a result; ``folder`` holds its state, for ``resume=True``."""

    def __init__(
        self,
        message: str,
        file: str | None = None,
        line: int | None = None,
        field: str | None = None,
        folder: str | None = None,
    ) -> None:
        super().__init__(message, file, line, field)
        self.folder = None if folder is None else Path(folder)
