"""The grades of verdicts."""

from typing import Literal

Grade = Literal["good", "doubtful", "wrong"]
