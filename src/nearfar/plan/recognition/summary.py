"""What a set of recognised pictures shows, in lines."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from nearfar.plan.recognition.contents import (
    AnyPicture,
    Axis,
    Band,
    Binary,
    Block,
    Checkerboard,
    Code,
    Content,
    Fringes,
    GrayBit,
    HadamardRow,
    Stripes,
    Uniform,
    rounded_period,
)
from nearfar.plan.recognition.recognise import Recognised

# Fringes whose cycles on the picture differ by less are of one frequency.
SAME_CYCLES = 0.1
# Periods that are named; of more, the shortest and the longest.
MOST_NAMED = 6


def summarise(recognised: Recognised) -> list[str]:
    """Return a line for each group of pictures that belong together, such as one Gray code.

    Parameters
    ----------
    recognised : Recognised

    Returns
    -------
    list of str
    """
    groups: dict[tuple[str, ...], list[int]] = {}
    for number, content in enumerate(recognised.contents):
        groups.setdefault(_group(content), []).append(number)
    return [_line(recognised, numbers) for numbers in groups.values()]


def _group(content: Content) -> tuple[str, ...]:
    """Return the group of a picture: kind, and axis, direction or level where these matter."""
    match content:
        case Fringes():
            return (content.kind, content.direction if not content.fy or not content.fx else "")
        case GrayBit() | Code() | Stripes() | Band():
            return (content.kind, content.axis)
        case Uniform():
            return (content.kind, content.description)
    return (content.kind,)


def _line(recognised: Recognised, numbers: list[int]) -> str:
    contents = [recognised.contents[number] for number in numbers]
    inverses = sum(recognised.inverse_of[number] is not None for number in numbers)
    count = f"{len(numbers)} picture{'s' if len(numbers) > 1 else ''}"
    say: dict[str, Callable[[Recognised, Sequence[Content]], str]] = {
        "fringes": _of_fringes,
        "gray code": _of_gray_code,
        "band": _of_bands,
        "block": _of_blocks,
        "hadamard": _of_hadamard,
        "binary": _of_binary,
    }
    first = contents[0]
    if first.kind in say:
        what = say[first.kind](recognised, contents)
    elif len(contents) == 1 or isinstance(first, Uniform):
        what = first.description
    else:
        what = _several(contents)
    if inverses and not isinstance(first, Uniform):
        what += ", with inverses" if 2 * inverses == len(numbers) else f", {inverses} inverses"
    return f"{what} ({count})"


def _several(contents: Sequence[Content]) -> str:
    first = contents[0]
    if isinstance(first, Stripes):
        widths = _listed(c.width for c in contents if isinstance(c, Stripes))
        return f"stripes {widths} {first.axis} wide"
    if isinstance(first, Code):
        return f"binary codes of {first.axis}"
    if isinstance(first, Checkerboard):
        fields = Counter(f"{c.height}x{c.width}" for c in contents if isinstance(c, Checkerboard))
        return f"checkerboards with fields of {' and '.join(fields)}"
    colour = "colour " if all(isinstance(c, AnyPicture) and c.is_colour for c in contents) else ""
    return f"{colour}pictures of no kind that is recognised"


def _by_frequency(recognised: Recognised, fringes: Sequence[Fringes]) -> list[list[Fringes]]:
    """Return the fringes of each frequency, which rounding to 8 bits blurs."""
    found: list[list[Fringes]] = []
    height, width = recognised.size
    for each in fringes:
        for wave in found:
            off = abs(each.fy - wave[0].fy) * height + abs(each.fx - wave[0].fx) * width
            if off < SAME_CYCLES:
                wave.append(each)
                break
        else:
            found.append([each])
    return found


def _of_fringes(recognised: Recognised, contents: Sequence[Content]) -> str:
    fringes = [content for content in contents if isinstance(content, Fringes)]
    waves = _by_frequency(recognised, fringes)
    steps = {len(wave) for wave in waves}
    step = f"{steps.pop()}-step fringes" if len(steps) == 1 else "fringes"
    one = fringes[0]
    where = f" {one.direction}" if not one.fy or not one.fx else ""
    periods = sorted({rounded_period(wave[0].period) for wave in waves}, reverse=True)
    if len(waves) > MOST_NAMED:
        named = f"{len(waves)} frequencies, periods from {periods[-1]:g} to {periods[0]:g} pixels"
    else:
        named = f"period {_listed(periods)} pixels"
    powers = [each.exponent for each in fringes if each.exponent != 1.0]
    power = f", sinusoids in levels to the power {sum(powers) / len(powers):.2f}" if powers else ""
    return f"{step}{where}, {named}{power}"


def _of_gray_code(recognised: Recognised, contents: Sequence[Content]) -> str:
    bits = [content for content in contents if isinstance(content, GrayBit)]
    axis, cell = bits[0].axis, bits[0].cell
    shown = sorted({each.bit for each in bits})
    needed = _bits(recognised, axis, bits[0])
    missing = sorted(set(range(needed)) - set(shown))
    cells = f" in cells of {cell}" if cell > 1 else ""
    lacks = f", without {_listed(missing)}" if missing else ""
    which = f"bits {shown[0]} to {shown[-1]}" if len(shown) > 1 else f"bit {shown[0]}"
    return f"Gray code of {axis}{cells}, {which}{lacks}"


def _bits(recognised: Recognised, axis: Axis, bit: GrayBit) -> int:
    places = recognised.size[0 if axis == "rows" else 1]
    return ((places - 1) // bit.cell + bit.first).bit_length()


def _of_bands(recognised: Recognised, contents: Sequence[Content]) -> str:
    bands = [content for content in contents if isinstance(content, Band)]
    if len(bands) == 1:
        return bands[0].description
    axis, level = bands[0].axis, "white" if bands[0].is_white else "black"
    widths = _listed(sorted({each.stop - each.start for each in bands}))
    side = recognised.size[0 if axis == "rows" else 1]
    covered = len({place for each in bands for place in range(each.start, each.stop)})
    every = "all" if covered == side else f"{covered} of {side}"
    if widths == "1":
        return f"single {level} {axis}, {every}"
    return f"{level} bands of {widths} {axis}, over {every}"


def _of_blocks(recognised: Recognised, contents: Sequence[Content]) -> str:
    blocks = [content for content in contents if isinstance(content, Block)]
    if len(blocks) == 1:
        return blocks[0].description
    level = "white" if blocks[0].is_white else "black"
    sizes = sorted({(each.height, each.width) for each in blocks})
    places = {(each.top, each.left) for each in blocks}
    if len(sizes) > 1:
        return f"{level} blocks of several sizes"
    (height, width) = sizes[0]
    whole = recognised.size.pixels // (height * width)
    every = "all" if len(places) == whole else f"{len(places)} of {whole}"
    if height * width == 1:
        return f"one {level} pixel at a time, {every}"
    return f"one {level} block of {height}x{width} at a time, {every}"


def _of_hadamard(recognised: Recognised, contents: Sequence[Content]) -> str:
    rows = {content.row for content in contents if isinstance(content, HadamardRow)}
    if any(isinstance(each, Uniform) and each.level > 0 for each in recognised.contents):
        rows |= {0}
    # Patterns of blocks are rows that lack some bits.
    whole = 1 << _rank(rows)
    every = "complete" if len(rows) == whole else f"{len(rows)} of {whole} rows"
    return f"Hadamard patterns of {recognised.size}, {every}"


def _rank(rows: Iterable[int]) -> int:
    """Return how many of the rows are no sums of others, bit by bit."""
    independent: list[int] = []
    for row in rows:
        left = row
        for other in independent:
            left = min(left, left ^ other)
        if left:
            independent.append(left)
    return len(independent)


def _of_binary(_recognised: Recognised, contents: Sequence[Content]) -> str:
    shares = [content.white_share for content in contents if isinstance(content, Binary)]
    return f"binary pictures, {sum(shares) / len(shares):.0%} white on average"


def _listed(values: Iterable[float]) -> str:
    """Return different values in words, such as "4, 8 and 16"; of many, the ends."""
    words = [f"{value:g}" for value in dict.fromkeys(values)]
    if len(words) > MOST_NAMED:
        return f"{words[0]} to {words[-1]}"
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
