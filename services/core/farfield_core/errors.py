"""What can go wrong, each in one sentence that says what is wrong and what to do."""

from __future__ import annotations


class FarfieldError(Exception):
    """Something a user can act on; `str(error)` is one sentence fit for the user."""

    #: exit code of the command line
    exit_code = 1


class BadInputError(FarfieldError):
    """What the user gave cannot be used: a setting, a corridor, a request."""

    exit_code = 2


class SceneRefusedError(BadInputError):
    """A model file that cannot be read; the sentence names the file and the cause."""

    exit_code = 3


class NotFoundError(FarfieldError):
    """There is nothing under that name."""

    exit_code = 4


class AlreadyExistsError(FarfieldError):
    """A create-only object is there already."""

    exit_code = 5


class BakeFailedError(FarfieldError):
    """A bake ended with cells that could not be baked."""

    exit_code = 6
