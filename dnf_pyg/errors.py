"""Errors that a user can cause; the command line shows each as one line and exits with 2."""

__all__ = [
    "DNFError",
    "DataError",
    "DenoiseWarning",
    "MeshError",
    "MeshFileError",
    "MeshFileWarning",
    "OptionError",
    "OutputError",
    "WeightsError",
]


class DNFError(Exception):
    """Base of every error raised for bad input; its text names the value seen and the remedy."""


class MeshError(DNFError, ValueError):
    """A mesh whose geometry or topology cannot be processed."""


class MeshFileError(DNFError, OSError):
    """A mesh file that cannot be read, or whose format is unknown."""


class OutputError(DNFError, OSError):
    """A mesh, picture, table or page that cannot be written."""


class MeshFileWarning(UserWarning):
    """Something that a mesh file names and that does not come along, such as a texture that is missing."""


class WeightsError(DNFError, ValueError):
    """Weights that are missing, damaged or of another architecture."""


class DataError(DNFError, ValueError):
    """A training or test data set whose folder or files are not as expected."""


class OptionError(DNFError, ValueError):
    """An option or argument that is unknown, missing or out of its range."""


class DenoiseWarning(UserWarning):
    """A property of the input or the result that makes a denoised mesh less reliable."""
