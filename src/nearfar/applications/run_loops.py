"""Sums of transport times light over runs of projector pixels, in compiled loops.

Loops named `add` add to their last parameter, the others fill it. A run of camera pixel c in
projector row ``first[c] + r`` is from column ``starts[c, r]`` up to the one before ``stops[c, r]``;
see `Runs`.

Index convention: c runs over camera pixels, i over channels, r over rows of runs, m over functions
of far-range light.
"""

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.compiled import compiled


@compiled
def runs_of_discs(
    q: Floats,
    radius: float,
    size: tuple[int, int],
    first: Integers,
    starts: Integers,
    stops: Integers,
) -> None:
    """Find the runs of projector pixels nearer to q, (n, 2), than a radius; none where q is NaN."""
    height, width = size
    rows = starts.shape[1]
    for c in range(len(q)):
        y, x = np.float64(q[c, 0]), np.float64(q[c, 1])
        starts[c], stops[c], first[c] = 0, 0, 0
        if np.isnan(y) or np.isnan(x):
            continue
        first[c] = max(0, min(int(np.floor(y - min(radius, 2.0 * height))), height - rows))
        for r in range(rows):
            squared = radius**2 - (first[c] + r - y) ** 2
            if squared > 0:
                half = np.sqrt(squared)
                start = max(0, int(np.floor(max(x - half, -1.0))) + 1)
                stop = min(width, int(np.ceil(min(x + half, np.float64(width)))))
                if stop > start:
                    starts[c, r], stops[c, r] = start, stop


@compiled
def runs_of_bands(
    lines: Floats, width: float, size: tuple[int, int], starts: Integers, stops: Integers
) -> None:
    """Find the runs of projector pixels at most half of a width from lines (n, 3).

    A line is a x + b y + c = 0; all zero in a and b, it is none.
    """
    half = 0.5 * width
    for n in range(len(lines)):
        starts[n], stops[n] = 0, 0
        norm = np.hypot(lines[n, 0], lines[n, 1])
        if norm == 0:
            continue
        a, b, offset = lines[n, 0] / norm, lines[n, 1] / norm, lines[n, 2] / norm
        for y in range(size[0]):
            apart = b * y + offset
            if abs(a) <= 2.3e-16:
                stops[n, y] = size[1] if abs(apart) <= half else 0
                continue
            # The columns x of a row with |a x + apart| <= half.
            ends = ((-half - apart) / a, (half - apart) / a)
            low, high = max(min(ends), 0.0), min(max(ends), size[1] - 1.0)
            if low <= high:
                starts[n, y], stops[n, y] = int(np.ceil(low)), int(np.floor(high)) + 1


@compiled
def sum_along_rows(
    light: Floats,
    down: tuple[Floats, Floats],
    across: tuple[Floats, Floats],
    table: Floats,
) -> None:
    """Sum light times functions of far-range light along projector rows.

    Parameters
    ----------
    light : ndarray, shape (n, Px), float32
    down, across : tuple of ndarray, shapes (n, M) and (Px, M), float32
        A function is the sum of two products of one of `down` and one of `across`.
    table : ndarray, shape (n, Px + 1, M or more), float32
        Gets the sum of all pixels before each column, in the first M of its last axis.
    """
    count = down[0].shape[1]
    sums = np.empty(count)
    for y in range(len(light)):
        sums[:] = 0.0
        table[y, 0] = 0.0
        one, two = down[0][y], down[1][y]
        for x in range(light.shape[1]):
            value, here = light[y, x], table[y, x + 1]
            one_across, two_across = across[0][x], across[1][x]
            for m in range(count):
                sums[m] += value * (one[m] * one_across[m] + two[m] * two_across[m])
            for m in range(count):
                here[m] = sums[m]


@compiled
def add_runs(
    table: Floats, sign: int, first: Integers, starts: Integers, stops: Integers, out: Floats
) -> None:
    """Add sums over runs, of a table that `sum_along_rows` made.

    Parameters
    ----------
    table : ndarray
    sign : int
        1, or -1 to subtract them.
    out : ndarray, shape (n, m)
        Of the first m functions of the table.
    """
    count, rows = out.shape[1], starts.shape[1]
    sums = np.empty(count, dtype=np.float32)
    for c in range(len(out)):
        sums[:] = 0.0
        # Two rows at once, so that the sums are read and written half as often.
        for r in range(0, rows, 2):
            s = min(r + 1, rows - 1)
            if stops[c, r] <= starts[c, r] and stops[c, s] <= starts[c, s]:
                continue
            upper, lower = table[first[c] + r, stops[c, r]], table[first[c] + r, starts[c, r]]
            if s == r:
                for m in range(count):
                    sums[m] += upper[m] - lower[m]
                continue
            more, less = table[first[c] + s, stops[c, s]], table[first[c] + s, starts[c, s]]
            for m in range(count):
                sums[m] += (upper[m] - lower[m]) + (more[m] - less[m])
        for m in range(count):
            out[c, m] += sign * sums[m]


