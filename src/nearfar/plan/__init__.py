"""Plans: the patterns to project, and how they are chosen."""

from nearfar.plan.choose import choose_plan
from nearfar.plan.correspondence import CORRESPONDENCE_METHODS
from nearfar.plan.model import Plan, parse_plan, read_plan
from nearfar.plan.paper import paper_plan
from nearfar.plan.patterns import GrayCode, Pattern, Sinusoid, Stripe
from nearfar.plan.references import with_references
from nearfar.plan.window import default_window, largest_window, pitch_of

__all__ = [
    "CORRESPONDENCE_METHODS",
    "GrayCode",
    "Pattern",
    "Plan",
    "Sinusoid",
    "Stripe",
    "choose_plan",
    "default_window",
    "largest_window",
    "paper_plan",
    "parse_plan",
    "pitch_of",
    "read_plan",
    "with_references",
]
