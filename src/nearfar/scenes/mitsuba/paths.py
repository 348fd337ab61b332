"""Path tracing whose connections to the projector are kept apart by projector pixel.

Paths start at the camera. At every vertex with a smooth lobe (or in a medium) a shadow ray goes to
the projector's pinhole; what it carries is added to T[c, p], p being the projector pixel it comes
through. The projector has no extent, so no path meets it by chance: connections are all there is,
and a delta lobe (a mirror, glass) is followed but never connected, as in Mitsuba's own
integrators. In short: T[c, p] = mean of throughput x response x light x transmittance
(Veach 1997, chapter 8, next-event estimation; Mitsuba's ``path`` and ``volpath`` for the meaning
of the depths).

Everything here runs both in Mitsuba's scalar variants, a path at a time, and in the vectorised
ones, where a variable stands for one value per path and ``drjit.syntax`` records the loops. So
functions are at module level, use no closures and write `_no` where Python would write ``not``.
"""

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

# Largest probability that a path survives a round of Russian roulette.
MAXIMUM_SURVIVAL = 0.95
UNLIMITED_DEPTH = 2**31


class Rules(NamedTuple):
    """Rules of a scene's integrator that paths follow.

    Attributes
    ----------
    volumetric : bool
        Whether media scatter, and null boundaries let shadow rays through and cost no depth.
    max_depth : int
        Vertices of the longest path, without the camera, with the light; or `UNLIMITED_DEPTH`.
    rr_depth : int
        Vertices before Russian roulette begins.
    hide_emitters : bool
        Whether the camera looks through area lights. It does so as in Mitsuba's ``volpath``;
        its ``path`` (3.9) lights what lies behind them wrongly.
    """

    volumetric: bool
    max_depth: int
    rr_depth: int
    hide_emitters: bool


def _no(mask: Any) -> Any:
    return mask ^ True


def _of_channel(values: Any, channel: Any) -> Any:
    """Pick each path's colour channel."""
    return dr.select(channel == 0, values[0], dr.select(channel == 1, values[1], values[2]))


def _ratio(value: Any, divisor: Any) -> Any:
    """Divide, with 0 for what cannot be divided: Python's floats raise at a zero."""
    return dr.select(divisor > 0, value / dr.select(divisor > 0, divisor, 1), 0)


def _beyond(si, direction, medium):  # type: ignore[no-untyped-def]
    """Return the medium that a ray from a surface enters; `medium` where nothing changes."""
    if si.is_medium_transition():
        medium = si.target_medium(direction)
    return medium


def _transmittance(scene, sampler, ray, target, medium, channel, active):  # type: ignore[no-untyped-def]
    """Share of light that reaches the target: through media and null boundaries."""
    ray = mi.Ray3f(ray)
    active = mi.Bool(active)
    carried = mi.Color3f(1)
    while active:
        si = scene.ray_intersect(ray, active)
        hit = active & si.is_valid()
        distance = dr.minimum(si.t, ray.maxt)
        crossed = mi.Bool(False)
        place = mi.Point3f(ray.o)
        inside = active & (medium != None)  # noqa: E711
        if inside:
            mei = medium.sample_interaction(ray, sampler.next_1d(inside), channel, inside)
            # The segment ends here: the ray leaves the medium.
            si.t = distance
            even = medium.is_homogeneous()
            crossed = inside & _no(even) & mei.is_valid() & (mei.t < distance)
            place = mi.Point3f(mei.p)
            mei.t = dr.select(crossed, mei.t, dr.inf)
            passed, density = medium.transmittance_eval_pdf(mei, si, inside)
            # Homogeneous media have a transmittance in closed form, others are sampled by ratio
            # tracking.
            weight = dr.select(even, passed, _ratio(passed, _of_channel(density, channel)))
            weight = dr.select(crossed, weight * mei.sigma_n, weight)
            carried = dr.select(inside, carried * weight, carried)
        met = hit & _no(crossed)
        origin = mi.Ray3f(ray)
        if met:
            bsdf = si.bsdf(ray)
            carried *= bsdf.eval_null_transmission(si, met)
            origin = si.spawn_ray_to(target)
            medium = beyond(si, ray.d, medium)
        left = dr.norm(target - place)
        ray.maxt = dr.select(crossed, left * (1 - mi.math.ShadowEpsilon), ray.maxt)
        ray.o = dr.select(crossed, place, ray.o)
        ray = dr.select(met, origin, ray)
        active &= (crossed | met) & (dr.max(carried) > 0)
    return carried


def _look_through(scene, ray, si, active):  # type: ignore[no-untyped-def]
    """Look through the area lights that the camera sees first."""
    hidden = active & si.is_valid()
    while hidden:
        hidden = hidden & si.shape.is_emitter()
        ray = dr.select(hidden, si.spawn_ray(ray.d), ray)
        si = dr.select(hidden, scene.ray_intersect(ray, hidden), si)
        hidden = hidden & si.is_valid()
    return ray, si


def _fly(sampler, ray, si, medium, channel, active):  # type: ignore[no-untyped-def]
    """Sample a free flight through a medium: where it ends, by scattering or not, and its weight.

    Where neither holds the path leaves the medium at the surface `si`.
    """
    mei = dr.zeros(mi.MediumInteraction3f)
    scatters, goes_on = mi.Bool(False), mi.Bool(False)
    weight = mi.Color3f(1)
    inside = active & (medium != None)  # noqa: E711
    if inside:
        mei = medium.sample_interaction(ray, sampler.next_1d(inside), channel, inside)
        mei.t = dr.select(si.t < mei.t, dr.inf, mei.t)
        passed, density = medium.transmittance_eval_pdf(mei, si, inside)
        weight = _ratio(passed, _of_channel(density, channel))
        real = _of_channel(_ratio(mei.sigma_t, mei.combined_extinction), channel)
        met = inside & mei.is_valid()
        scatters = met & (sampler.next_1d(inside) < real)
        goes_on = met & _no(scatters)
        weight = dr.select(scatters, weight * _ratio(mei.sigma_s, real), weight)
        weight = dr.select(goes_on, weight * _ratio(mei.sigma_n, 1 - real), weight)
    return mei, scatters, goes_on, weight


