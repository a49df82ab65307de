"""Errors that a user can cause; the command line shows each as one line and exits with 2."""

__all__ = ["DNFError", "DataError", "DenoiseWarning", "MeshError", "MeshFileError", "OptionError", "WeightsError"]


class DNFError(Exception):
    """Base of every error raised for bad input; its text names the value seen and the remedy."""


class MeshError(DNFError, ValueError):
    """A mesh whose geometry or topology cannot be processed."""


class MeshFileError(DNFError, OSError):
    """A mesh file that cannot be read or written."""


class WeightsError(DNFError, ValueError):
    """Weights that are missing, damaged or of another architecture."""


class DataError(DNFError, ValueError):
    """A training or test data set whose folder or files are not as expected."""


class OptionError(DNFError, ValueError):
    """An option or argument that is unknown, missing or out of its range."""


class DenoiseWarning(UserWarning):
    """A property of the input or the result that makes a denoised mesh less reliable."""
