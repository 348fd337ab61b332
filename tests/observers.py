"""Observers of captures for tests."""

from nearfar.capture import Decision


class EndsWhere:
    """Ends a capture where a function of a photo's number and the photo returns true."""

    def __init__(self, is_enough):
        self._is_enough = is_enough

    def after_photo(self, number, photo):
        return Decision.ENOUGH if self._is_enough(number, photo) else Decision.CONTINUE