def _connect(scene, projector, sampler, ray, si, mei, medium, channel, joins, scatters, volumetric):  # type: ignore[no-untyped-def]
    """Return the projector's light that a vertex scatters along the path, and its pixel's uv."""
    at = dr.zeros(mi.Interaction3f)
    at.p = dr.select(scatters, mi.Point3f(mei.p), mi.Point3f(si.p))
    ds, light = projector.sample_direction(at, mi.Point2f(0), joins)
    joins = joins & (dr.max(light) > 0)
    surface = joins & _no(scatters)
    around = medium
    if scatters & joins:
        response, _ = mei.medium.phase_function().eval_pdf(
            mi.PhaseFunctionContext(sampler), mei, ds.d, scatters
        )
        light *= response
    if surface:
        light *= si.bsdf(ray).eval(mi.BSDFContext(), si, si.to_local(ds.d), surface)
    joins = joins & (dr.max(light) > 0)
    if joins:
        shadow = dr.select(scatters, mei.spawn_ray_to(ds.p), si.spawn_ray_to(ds.p))
        if dr.hint(volumetric, mode="scalar"):
            if surface:
                around = beyond(si, shadow.d, around)
            light *= transmittance(scene, sampler, shadow, ds.p, around, channel, joins)
        else:
            light *= dr.select(scene.ray_test(shadow, joins), 0, 1)
    return mi.Point2f(ds.uv), light, joins


def roulette(sampler: Any, throughput: Any, eta: Any, plays: Any, active: Any) -> tuple[Any, Any]:
    """End weak paths by Russian roulette, which changes the noise and never the mean."""
    chance = dr.minimum(dr.max(throughput) * dr.square(eta), MAXIMUM_SURVIVAL)
    lives = sampler.next_1d(active) < chance
    return dr.select(plays, _ratio(throughput, chance), throughput), lives | _no(plays)


def _follow(scene, projector, sampler, ray, throughput, medium, rules, tally, row):  # type: ignore[no-untyped-def]
    """Follow paths from the camera and tally each connection under its projector pixel."""
    volumetric, max_depth, rr_depth, hide_emitters = rules
    ray = mi.Ray3f(ray)
    throughput = mi.Color3f(throughput)
    active = dr.max(throughput) > 0
    depth, eta = mi.UInt32(0), mi.Float(1)
    # Each path samples its free flights by one colour channel.
    channel = mi.UInt32(dr.minimum(3 * sampler.next_1d(active), 2))
    while active:
        si = scene.ray_intersect(ray, active)
        if dr.hint(hide_emitters, mode="scalar"):
            ray, si = look_through(scene, ray, si, active & (depth == 0))
        mei = dr.zeros(mi.MediumInteraction3f)
        scatters, goes_on = mi.Bool(False), mi.Bool(False)
        if dr.hint(volumetric, mode="scalar"):
            mei, scatters, goes_on, weight = fly(sampler, ray, si, medium, channel, active)
            throughput *= weight
            depth = dr.select(scatters, depth + 1, depth)
            active &= depth < max_depth
            scatters &= active
        surface = active & si.is_valid() & _no(scatters | goes_on)

        joins = mi.Bool(False)
        if surface:
            joins = mi.has_flag(si.bsdf(ray).flags(), mi.BSDFFlags.Smooth)
            joins &= depth + 1 < max_depth
        if scatters:
            joins = mi.Bool(mei.medium.use_emitter_sampling())
        joins &= surface | scatters
        uv, light, joins = connect(
            *(scene, projector, sampler, ray, si, mei, medium, channel),
            *(joins, scatters, volumetric),
        )
        light *= throughput
        tally.add(row, uv, light, joins & dr.all(dr.isfinite(light)))

        if scatters:
            wo, weight, density = mei.medium.phase_function().sample(
                mi.PhaseFunctionContext(sampler),
                *(mei, sampler.next_1d(scatters), sampler.next_2d(scatters), scatters),
            )
            throughput *= dr.select(density > 0, weight, 0)
            ray = mei.spawn_ray(wo)
        if goes_on:
            ray.o = mei.p
        if surface:
            bs, weight = si.bsdf(ray).sample(
                mi.BSDFContext(),
                *(si, sampler.next_1d(surface), sampler.next_2d(surface), surface),
            )
            throughput *= weight
            eta *= bs.eta
            ray = si.spawn_ray(si.to_world(bs.wo))
            through = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null) & volumetric
            depth = dr.select(through, depth, depth + 1)
            if dr.hint(volumetric, mode="scalar"):
                medium = beyond(si, ray.d, medium)
        active &= surface | scatters | goes_on
        active &= (depth < max_depth) & (dr.max(throughput) > 0)

        plays = active & _no(goes_on) & (depth >= rr_depth)
        throughput, lives = roulette(sampler, throughput, eta, plays, active)
        active &= lives


beyond: Any = dr.syntax(_beyond)
transmittance: Any = dr.syntax(_transmittance)
look_through: Any = dr.syntax(_look_through)
fly: Any = dr.syntax(_fly)
connect: Any = dr.syntax(_connect)
follow: Any = dr.syntax(_follow)
