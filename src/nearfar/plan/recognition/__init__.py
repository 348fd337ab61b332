"""What pictures that were shown as patterns are: fringes, Gray code, stripes, and others."""

from nearfar.plan.recognition.recognise import Recognised, recognise
from nearfar.plan.recognition.summary import summarise

__all__ = ["Recognised", "recognise", "summarise"]
