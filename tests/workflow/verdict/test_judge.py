"""The grade and the causes that follow from what is held out and from faults of the photos."""

import pytest

from nearfar.faults.of_light import ExposureChanged, LampFlickers
from nearfar.faults.of_photos import Moved, NotLinear
from nearfar.faults.of_single_photos import PhotosMisfit, PhotosTurned, ShowsOtherPattern
from nearfar.faults.records import LightDrifted, PairsDoNotAdd, PhotosSaturated, RoundedToHalf
from nearfar.workflow.verdict.held_out import HeldOut
from nearfar.workflow.verdict.repeats import Repeats
from nearfar.workflow.verdict.verdict import judge
from tests.workflow.verdict.lights import SIGNAL, held_out_light


def at(decibels, ratio=1.0, **options):
    """Return what is held out under a pattern of some SNR_b; None is a ratio without error bars."""
    error = SIGNAL / 10 ** (decibels / 10)
    return held_out_light(error, None if ratio is None else error / ratio, **options)


GOOD = HeldOut((at(32), at(33, is_binary=True)))
SATURATED = PhotosSaturated("c.zarr", 0.1)
DRIFTED = LightDrifted("c.zarr", 0.02, 0.0)
MOVED = Moved("camera", 20, 0.5)
SWAPPED = ShowsOtherPattern((3, 4), (4, 3))


def judged(*lights, fine=()):
    verdict = judge(HeldOut(lights, fine), [])
    return verdict.grade, verdict.causes


@pytest.mark.parametrize("decibels", [26, 32, 60])
@pytest.mark.parametrize("ratio", [0.1, 1.0, 1.9, None])
def test_errors_as_expected_are_good(decibels, ratio):
    # Noise that hides nothing.
    assert judged(at(decibels, ratio, noise=1e-12)) == ("good", ())


@pytest.mark.parametrize(
    ("decibels", "ratio", "expected"),
    [
        (39, 2.1, ("doubtful", ("model",))),
        # No error matters above 40 dB.
        (41, 2.1, ("good", ())),
        (41, 21.0, ("good", ())),
        (32, 19.0, ("doubtful", ("model",))),
        (32, 21.0, ("wrong", ("model",))),
    ],
)
def test_errors_beyond_the_error_bars_are_of_the_model(decibels, ratio, expected):
    assert judged(at(decibels, ratio, noise=1e-12)) == expected


@pytest.mark.parametrize(("decibels", "grade"), [(24, "doubtful"), (16, "doubtful"), (14, "wrong")])
def test_what_limits_bad_pictures_is_named(decibels, grade):
    error = SIGNAL / 10 ** (decibels / 10)
    for share, cause in ((0.6, "too-few-photos"), (0.4, "noise")):
        assert judged(at(decibels, unmeasured=share * error)) == (grade, (cause,))
    # Without error bars by the photos' own noise.
    for above, cause in ((8, "model"), (4, "noise")):
        noise = error / 10 ** (above / 10) / 100
        assert judged(at(decibels, None, noise=noise)) == (grade, (cause,))


@pytest.mark.parametrize(
    ("decibels", "unmeasured", "planned", "causes"),
    [
        (27, 0.99, (39.0, 47.0), ("below-plan",)),
        # As planned, or nearly; or good enough for most.
        (27, 0.99, (36.0, 44.0), ()),
        (29, 0.99, (41.0, 49.0), ()),
        # Noise allows no more, or nothing was planned.
        (27, 0.5, (39.0, 47.0), ()),
        (27, 0.99, None, ()),
        # Told before what limits it, which may be a consequence.
        (22, 0.99, (39.0, 47.0), ("below-plan",)),
    ],
)
def test_pictures_far_below_the_plan_and_the_noise_are_doubtful(
    decibels, unmeasured, planned, causes
):
    error = SIGNAL / 10 ** (decibels / 10)
    light = at(decibels, noise=1e-12, unmeasured=unmeasured * error)
    verdict = judge(HeldOut((light,)), [], planned_snr=planned)
    assert (verdict.grade, verdict.causes) == ("doubtful" if causes else "good", causes)
    assert verdict.planned_snr == planned
    # What was found in the photos says more.
    assert judge(HeldOut((light,)), [], [MOVED], planned_snr=planned).causes == ("moved",)


