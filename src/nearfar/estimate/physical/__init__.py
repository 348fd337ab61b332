"""The physical split of a transport: direct light, subsurface light and inter-reflection."""

from nearfar.estimate.physical.error_bars import physical_error_bars
from nearfar.estimate.physical.split import PhysicalComponents, PhysicalSplit, split_physically

__all__ = ["PhysicalComponents", "PhysicalSplit", "physical_error_bars", "split_physically"]
