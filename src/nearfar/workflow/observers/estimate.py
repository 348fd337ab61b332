"""The joint estimate of a capture, prepared while its photos are taken.

Photos are kept in memory. Choosing a prior component for each camera pixel takes most of the
estimate's time, and the choice hardly changes once most photos are there. A thread makes it from
the photos so far while the capture goes on; the estimate from all photos then starts from that
choice (docs/decisions/0017).
"""

import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.capture import Capture
from nearfar.correspondence.methods import find_correspondence
from nearfar.devices import require_device
from nearfar.errors import InputError
from nearfar.estimate.joint import Choices, choose_components
from nearfar.estimate.joint.estimator import JOINT, JointEstimator
from nearfar.estimate.joint.problem import build_model
from nearfar.illumination.near_basis import NearBasis
from nearfar.parallel import single_threaded_products
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure, measured_basis
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import ends
from nearfar.progress import ignore_progress
from nearfar.workflow.reconstruction.executors import Work
from nearfar.workflow.reconstruction.job import prepare, tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.sources import photos_without_drift
from nearfar.workflow.reconstruction.tiles import tile_rows

# Of the photos of transport: the share from which components are first chosen, mostly to measure
# how long a choice takes.
FIRST_CHOICE_SHARE = 0.5
# The share from which a choice is as good as one from all photos: within 0.1 dB, where a choice
# from half of them costs up to 0.6.
SUFFICIENT_SHARE = 0.8
# The share that must be new for another choice.
MINIMUM_NEW_SHARE = 0.1
# With fewer camera pixels the estimate is quick anyway, and a few components that change later
# would show in pictures.
MINIMUM_CAMERA_PIXELS = 1000
# The time that a photo takes is the mean over this many of the last photos.
TIMED_PHOTOS = 32
# A choice is started only if the rest of the capture lasts this many times as long as the choice.
TIME_MARGIN = 1.5


class _CaptureEndedError(Exception):
    """The capture ended before the choice was made."""


class _EarlyChoice(NamedTuple):
    """Prior components chosen from the first photos, and the seconds that it took."""

    photos: int
    components: Choices
    seconds: float


