"""The physical split of a transport: direct light, subsurface light and inter-reflection."""

from nearfar.estimate.physical.error_bars import PhysicalErrorBars
from nearfar.estimate.physical.split import PhysicalComponents, PhysicalSplit
from nearfar.estimate.physical.splitting import split_physically

__all__ = ["PhysicalComponents", "PhysicalErrorBars", "PhysicalSplit", "split_physically"]
