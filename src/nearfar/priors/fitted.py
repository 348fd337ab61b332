"""Prior components, their scales and typical scenes, fitted to the simulated scenes.

`benchmarks/refit_priors.py` fits them again and prints how far they move.
"""

from nearfar.priors.component import PriorComponent
from nearfar.priors.typical import typical_scenes

# Decay, in cycles, of light of which nothing is known: all frequencies, and all projector pixels,
# are alike.
FREE = 1e6
LIGHT_FROM_ANYWHERE = PriorComponent(0.0, 64.0, FREE)
# Far-range light with edges, such as the outline of a lamp: its spectrum has no end.
LIGHT_WITH_EDGES = PriorComponent(0.0, 64.0, FREE, far_power=1.5)
# Components of camera pixels with direct light. All but the last five were chosen one by one out
# of 240 (near reach 0.8 to 6 pixels, far decay 0.7 to 8 cycles, six far deviations, with and
# without spread of direct light), each time the one that raised the evidence of camera pixels of
# cornell, cornell-aside, wedge and corner most (docs/decisions/0010). They stand in that order.
LIT_COMPONENTS = (
    PriorComponent(6.0, 256.0, 1.5),
    PriorComponent(6.0, 16.0, 3.0),
    PriorComponent(1.3, 1.0, 3.0),
    PriorComponent(0.8, 64.0, 1.5),
    PriorComponent(0.8, 64.0, 3.0),
    PriorComponent(6.0, 64.0, 1.5),
    PriorComponent(1.3, 256.0, 1.5),
    PriorComponent(6.0, 64.0, 3.0),
    PriorComponent(3.5, 16.0, 1.5),
    PriorComponent(6.0, 64.0, 8.0),
    PriorComponent(2.2, 16.0, 1.5, 3.0),
    PriorComponent(0.8, 256.0, 3.0),
    PriorComponent(1.3, 1.0, 1.5),
    PriorComponent(0.8, 256.0, 0.7),
    PriorComponent(2.2, 16.0, 1.5),
    PriorComponent(6.0, 16.0, 8.0),
    PriorComponent(2.2, 16.0, 0.7, 3.0),
    PriorComponent(3.5, 4.0, 3.0),
    PriorComponent(0.8, 1.0, 3.0),
    PriorComponent(3.5, 16.0, 3.0),
    # Windows without any smoothness, added by hand: none of the scenes has them, but photos that
    # measure every entry must be able to ask for them.
    PriorComponent(6.0, 1.0, 3.0, roughness=1.0),
    PriorComponent(6.0, 16.0, 3.0, roughness=1.0),
    PriorComponent(6.0, 64.0, 8.0, roughness=1.0),
    # Direct light and, anywhere on the projector, light of which nothing is known, added by hand
    # for scenes that are not direct + near + far (docs/decisions/0037). One more, of reach 2.2 and
    # far deviation 4, cost the box 0.15 dB under a random light.
    LIGHT_FROM_ANYWHERE,
    PriorComponent(2.2, 16.0, FREE, 3.0),
)
# Components of camera pixels without direct light: far-range light alone, the last of them light of
# which nothing is known.
UNLIT_COMPONENTS = (
    *(PriorComponent(0.0, 64.0, decay) for decay in (0.7, 1.5, 3.0, 8.0, 24.0)),
    LIGHT_WITH_EDGES,
    LIGHT_FROM_ANYWHERE,
)
# Where functions of near-range light are of several projector pixels: indices of the lit components
# that the first sweep chooses from, and the later ones for differences from neighbours. All 25 take
# three times as long and gain nothing. Five and two are a tenth quicker: as good from 200 photos,
# but from 60 they relight pictures 0.3 to 0.5 dB worse.
LIT_AT_PITCH = (18, 3, 0, 14, 24, 2, 20)
LIT_DIFFERENCES_AT_PITCH = (18, 2, 20, 24)
# Indices of the lit components that the estimate from any patterns chooses from.
LIT_OF_PATTERNS = (18, 3, 13, 0, 14, 24, 2, 20)
# Prior scales that are tried: standard deviations of near-range light at q, as shares of the
# camera pixel's white.
PRIOR_SCALES = tuple(2e-4 * 2.0**step for step in range(11))

