"""Equation (10) for all camera pixels at once.

With the uniform near set the rows of the measurement matrix are orthogonal, so the measured part
of a window n is n0, the part that no photo saw is Z z with few unknowns z, and the Lagrangian of
equation (10),

    minimise over n   1/2 |n0 - (1 - Z Z^T) n|^2 + lambda |n|_1,

becomes, after n is minimised out, a Huber regression in z alone: the sum over the window of
huber_lambda(v), v = n0 + Z z. Entries beyond the projector's border are known to be zero and
count 1/2 v^2. Then n = soft_lambda(v), and the residual is the sum of min(|v|, lambda)^2. Each
row's lambda, which stands for its epsilon, is the one of least expected error at the noise that
its photos show (Stein's unbiased risk estimate).

Index convention: rows i run over camera pixels and channels, w over the W^2 window entries.
"""

from typing import NamedTuple

from array_api_compat import device

from nearfar.arrays import Booleans, Floats, namespace

# Most reweighting steps. A row has settled when it changes by less than these shares of lambda and
# of its largest entry together.
MAXIMUM_STEPS = 60
LAMBDA_TOLERANCE = 0.01
SIZE_TOLERANCE = 1e-6
# The noise-free corner of |.|_1 is reached under a floor, at first this share of a row's largest
# entry, that shrinks by this factor at each step.
FIRST_FLOOR = 0.3
FLOOR_FACTOR = 0.6
# A lambda of less than this share of a row's largest entry is close to that corner.
CORNER_SHARE = 1e-3
# lambda is looked for among these shares of an entry's noise.
LAMBDA_SHARES = (0.125, 0.25, 0.375, 0.5, 0.75, 1.0, 1.5, 2.0)
# Keeps weights defined in a window of zeros.
WIDTH_FLOOR = 1e-30
# Share of the trace of the normal equations that is added to their diagonal.
RIDGE = 1e-9


def solve(
    n0: Floats,
    unseen: Floats,
    inside: Booleans,
    threshold: Floats,
    start: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Minimise the Lagrangian of equation (10) with a given lambda for each row.

    Parameters
    ----------
    n0 : ndarray, shape (I, W^2), float32
        Measured part of each window, orthogonal to `unseen`.
    unseen : ndarray, shape (W^2, m)
        Z.
    inside : ndarray of bool, shape (I, W^2)
        Window entries on the projector.
    threshold : ndarray, shape (I,)
        lambda >= 0; 0 asks for the noise-free problem, min |n|_1 with the data met.
    start : ndarray, shape (I, m), optional
        Where to start z.

    Returns
    -------
    n : ndarray, shape (I, W^2), float32
    z : ndarray, shape (I, m)
    """
    rows, unknowns = len(n0), unseen.shape[1]
    xp, here = namespace(n0), device(n0)
    if start is None:
        z = xp.zeros((rows, unknowns), dtype=n0.dtype, device=here)
    else:
        z = xp.asarray(start, copy=True)
    if unknowns and rows:
        scale = xp.max(xp.abs(n0), axis=1)
        largest = float(xp.max(xp.abs(unseen)))
        # Each row stops by itself, so that its result does not depend on the other rows.
        moving = xp.arange(rows, device=here)
        floor = FIRST_FLOOR * scale
        if start is not None:
            # From a good start no floor is needed, except near the corner.
            floor = xp.where(threshold > CORNER_SHARE * scale, 0.0, floor)
        problem = _Problem(n0, inside, threshold, scale, floor)
        for _ in range(MAXIMUM_STEPS):
            change = _step(problem, z[moving], unseen)
            z[moving] -= change
            problem = problem.with_lower_floor()
            going = ~problem.settled(largest * xp.max(xp.abs(change), axis=1))
            if not bool(xp.all(going)):
                moving, problem = moving[going], problem.only(going)
            if not len(moving):
                break
    v = n0 + z @ unseen.T
    n = xp.sign(v) * xp.clip(xp.abs(v) - threshold[:, None], min=0.0) * inside
    return xp.astype(n, n0.dtype, copy=False), z


def least_risk(v: Floats, inside: Booleans, noise: Floats) -> Floats:
    """Choose lambda for each row by Stein's unbiased estimate of the error of soft_lambda(v).

    A window that is mostly empty gets a lambda that clears the noise away; one that light under a
    surface fills gets a small lambda that leaves it alone (Donoho and Johnstone 1995).

    Parameters
    ----------
    v : ndarray, shape (I, W^2)
        Windows with noise.
    inside : ndarray of bool, shape (I, W^2)
        Window entries on the projector.
    noise : ndarray, shape (I,)
        Standard deviation of an entry.

    Returns
    -------
    ndarray, shape (I,)
        One of `LAMBDA_SHARES` of the noise.
    """
    xp = namespace(v)
    size = xp.abs(v)
    size *= inside
    beyond = xp.count_nonzero(~inside, axis=1)
    risks = []
    for share in LAMBDA_SHARES:
        threshold = (share * noise)[:, None]
        zeroed = xp.count_nonzero(size <= threshold, axis=1) - beyond
        kept = xp.minimum(size, threshold)
        risks.append(xp.vecdot(kept, kept) - 2 * noise**2 * zeroed)
    best = xp.argmin(xp.stack(risks, axis=1), axis=1)
    chosen: Floats = xp.asarray(LAMBDA_SHARES, dtype=v.dtype, device=device(v))[best] * noise
    return chosen


class _Problem(NamedTuple):
    """Rows that have not settled yet; each field's first axis runs over them."""

    n0: Floats
    inside: Booleans
    threshold: Floats
    scale: Floats
    floor: Floats

    def with_lower_floor(self) -> "_Problem":
        return self._replace(floor=self.floor * FLOOR_FACTOR)

    def only(self, rows: Booleans) -> "_Problem":
        return _Problem._make(values[rows] for values in self)

    def settled(self, moved: Floats) -> Booleans:
        """Return which rows have settled, under a floor that no longer matters."""
        least = SIZE_TOLERANCE * self.scale
        still = moved <= LAMBDA_TOLERANCE * self.threshold + least
        done: Booleans = still & (self.floor <= self.threshold + least)
        return done


def _step(problem: _Problem, z: Floats, unseen: Floats) -> Floats:
    """Return the step of reweighted least squares that is subtracted from z."""
    xp = namespace(z)
    width = xp.maximum(
        problem.threshold, problem.floor + SIZE_TOLERANCE * problem.scale + WIDTH_FLOOR
    )[:, None]
    v = z @ unseen.T
    v += problem.n0
    weight = width / xp.maximum(xp.abs(v), width)
    weight[~problem.inside] = 1.0
    return _weighted_step(v, weight, unseen)


def _weighted_step(v: Floats, weight: Floats, unseen: Floats) -> Floats:
    """Return (Z^T diag(weight) Z)^-1 Z^T diag(weight) v for each row."""
    xp, unknowns = namespace(v), unseen.shape[1]
    pairs = (unseen[:, :, None] * unseen[:, None, :]).reshape((len(unseen), unknowns**2))
    normal = xp.astype((weight @ pairs).reshape((len(v), unknowns, unknowns)), xp.float64)
    weight *= v
    right = xp.astype(weight @ unseen, xp.float64)
    # The ridge keeps a window without any weight where it is.
    unit = xp.eye(unknowns, dtype=xp.float64, device=device(v))
    ridge = RIDGE * xp.linalg.trace(normal)[:, None, None] * unit
    step: Floats = xp.astype(xp.linalg.solve(normal + ridge, right[..., None])[..., 0], v.dtype)
    return step
