"""Getting the transport of a capture ready while it goes on.

The photos are held as they come. Once enough of them are there, what takes long and hardly changes
any more is done beside the capture: what kind each camera pixel is. After the last photo the joint
estimate is made from all of them, and those kinds are not chosen again (docs/decisions/0017).
"""

import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from nearfar.capture import Capture
from nearfar.correspondence.methods import find_correspondence
from nearfar.devices import require_device
from nearfar.errors import InputError
from nearfar.estimate.joint import Choices, choose_components
from nearfar.estimate.joint.estimator import JOINT, JointEstimator
from nearfar.estimate.joint.problem import build_model
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import answered, measure
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import ends
from nearfar.progress import ignore_progress
from nearfar.workflow.reconstruction.executors import Work
from nearfar.workflow.reconstruction.job import prepare, tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.reconstruction.tiles import tile_rows

# Kinds are first chosen by this share of the photos of transport, to see how long it takes.
FIRST = 0.5
# By this share they are as good as by all: within 0.1 dB, where half of them costs up to 0.6.
ENOUGH = 0.8
# Another choice must gain this share.
MORE = 0.1
# Of fewer camera pixels a few that change their kind show, and all is quickly done anyway.
FEWEST = 1000
# How long a photo takes is told by the last of them.
TIMED = 32
# It is begun while what is left of the capture is longer, by this factor, than it will take.
EARLY = 1.5


class _EndedError(Exception):
    """The capture ended before the choice was made."""


class _Choice(NamedTuple):
    """Kinds by the first photos, and the seconds it took to choose them."""

    photos: int
    kinds: Choices
    seconds: float