@compiled
def add_between(
    grid: Floats, first: float, spacing: float, sign: int, q: Floats, out: Floats
) -> None:
    """Add sums at a grid of places, interpolated at q, (n, 2): out, (n, M).

    By cubic convolution (Keys 1981), between the sixteen places about q, which is on the
    projector. Nothing is added where q is NaN.

    Parameters
    ----------
    grid : ndarray, shape (rows, columns, M), float32
    first, spacing : float
        Place of the grid's first row and column, and the distance between two; projector pixels.
    sign : int
        1, or -1 to subtract them.
    """
    weights = np.empty((2, 4))
    for c in range(len(out)):
        if np.isnan(q[c, 0]) or np.isnan(q[c, 1]):
            continue
        y, x = (q[c, 0] - first) / spacing, (q[c, 1] - first) / spacing
        # A q on the very edge may be rounded to beyond the places next to it.
        above = min(max(int(np.floor(y)), 1), grid.shape[0] - 3)
        left = min(max(int(np.floor(x)), 1), grid.shape[1] - 3)
        for axis, t in ((0, y - above), (1, x - left)):
            weights[axis, 0] = 0.5 * t * (t * (2 - t) - 1)
            weights[axis, 1] = 0.5 * (t * t * (3 * t - 5) + 2)
            weights[axis, 2] = 0.5 * t * (t * (4 - 3 * t) + 1)
            weights[axis, 3] = 0.5 * t * t * (t - 1)
        for i in range(4):
            line, of_line = grid[above - 1 + i], sign * weights[0, i]
            one, two = np.float32(of_line * weights[1, 0]), np.float32(of_line * weights[1, 1])
            three, four = np.float32(of_line * weights[1, 2]), np.float32(of_line * weights[1, 3])
            first_sums, second = line[left - 1], line[left]
            third, fourth = line[left + 1], line[left + 2]
            for m in range(out.shape[1]):
                out[c, m] += (one * first_sums[m] + two * second[m]) + (
                    three * third[m] + four * fourth[m]
                )


@compiled
def add_products(coefficients: Floats, sums: Floats, out: Floats) -> None:
    """Add coefficients of functions, (n, channels, M), times sums of light times these, (n, M)."""
    for c in range(len(sums)):
        for i in range(coefficients.shape[1]):
            total = np.float32(0.0)
            for m in range(coefficients.shape[2]):
                total += coefficients[c, i, m] * sums[c, m]
            out[c, i] += total


@compiled
def add_window(
    light: Floats,
    near: Floats,
    centres: Integers,
    first: Integers,
    starts: Integers,
    stops: Integers,
    out: Floats,
) -> None:
    """Add near-range light of single pixels, (n, channels, W, W), about centres (n, 2)."""
    side = near.shape[2]
    for c in range(len(near)):
        top, left = centres[c, 0] - side // 2, centres[c, 1] - side // 2
        for w in range(side):
            y = top + w
            r = y - first[c]
            if y < 0 or y >= light.shape[0] or r < 0 or r >= starts.shape[1]:
                continue
            start, stop = max(starts[c, r], left), min(stops[c, r], left + side)
            if stop <= start:
                continue
            lit = light[y, start:stop]
            for i in range(near.shape[1]):
                entries, total = near[c, i, w, start - left : stop - left], np.float32(0.0)
                for x in range(len(lit)):
                    total += entries[x] * lit[x]
                out[c, i] += total