# The typical scenes that the planner plans for (docs/decisions/0012): camera pixels of the box, the
# wedge and the corner together, and of the corner alone. Few pixels of the corner lie in creases,
# but the light that these send from wall to wall limits its SNR. Each row is a component, its prior
# scale, and its share of each scene.
TYPICAL_SCENES = typical_scenes(
    (1.0, 0.1),
    (PriorComponent(1.3, 256.0, 1.5), 0.0005, (0.22, 0.0)),
    (PriorComponent(0.8, 256.0, 0.7), 0.0006, (0.18, 0.0)),
    (PriorComponent(0.8, 256.0, 3.0), 0.0005, (0.1, 0.0)),
    (PriorComponent(0.8, 64.0, 1.5), 0.0016, (0.1, 0.0)),
    (PriorComponent(6.0, 256.0, 1.5), 0.0004, (0.1, 0.0)),
    (PriorComponent(6.0, 64.0, 3.0), 0.0016, (0.09, 0.0)),
    (PriorComponent(6.0, 64.0, 8.0), 0.001, (0.05, 0.0)),
    (PriorComponent(3.5, 16.0, 1.5), 0.005, (0.06, 0.0)),
    (PriorComponent(1.3, 1.0, 3.0), 0.05, (0.05, 0.0)),
    (PriorComponent(2.2, 16.0, 1.5, 3.0), 0.006, (0.05, 0.0)),
    (PriorComponent(0.8, 1.0, 3.0), 0.069, (0.0, 0.004)),
    (PriorComponent(0.8, 256.0, 0.7), 0.00062, (0.0, 0.191)),
    (PriorComponent(1.3, 256.0, 1.5), 0.0016, (0.0, 0.055)),
    (PriorComponent(1.3, 256.0, 1.5), 0.00049, (0.0, 0.345)),
    (PriorComponent(0.8, 256.0, 0.7), 0.002, (0.0, 0.023)),
    (PriorComponent(6.0, 256.0, 1.5), 0.0024, (0.0, 0.003)),
    (PriorComponent(0.8, 256.0, 3.0), 0.00057, (0.0, 0.09)),
    (PriorComponent(0.8, 256.0, 3.0), 0.0016, (0.0, 0.013)),
    (PriorComponent(6.0, 64.0, 1.5), 0.0019, (0.0, 0.01)),
    (PriorComponent(6.0, 256.0, 1.5), 0.00044, (0.0, 0.031)),
    (PriorComponent(2.2, 16.0, 0.7, 3.0), 0.01, (0.0, 0.006)),
    (PriorComponent(0.8, 64.0, 1.5), 0.0019, (0.0, 0.047)),
    (PriorComponent(0.8, 64.0, 3.0), 0.00046, (0.0, 0.023)),
    (PriorComponent(2.2, 16.0, 1.5), 0.0074, (0.0, 0.003)),
    (PriorComponent(0.8, 64.0, 1.5), 0.00069, (0.0, 0.034)),
    (PriorComponent(6.0, 64.0, 8.0), 0.0016, (0.0, 0.031)),
    (PriorComponent(0.8, 64.0, 3.0), 0.0025, (0.0, 0.021)),
    (PriorComponent(6.0, 64.0, 3.0), 0.0026, (0.0, 0.014)),
    (PriorComponent(3.5, 16.0, 1.5), 0.0067, (0.0, 0.013)),
    (PriorComponent(2.2, 16.0, 1.5, 3.0), 0.0096, (0.0, 0.009)),
    (PriorComponent(6.0, 16.0, 3.0), 0.0023, (0.0, 0.004)),
)