class RunningEstimate:
    """Follows a capture photo by photo; its transport is there soon after the last.

    Use it as a context: leaving it ends what is under way.

    Parameters
    ----------
    plan : Plan
    full_scale : float
        Value of full scale of the photos.
    options : ReconstructionOptions, optional
        Of the joint method. Where photos and estimate do not fit in their memory, no photo is kept
        in memory, and the transport is made from the capture's file, tile by tile.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks, or the device
        is not there.
    """

    def __init__(
        self, plan: Plan, full_scale: float, options: ReconstructionOptions | None = None
    ) -> None:
        self._options = options or ReconstructionOptions()
        require_device(self._options.device)
        JOINT.require(plan)
        self.held: PhotosInMemory | None = None
        self._plan, self._full_scale = plan, full_scale
        self._ends = ends(plan)
        told = np.cumsum([isinstance(pattern, Sinusoid) for pattern in plan.patterns])
        self._share = np.concatenate([[0.0], told / told[-1]])
        self._times: deque[float] = deque(maxlen=TIMED)
        self._taken = 0
        self._fault: BaseException | None = None
        self._choice: _Choice | None = None
        self._under_way: Future[_Choice | None] | None = None
        self._ended = False
        self._beside = ThreadPoolExecutor(max_workers=1)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self._end()

    def after_photo(self, number: int, photo: NDArray[Any]) -> None:
        """Take in a photo, (Cy, Cx, channels).

        Raises
        ------
        InputError
            With the first photo, if a row of the camera does not fit in the memory.
        """
        if number == 0:
            self.held = self._room_for(photo)
        if self.held is None:
            return
        self.held.photos[number] = photo
        self._times.append(time.monotonic())
        self._taken = taken = number + 1
        self._take_choice()
        if self._under_way is None and taken in self._ends and self._is_time(taken):
            self._under_way = self._beside.submit(self._choose, taken)

    def finish(self, capture: Capture) -> Work:
        """Return the reconstruction that remains after the last photo.

        Parameters
        ----------
        capture : Capture
            With all photos that were taken in, and no others.

        Raises
        ------
        Exception
            Whatever went wrong beside the capture, and is no fault of the photos.
        NearfarError
            As `nearfar.workflow.reconstruction.job.tiling_of`.
        """
        self._end()
        if self._fault is not None:
            raise self._fault
        options = self._options
        photos: PhotosInMemory | None = None
        choices: Choices = ()
        if self.held is not None:
            photos = PhotosInMemory(
                capture.plan, self.held.photos[: len(capture.plan.patterns)], self._full_scale
            )
            # All of the camera is one tile, since the photos fit beside it.
            choices = self._choice.kinds if self._choice is not None and self.chosen_by else ()
        estimator = JointEstimator(choices=choices)
        preparing = partial(prepare, capture, options, None, estimator=estimator, photos=photos)
        tiling = tiling_of(capture, options, given=False)
        return Work(capture, options, None, tiling, preparing)

    @property
    def chosen_by(self) -> int:
        """How many photos the kinds were chosen by; 0 where they will be by all."""
        if self._choice is None:
            return 0
        enough = self._share[self._choice.photos] >= ENOUGH * self._share[self._taken]
        return self._choice.photos if enough else 0

    def _room_for(self, photo: NDArray[Any]) -> PhotosInMemory | None:
        """Make room for all photos, if they fit beside the estimate of the whole camera."""
        count = len(self._plan.patterns)
        shape = (count, *photo.shape)
        room = PhotosInMemory(self._plan, np.broadcast_to(photo[:1, :1], shape), self._full_scale)

        def fits(memory: int) -> bool:
            tiling = tile_rows(self._plan, room.camera, room.channels, JOINT, JOINT.halo, memory)
            return tiling.rows == room.camera.height

        # One more set of prior components, for the photos there are while they are chosen.
        shared = JOINT.memory(self._plan, room.channels).shared
        try:
            if not fits(self._options.memory - count * photo.nbytes - shared):
                return None
        except InputError:
            # Not beside the photos; where not without them either, that is a fault now.
            fits(self._options.memory)
            return None
        return PhotosInMemory(self._plan, np.empty(shape, photo.dtype), self._full_scale)

    def _is_time(self, taken: int) -> bool:
        """Tell whether to choose kinds now, rather than later or never."""
        count = len(self._plan.patterns)
        assert self.held is not None
        few = self.held.camera.pixels < FEWEST
        if few or self._fault is not None or self._share[taken] < FIRST or taken == count:
            return False
        if self._choice is None:
            return True
        gained = self._share[taken] - self._share[self._choice.photos]
        if gained < MORE or not self._fits(taken):
            return False
        later = [end for end in self._ends if taken < end < count]
        return not later or not self._fits(later[0])

    def _fits(self, taken: int) -> bool:
        """Tell whether choosing by so many photos would be over before the last photo."""
        assert self._choice is not None
        each = (self._times[-1] - self._times[0]) / max(1, len(self._times) - 1)
        seconds = self._choice.seconds * taken / self._choice.photos
        return EARLY * seconds < each * (len(self._plan.patterns) - taken)

    def _choose(self, taken: int) -> _Choice | None:
        """Choose kinds by the first photos; None where they do not settle q."""
        with threadpool_limits(1, "blas"):
            return self._chosen(taken)

    def _chosen(self, taken: int) -> _Choice | None:
        begun = time.monotonic()
        assert self.held is not None
        plan = self._plan.first(taken)
        some = PhotosInMemory(plan, self.held.photos[:taken], self._full_scale)
        photos = photos_without_drift(some, ignore_progress)
        measurements = measure(photos, progress=self._heed)
        try:
            q = find_correspondence(photos, measurements).q
        except InputError:
            return None
        kinds = choose_components(
            measurements, q, plan.window, device=self._options.device, progress=self._heed
        )
        # Those for all photos, for when they are there.
        basis, multiplicity = answered(self._plan)
        build_model(basis, multiplicity, plan.window, self._options.device, unlit=True)
        return _Choice(taken, kinds, time.monotonic() - begun)

    def _heed(self, _done: float) -> None:
        if self._ended:
            raise _EndedError

    def _take_choice(self) -> None:
        """Take what was chosen meanwhile."""
        if self._under_way is None or not self._under_way.done():
            return
        done, self._under_way = self._under_way, None
        if done.cancelled():
            return
        fault = done.exception()
        if fault is None:
            self._choice = done.result() or self._choice
        elif not isinstance(fault, _EndedError | InputError):
            # No fault of this work may cost photos: it is told after the last of them. So is what
            # is wrong with the photos themselves, by the estimate.
            self._fault = fault

    def _end(self) -> None:
        """End what is under way, and take what it found."""
        self._ended = True
        self._beside.shutdown(wait=True, cancel_futures=True)
        self._take_choice()
