"""What to project, and why."""

from nearfar.plan.choose import choose_plan
from nearfar.plan.model import GrayCode, Plan, Sinusoid, Stripe, parse_plan, read_plan
from nearfar.plan.paper import paper_plan
from nearfar.plan.references import with_references

__all__ = [
    "GrayCode",
    "Plan",
    "Sinusoid",
    "Stripe",
    "choose_plan",
    "paper_plan",
    "parse_plan",
    "read_plan",
    "with_references",
]
