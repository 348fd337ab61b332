"""All exceptions of nearfar.

Every fault a user can cause or meet is a `NearfarError` joined with the standard type that a
Python programmer would expect, so that ``except FileNotFoundError`` keeps working. A message
names the thing, says what is wrong with it, and gives the cure, in one sentence.

A message speaks to Python: a parameter is named in backticks, as `window`, an argument as
`offset='inverse'`, a call as `acquire(resume=True)`, and no message names an option of the command
line. The command line prints its own options instead, ``--near``, ``--offset inverse`` and
``acquire --resume``; see `nearfar.cli.flags`.
"""


class NearfarError(Exception):
    """Base of all faults that nearfar reports in a sentence.

    Examples
    --------
    >>> try:
    ...     transport @ np.ones((3, 3))
    ... except nearfar.NearfarError as error:
    ...     print(error)
    the light is 3x3, this transport's projector is 8x8: resize the light to 8x8.
    """


class InputError(NearfarError, ValueError):
    """A value, an array or an option that cannot be used."""


class UselessPhotosError(InputError):
    """Photos that tell of a projector that is off, or a camera that sees nothing."""


class PlanError(InputError):
    """A plan that cannot be made, read or used for what was asked."""


class MissingFileError(NearfarError, FileNotFoundError):
    """A file or folder that is not there."""


class ExistingOutputError(NearfarError, FileExistsError):
    """An output that is there already and was not to be overwritten."""


class UnreadableFileError(NearfarError, OSError):
    """A file that is damaged, truncated or of another kind."""


class StorageError(NearfarError, OSError):
    """An output that could not be written: full disk, no permission."""


class MissingPackageError(NearfarError, ImportError):
    """A package that an optional part needs and that is not installed."""


class ExtensionError(NearfarError, ImportError):
    """Something that another package adds to nearfar and that cannot be loaded or used."""


class DeviceError(NearfarError, OSError):
    """A projector or a camera that is not there, does not answer, or cannot do what was asked."""


class LostPhotoError(DeviceError):
    """A photo that did not arrive, or not whole: taking it again may help."""


class ClusterError(NearfarError, ConnectionError):
    """A scheduler that is not there, or workers that cannot do the work."""


class KeptInterrupt(KeyboardInterrupt):
    """Work that was told to stop; the message tells what is kept of it."""