@pytest.mark.parametrize(
    ("decibels", "unmeasured", "planned", "grade"),
    [
        (19, 0.99, (35.0, 43.0), "wrong"),
        # As planned, or nearly; or off by less than a tenth.
        (19, 0.99, (33.0, 41.0), "doubtful"),
        (21, 0.99, (39.0, 47.0), "doubtful"),
        # Noise allows no more, or nothing was planned.
        (19, 0.9, (39.0, 47.0), "doubtful"),
        (19, 0.99, None, "doubtful"),
    ],
)
def test_pictures_off_by_a_tenth_and_farther_below_the_plan_are_wrong(
    decibels, unmeasured, planned, grade
):
    error = SIGNAL / 10 ** (decibels / 10)
    light = at(decibels, noise=1e-12, unmeasured=unmeasured * error)
    # Whatever was found in the photos.
    for spoilt in ([], [MOVED]):
        assert judge(HeldOut((light,)), [], spoilt, planned_snr=planned).grade == grade


@pytest.mark.parametrize(
    ("ratio", "expected"), [(9.0, ("good", ())), (11.0, ("doubtful", ("model",)))]
)
def test_fine_lights_may_be_off_by_more(ratio, expected):
    # They do not count among the others.
    assert judged(at(32), fine=(at(28, ratio),)) == expected
    assert judge(HeldOut((at(32),), (at(10, ratio),)), []).held_out.snr == pytest.approx(32)


@pytest.mark.parametrize(
    ("of_pictures", "of_half_screens", "causes"),
    [
        (0.008, 0.0, ()),
        (0.02, 0.0, ("not-linear",)),
        (-0.02, 0.0, ("not-linear",)),
        (-0.02, -0.015, ("lamp",)),
        (0.015, 0.015, ("lamp",)),
        (0.005, 0.005, ()),
    ],
)
def test_pictures_and_half_screens_tell_a_bend_from_a_lamp(of_pictures, of_half_screens, causes):
    lights = (at(32, excess=of_pictures), at(32, excess=of_half_screens, is_binary=True))
    assert judged(*lights) == ("doubtful" if causes else "good", causes)


@pytest.mark.parametrize("of_half_screens", [0.0, 0.013])
def test_noise_that_pairs_do_not_sum_to_white_by_is_no_fault(of_half_screens):
    def causes(noise):
        lights = (
            at(32, noise=noise, excess=0.013),
            at(32, noise=noise, excess=of_half_screens, is_binary=True),
        )
        return judged(*lights)[1]

    assert causes(1e-12) == (("lamp",) if of_half_screens else ("not-linear",))
    # One photo has a noise of 0.06.
    assert causes(4e-5) == ()


@pytest.mark.parametrize("spoilt", [ExposureChanged((5, 9), 0.1, 0.01), LampFlickers(0.1)])
def test_a_bend_that_is_sure_explains_photos_of_other_brightness(spoilt):
    def causes(of_pictures, of_half_screens, spoilt):
        lights = (at(32, excess=of_pictures), at(32, excess=of_half_screens, is_binary=True))
        return judge(HeldOut(lights), [], [spoilt]).causes

    assert causes(-0.08, -0.005, spoilt) == ("not-linear",)
    assert causes(-0.04, 0.0, spoilt) == ("exposure",)
    assert causes(-0.16, -0.08, spoilt) == ("exposure",)
    # A gamma of 2.2, before a box that lights itself.
    assert causes(-0.35, -0.10, spoilt) == ("not-linear",)
    # Ambient light is no brightness of the pictures.
    assert causes(-0.08, -0.005, ExposureChanged((5, 9), 0.01, 0.1)) == ("exposure",)
    assert causes(-0.08, -0.005, MOVED) == ("moved",)


