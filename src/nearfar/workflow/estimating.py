"""Getting the transport of a capture ready while it goes on.

The photos are held as they come. Once enough of them are there, what takes long and hardly changes
any more is done beside the capture: what kind each camera pixel is. After the last photo the joint
estimate is made from all of them, and those kinds are not chosen again (docs/decisions/0017).
"""

import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from nearfar.capture import Capture
from nearfar.correspondence import (
    correspond_by_phase,
    correspond_by_photos,
    has_correspondence_photos,
)
from nearfar.devices import Device, require_device
from nearfar.errors import InputError
from nearfar.estimate.joint import Choices, choose_components
from nearfar.estimate.joint.problem import build_model
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import answered, measure
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import ends
from nearfar.workflow.blocks import (
    MEMORY,
    Part,
    Progress,
    prepare,
    rows_at_once,
    unheard,
    without_drift,
)
from nearfar.workflow.methods import ESTIMATORS, jointly
from nearfar.workflow.reconstruct import parts_of, reconstruct_in_blocks

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
    memory : int
        Bytes to work in. Where photos and estimate do not fit, nothing is held, and the transport
        is made from the capture's file, block by block.
    device : {"cpu", "cuda", "torch"}

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks, or the device
        is not there.
    """

    def __init__(
        self, plan: Plan, full_scale: float, *, memory: int = MEMORY, device: Device = "cpu"
    ) -> None:
        require_device(device)
        ESTIMATORS["joint"].require(plan)
        self.held: PhotosInMemory | None = None
        self._plan, self._full_scale = plan, full_scale
        self._memory, self._device = memory, device
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

    def finish(self, capture: Capture, progress: Progress | None = None) -> Iterator[Part]:
        """Reconstruct the capture that was followed; see `nearfar.reconstruct`.

        Parameters
        ----------
        capture : Capture
            With all photos that were taken in, and no others.
        progress : callable, optional
            Told what is being done and the share done, 0 to 1.

        Yields
        ------
        Part
            In order.

        Raises
        ------
        Exception
            Whatever went wrong beside the capture, and is no fault of the photos.
        NearfarError
            As `nearfar.reconstruct`.
        """
        self._end()
        if self._fault is not None:
            raise self._fault
        report, memory = progress or unheard, self._memory
        if self.held is None:
            yield from reconstruct_in_blocks(
                capture, memory=memory, device=self._device, progress=report
            )
            return
        photos = PhotosInMemory(
            capture.plan, self.held.photos[: len(capture.plan.patterns)], self._full_scale
        )
        job = prepare(
            capture,
            method="joint",
            memory=memory,
            given=False,
            device=self._device,
            photos=photos,
            report=report,
        )
        kinds = self._choice.kinds if self._choice is not None and self.chosen_by else ()
        # All of the camera is one block, since the photos fit beside it.
        yield from parts_of(replace(job, estimate=partial(jointly, chosen=kinds)), None, report)

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
        # One more set of kinds, for the photos there are while they are chosen.
        shared, _ = ESTIMATORS["joint"].bytes_of(self._plan, photo.shape[-1])
        rest = self._memory - count * photo.nbytes - shared
        try:
            fits = rows_at_once(room, "joint", rest) >= len(photo)
        except InputError:
            # Not beside the photos; where not without them either, that is said now.
            rows_at_once(room, "joint", self._memory)
            return None
        if not fits:
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
        photos = without_drift(some, unheard)
        measurements = measure(photos, progress=self._heed)
        if has_correspondence_photos(plan):
            q = correspond_by_photos(photos).q
        else:
            try:
                q = correspond_by_phase(measurements).q
            except InputError:
                return None
        kinds = choose_components(
            measurements, q, plan.window, device=self._device, progress=self._heed
        )
        # Those for all photos, for when they are there.
        basis, multiplicity = answered(self._plan)
        build_model(basis, multiplicity, plan.window, self._device, unlit=True)
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