@compiled
def sum_hats(
    sums: tuple[Floats, Floats],
    pitch: int,
    centres: Integers,
    first: Integers,
    starts: Integers,
    stops: Integers,
    out: Floats,
) -> None:
    """Sum light times each hat of one pitch, about centres (n, 2), over runs.

    Parameters
    ----------
    sums : tuple of ndarray, shape (Py, Px + 1), float64
        Of light, and of light times column, along projector rows, before each column.
    pitch : int
    out : ndarray, shape (n, side, side), float32
        Gets the sums, of side x side hats.
    """
    plain, moments = sums
    side, half = out.shape[1], out.shape[1] // 2
    # With a rim of hats that there are none of, so that segments beside the outer hats have two.
    hats = np.empty((side + 2, side + 2))
    # Of light times a ramp down and up along each segment between two hats of a projector row: over
    # the rows between two rows of hats, and the same times the share of the lower row.
    down, up, down_lower, up_lower = np.empty((4, side + 1))
    for c in range(len(out)):
        top, left = centres[c, 0] - half * pitch, centres[c, 1] - half * pitch
        hats[:] = 0.0
        r = max(0, top - pitch + 1 - first[c])
        last = min(starts.shape[1], top + side * pitch - first[c])
        while r < last:
            above = (first[c] + r - top) // pitch
            next_hats = min(last, top + (above + 1) * pitch - first[c])
            down[:], up[:], down_lower[:], up_lower[:] = 0.0, 0.0, 0.0, 0.0
            while r < next_hats:
                y = first[c] + r
                share = (y - top - above * pitch) / pitch
                low = max(starts[c, r], left - pitch)
                stop = min(stops[c, r], left + side * pitch)
                r += 1
                if stop <= low:
                    continue
                segment = (low - left) // pitch
                before, moment_before = plain[y, low], moments[y, low]
                while low < stop:
                    origin = left + segment * pitch
                    low = min(stop, origin + pitch)
                    until, moment_until = plain[y, low], moments[y, low]
                    lit = until - before
                    rising = (moment_until - moment_before - origin * lit) / pitch
                    segment += 1
                    down[segment] += lit - rising
                    up[segment] += rising
                    down_lower[segment] += share * (lit - rising)
                    up_lower[segment] += share * rising
                    before, moment_before = until, moment_until
            for k in range(side + 1):
                hats[above + 1, k] += down[k] - down_lower[k]
                hats[above + 1, k + 1] += up[k] - up_lower[k]
                hats[above + 2, k] += down_lower[k]
                hats[above + 2, k + 1] += up_lower[k]
        for i in range(side):
            for k in range(side):
                out[c, i, k] = hats[i + 1, k + 1] / (pitch * pitch)


@compiled
def add_corners(
    light: Floats,
    direct: Floats,
    pixels: Integers,
    weights: Floats,
    first: Integers,
    starts: Integers,
    stops: Integers,
    out: Floats,
) -> None:
    """Add direct light, (n, channels), of the four flat projector pixels of footprints, (n, 4)."""
    width = light.shape[1]
    for c in range(len(direct)):
        total = np.float32(0.0)
        for k in range(pixels.shape[1]):
            y, x = pixels[c, k] // width, pixels[c, k] % width
            r = y - first[c]
            if 0 <= r < starts.shape[1] and starts[c, r] <= x < stops[c, r]:
                total += weights[c, k] * light[y, x]
        for i in range(direct.shape[1]):
            out[c, i] += direct[c, i] * total


@compiled
def add_boxes(
    light: Floats,
    direct: Floats,
    middles: Floats,
    sides: Floats,
    first: Integers,
    starts: Integers,
    stops: Integers,
    out: Floats,
) -> None:
    """Add direct light, (n, channels), of two boxes; middles (2, n, 2) are NaN where it has none.

    Each projector pixel counts by the share of a box, of sides (n, 2), that it covers.
    """
    for c in range(len(direct)):
        total, high, wide = 0.0, sides[c, 0], sides[c, 1]
        for box in range(len(middles)):
            y, x = middles[box, c, 0], middles[box, c, 1]
            if np.isnan(y) or np.isnan(x):
                continue
            top, left = y - 0.5 * high, x - 0.5 * wide
            for row in range(int(np.floor(top + 0.5)), int(np.ceil(top + high + 0.5))):
                r = row - first[c]
                if r < 0 or r >= starts.shape[1]:
                    continue
                down = min(row + 0.5, top + high) - max(row - 0.5, top)
                begin = max(starts[c, r], int(np.floor(left + 0.5)))
                for column in range(begin, min(stops[c, r], int(np.ceil(left + wide + 0.5)))):
                    across = min(column + 0.5, left + wide) - max(column - 0.5, left)
                    total += light[row, column] * down * across
        for i in range(direct.shape[1]):
            out[c, i] += direct[c, i] * total / (len(middles) * high * wide)