@pytest.mark.parametrize(
    ("faults", "spoilt", "expected"),
    [
        ([], [], ("good", ())),
        ([RoundedToHalf(0.5)], [], ("good", ())),
        ([SATURATED], [], ("doubtful", ("saturated",))),
        ([DRIFTED], [], ("doubtful", ("lamp",))),
        ([PairsDoNotAdd("c.zarr", 0.02)], [], ("doubtful", ("not-linear",))),
        ([DRIFTED, SATURATED], [MOVED], ("doubtful", ("moved", "saturated"))),
        ([PairsDoNotAdd("c.zarr", 0.02)], [NotLinear("sRGB")], ("doubtful", ("not-linear",))),
        ([], [PhotosTurned((7,), "rotated by 180 degrees")], ("wrong", ("turned",))),
        ([SATURATED], [MOVED, SWAPPED], ("wrong", ("moved", "order", "saturated"))),
    ],
)
def test_faults_of_photos_are_reasons(faults, spoilt, expected):
    verdict = judge(GOOD, faults, spoilt)
    assert (verdict.grade, verdict.causes) == expected
    assert verdict.held_out == GOOD
    for each, reason in zip(spoilt, verdict.reasons, strict=False):
        assert reason.sentence == str(each)


@pytest.mark.parametrize(
    ("spoilt", "grade", "said"),
    [
        (PhotosTurned((7,), "mirrored left to right"), "doubtful", "It is a check photo"),
        (ShowsOtherPattern((7, 8), (8, 7)), "doubtful", "They are check photos"),
        (ShowsOtherPattern((7, 9), (9, 7)), "wrong", ""),
        # It may fit badly because the transport is wrong.
        (PhotosMisfit((7,)), "doubtful", ""),
    ],
)
def test_no_transport_is_wrong_for_check_photos_of_something_else(spoilt, grade, said):
    verdict = judge(GOOD, [], [spoilt], checks=[7, 8])
    assert (verdict.grade, verdict.causes) == (grade, (spoilt.cause,))
    assert verdict.reasons[0].sentence.removeprefix(str(spoilt)).strip().startswith(said)
    assert ("check photo" in str(verdict)) == bool(said)


def test_spoilt_check_photos_hide_no_other_reason():
    turned = PhotosTurned((7,), "mirrored left to right")
    verdict = judge(HeldOut((at(32, 5.0),)), [], [turned], checks=[7])
    assert verdict.causes == ("model", "turned")


@pytest.mark.parametrize(("decibels", "share"), [(40, "1 %"), (20.1, "9.9 %"), (-2, "126 %")])
def test_errors_are_said_in_plain_numbers(decibels, share):
    assert f"are off by {share} (" in str(judge(HeldOut((at(decibels),)), []))


def test_what_noise_allows_is_said_if_there_is_noise():
    error = SIGNAL / 10**3.2
    for unmeasured, is_said in ((0.5 * error, True), (error, False)):
        light = held_out_light(error, error, unmeasured=unmeasured)
        assert ("noise alone allows" in str(judge(HeldOut((light,)), []))) == is_said


def test_a_cause_that_is_found_twice_is_one_reason():
    lights = (at(32, excess=0.02), at(32, is_binary=True))
    assert len(judge(HeldOut(lights), [PairsDoNotAdd("c.zarr", 0.02)]).reasons) == 1


def test_faults_are_named_before_what_they_may_have_caused():
    of_lamp = (at(32, excess=0.02), at(32, excess=0.02, is_binary=True))
    for lights in ((at(14),), (at(32, 5.0),), of_lamp):
        assert judge(HeldOut(lights), [SATURATED]).causes == ("saturated",)
        assert judge(HeldOut(lights), [], [MOVED]).causes == ("moved",)
    # Pictures that do not add tell of a bend, whatever else is wrong.
    assert judge(HeldOut((at(32, excess=0.02),)), [SATURATED]).causes == ("saturated", "not-linear")


@pytest.mark.parametrize(
    ("faults", "spoilt", "expected"),
    [
        ([], [], ("doubtful", ("unchecked",))),
        ([SATURATED], [], ("doubtful", ("saturated", "unchecked"))),
        ([], [MOVED], ("doubtful", ("moved", "unchecked"))),
        ([], [SWAPPED], ("wrong", ("order", "unchecked"))),
    ],
)
def test_without_anything_held_out_the_faults_are_left(faults, spoilt, expected):
    repeats = Repeats(41.5, 1.0, 0.001, 0.0, None)
    verdict = judge(None, faults, spoilt, repeats, "nothing was checked: because.")
    assert (verdict.grade, verdict.causes) == expected
    assert verdict.reasons[-1].sentence == (
        f"nothing was checked: because. Known is this: {repeats}"
    )
    bare = judge(None, faults, spoilt).reasons[-1].sentence
    assert bare.startswith("nothing was checked: the plan has neither")
    assert "Known" not in bare
