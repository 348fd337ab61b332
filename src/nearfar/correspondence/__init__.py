"""Which projector pixel lights each camera pixel directly."""

from nearfar.correspondence.gray import correspond_by_gray_code, has_gray_code
from nearfar.correspondence.methods import (
    CorrespondenceMethod,
    find_correspondence,
    method_named,
    method_of,
)
from nearfar.correspondence.phase import correspond_by_phase
from nearfar.correspondence.result import (
    Correspondence,
    given_correspondence,
    joined,
    read_correspondence,
)
from nearfar.correspondence.square import onto_projector
from nearfar.correspondence.stripes import correspond_by_stripes, has_stripes

__all__ = [
    "Correspondence",
    "CorrespondenceMethod",
    "correspond_by_gray_code",
    "correspond_by_phase",
    "correspond_by_stripes",
    "find_correspondence",
    "given_correspondence",
    "has_gray_code",
    "has_stripes",
    "joined",
    "method_named",
    "method_of",
    "onto_projector",
    "read_correspondence",
]
