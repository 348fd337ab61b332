"""Pictures that are whole and not read."""


class UnsupportedPictureError(Exception):
    """A valid picture of a kind that is not read; its message completes a sentence."""