class EstimateObserver:
    """Prepares the joint estimate of a capture while its photos are taken.

    Use it as a context manager: on leaving, the thread that chooses components is stopped.

    Parameters
    ----------
    plan : Plan
    full_scale : float
        Value of full scale of the photos.
    options : ReconstructionOptions, optional
        For the joint method. If the photos and the estimate of the whole camera do not both fit in
        `options.memory`, no photo is kept in memory, and the transport is estimated from the
        capture's file, tile by tile.

    Attributes
    ----------
    photos : PhotosInMemory or None
        Room for all photos of the plan, filled as they come; None before the first photo, and
        where they do not fit.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern has no inverse, if a plan by reference has no white or no black, or if the
        device is not there.
    """

    def __init__(
        self, plan: Plan, full_scale: float, options: ReconstructionOptions | None = None
    ) -> None:
        self._options = options or ReconstructionOptions()
        if self._options.method != "joint" or self._options.square:
            raise InputError(
                "while capturing, only `method='joint'` makes a transport, and no `square` one: "
                "give these options to nearfar.reconstruct after the capture."
            )
        require_device(self._options.device)
        JOINT.require(plan)
        self.photos: PhotosInMemory | None = None
        self._plan, self._full_scale = plan, full_scale
        self._ends = ends(plan)
        sinusoids = np.cumsum([isinstance(pattern, Sinusoid) for pattern in plan.patterns])
        # By the number of photos taken: the share of the photos of transport among them.
        self._share = np.concatenate([[0.0], sinusoids / sinusoids[-1]])
        self._photo_times: deque[float] = deque(maxlen=TIMED_PHOTOS)
        self._taken = 0
        self._fault: BaseException | None = None
        self._choice: _EarlyChoice | None = None
        self._pending_choice: Future[_EarlyChoice | None] | None = None
        self._capture_ended = False
        self._thread = ThreadPoolExecutor(max_workers=1)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self._stop_choosing()

    def after_photo(self, number: int, photo: NDArray[Any]) -> None:
        """Keep a photo, (Cy, Cx, channels), and start a choice of components if it is time.

        Raises
        ------
        InputError
            At the first photo, if the estimate of one camera row does not fit in the memory.
        """
        if number == 0:
            self.photos = self._room_for(photo)
        if self.photos is None:
            return
        self.photos.photos[number] = photo
        self._photo_times.append(time.monotonic())
        self._taken = taken = number + 1
        self._collect_choice()
        if self._pending_choice is None and taken in self._ends and self._is_time(taken):
            self._pending_choice = self._thread.submit(self._choose, taken)

    def finish(self, capture: Capture) -> Work:
        """Return the reconstruction that remains after the last photo.

        Parameters
        ----------
        capture : Capture
            The one that was observed, with all its photos.

        Raises
        ------
        Exception
            Any error of the thread that chose components, except errors of the photos themselves:
            the estimate raises those.
        NearfarError
            As `nearfar.workflow.reconstruction.job.tiling_of`.
        """
        self._stop_choosing()
        if self._fault is not None:
            raise self._fault
        options = self._options
        photos: PhotosInMemory | None = None
        choices = Choices()
        if self.photos is not None:
            photos = PhotosInMemory(
                capture.plan, self.photos.photos[: len(capture.plan.patterns)], self._full_scale
            )
            # Photos are in memory only where the whole camera is one tile, as the choice is.
            if self._choice is not None and self.chosen_by > 0:
                choices = self._choice.components
        estimator = JointEstimator(choices=choices)
        preparing = partial(prepare, capture, options, None, estimator=estimator, photos=photos)
        tiling = tiling_of(capture, options, given=False)
        return Work(capture, options, None, tiling, preparing)

    @property
    def chosen_by(self) -> int:
        """Number of photos that components were chosen from; 0 if all of them will be used."""
        if self._choice is None:
            return 0
        sufficient = SUFFICIENT_SHARE * self._share[self._taken]
        return self._choice.photos if self._share[self._choice.photos] >= sufficient else 0

    def _room_for(self, photo: NDArray[Any]) -> PhotosInMemory | None:
        """Allocate all photos, if they fit in memory beside the estimate of the whole camera."""
        count = len(self._plan.patterns)
        shape = (count, *photo.shape)
        room = PhotosInMemory(self._plan, np.broadcast_to(photo[:1, :1], shape), self._full_scale)

        def fits(memory: int) -> bool:
            tiling = tile_rows(
                self._plan, room.camera, room.channels, JOINT, JOINT.rows_beside(self._plan), memory
            )
            return tiling.rows == room.camera.height

        # A choice from the first photos has matrices of its own for every prior component.
        shared = JOINT.memory(self._plan, room.channels).shared
        try:
            if not fits(self._options.memory - count * photo.nbytes - shared):
                return None
        except InputError:
            # Not one row fits beside the photos. Raise if not one fits without them either.
            fits(self._options.memory)
            return None
        return PhotosInMemory(self._plan, np.empty(shape, photo.dtype), self._full_scale)

    def _is_time(self, taken: int) -> bool:
        """Return whether to choose components now, rather than later or never."""
        count = len(self._plan.patterns)
        assert self.photos is not None
        if self.photos.camera.pixels < MINIMUM_CAMERA_PIXELS or self._fault is not None:
            return False
        if self._share[taken] < FIRST_CHOICE_SHARE or taken == count:
            return False
        if self._choice is None:
            return True
        new = self._share[taken] - self._share[self._choice.photos]
        if new < MINIMUM_NEW_SHARE or not self._ends_in_time(taken):
            return False
        later = [end for end in self._ends if taken < end < count]
        return not later or not self._ends_in_time(later[0])

    def _ends_in_time(self, taken: int) -> bool:
        """Return whether a choice from the first `taken` photos ends before the last photo."""
        assert self._choice is not None
        times = self._photo_times
        seconds_per_photo = (times[-1] - times[0]) / max(1, len(times) - 1)
        seconds = self._choice.seconds * taken / self._choice.photos
        return TIME_MARGIN * seconds < seconds_per_photo * (len(self._plan.patterns) - taken)

    def _choose(self, taken: int) -> _EarlyChoice | None:
        """Choose components from the first photos; None if they do not determine q."""
        with single_threaded_products():
            return self._timed_choice(taken)

    def _timed_choice(self, taken: int) -> _EarlyChoice | None:
        start = time.monotonic()
        assert self.photos is not None
        plan = self._plan.first(taken)
        first = PhotosInMemory(plan, self.photos.photos[:taken], self._full_scale)
        photos = photos_without_drift(first, ignore_progress)
        measurements = measure(photos, progress=self._stop_if_ended)
        try:
            q = find_correspondence(photos, measurements).q
        except InputError:
            return None
        components = choose_components(
            measurements,
            q,
            plan.window,
            pitch=plan.pitch,
            device=self._options.device,
            progress=self._stop_if_ended,
        )
        # The estimate from all photos finds its matrices in the cache.
        basis, multiplicity = measured_basis(self._plan)
        near_basis = NearBasis(plan.window, plan.pitch)
        build_model(basis, multiplicity, near_basis, self._options.device)
        return _EarlyChoice(taken, components, time.monotonic() - start)

    def _stop_if_ended(self, _done: float) -> None:
        if self._capture_ended:
            raise _CaptureEndedError

    def _collect_choice(self) -> None:
        """Keep the choice that the thread has made meanwhile, or the error that it raised."""
        if self._pending_choice is None or not self._pending_choice.done():
            return
        done, self._pending_choice = self._pending_choice, None
        if done.cancelled():
            return
        fault = done.exception()
        if fault is None:
            self._choice = done.result() or self._choice
        elif not isinstance(fault, _CaptureEndedError | InputError):
            # Raised after the last photo, for no photo may be lost by it. An InputError is of the
            # photos, and the estimate from all of them raises it again.
            self._fault = fault

    def _stop_choosing(self) -> None:
        """Stop the thread, and keep what it has found."""
        self._capture_ended = True
        self._thread.shutdown(wait=True, cancel_futures=True)
        self._collect_choice()
