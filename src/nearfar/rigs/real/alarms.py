"""Alarms of a rig in their order."""

from collections.abc import Callable

from nearfar.faults.records import Fault


class AlarmLog:
    """Keeps alarms, a sentence each, and passes each on at once.

    Parameters
    ----------
    on_alarm : callable, optional
        Called with each sentence.
    """

    def __init__(self, on_alarm: Callable[[str], None] | None = None) -> None:
        self.sentences: list[str] = []
        self._on_alarm = on_alarm

    def add(self, fault: Fault) -> None:
        """Keep an alarm and pass it on."""
        sentence = str(fault)
        self.sentences.append(sentence)
        if self._on_alarm is not None:
            self._on_alarm(sentence)
