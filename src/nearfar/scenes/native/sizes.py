"""Sizes that are known before a scene is computed."""

from nearfar.arrays import Size

# Patches that the projector lights lie on a grid with this many along the shorter side, at most.
PATCHES_ALONG = 64


def patch_size(projector: Size) -> Size:
    """Return the grid that patches are made for: the projector's, or a coarser one."""
    finer = min(projector) / PATCHES_ALONG
    return projector if finer <= 1 else Size(*(round(side / finer) for side in projector))
