"""Light transport between a projector and a camera: measure it, split it, relight the scene.

After Reddy, Ramamoorthi and Curless, "Frequency-Space Decomposition and Acquisition of Light
Transport under Spatially Varying Illumination", ECCV 2012.

Each step takes what the steps before it return::

    plan -> rig -> capture -> measurements, correspondence -> transport -> pictures

Plan what to project
    Size                   height and width of a grid of pixels; plain (height, width) does, too
    parse_size             read a size from text, for instance "68x100"
    Plan                   the patterns of all photos, in the order to shoot
    paper_plan             plan the patterns of the paper
    choose_plan            choose the patterns that relight best with a number of photos
    read_plan              read a plan from a file
    parse_plan             read a plan from JSON text

Open a rig
    open_rig               open a projector and a camera, simulated or real, as a context

Capture the photos
    acquire                show a plan on a rig and keep the photos
    shoot_again            take some of the photos again
    write_capture          keep photos that were taken elsewhere
    open_capture           open the photos that are kept
    Capture                the photos of a plan, on the disk
    superpose              relight by a weighted sum of photos alone, without a transport
    Superposition          that picture, its error bars, and how much of the light is missing

Measure
    measure                turn photos into responses to cosines and sines
    Measurements           the responses of every camera pixel, and their noise

Correspond
    correspond             find the projector pixel that lights each camera pixel directly
    given_correspondence   take it from an array
    read_correspondence    read it from a file
    Correspondence         that projector pixel, q, for every camera pixel

Estimate
    estimate_transport     estimate the transport from measurements and correspondence
    reconstruct            measure, correspond and estimate in bounded memory
    reconstruct_to_file    the same into a file, here or on the machines of a Dask cluster
    ReconstructionOptions  how it is done: method, memory, device, ...

Use the transport
    Transport              direct, near- and far-range transport: relights and takes apart
    ErrorBars              standard deviations of a transport and of relit pictures
    prepare_transport      lay a transport out to relight it many times
    save_transport         write a transport
    load_transport         read a transport
    split_physically       split a transport into direct light, subsurface light, inter-reflection
    PhysicalSplit          a transport so split: relights and takes apart
    PhysicalErrorBars      standard deviations of its components and pictures
    compensate             find the light under which the scene looks like a picture
    Compensation           that light, and how near its photo is expected to come
    refine_compensation    correct it by photos of it on a rig
    Refinement             the light that photos have corrected, and how near they came
    relight_together       relight by several projectors before one camera
    compensate_together    find the lights of several projectors that make a picture together
    JointCompensation      these lights, and how near their photo is expected to come
    bounces                take a relit picture apart by how often its light was reflected
    Bounces                pictures of the first, second ... bounce
    probe                  relight by chosen projector pixels for each camera pixel
    ProbingMask            these: within a distance of q, a ring, a band about a line, any
    dual_view              the scene as the projector sees it, lit from the camera
    find_reciprocity       whether light goes back as it came, which sharpens dual views
    Reciprocity            how far both directions agree, and the ratio between them
    widen_subsurface       let light travel farther under translucent surfaces, or less far
    recolour               change the colour of one component
    cut_far                cut far-range light between regions of the projector and the camera
    Cut                    the transport without that light, and how well it is cut
    depth                  points on the surfaces of a capture or a transport, with error bars
    triangulate            the same from correspondence
    Depth                  these points
    StereoCalibration      where camera and projector stand, and their lenses
    read_stereo_calibration   read it from a file, as OpenCV writes it
    save_stereo_calibration   write it

Lights to relight under
    white                  full white
    natural_picture        a picture with the statistics of photographs
    penguin                the penguin of the paper's figure 2
    random_pattern         an independent value at every pixel

Judge
    judge_transport        judge a transport by the photos that its estimate never saw
    ExactTransport         the transport of a scene, known without a model
    ExactOperator          the same at native size, of which no matrix is kept
    save_exact             write an exact transport
    load_exact             read an exact transport
    relighting_snr         SNR_b: how well pictures under lights agree
    row_snr                SNR_t: how well the rows of two transports agree
    snr                    the signal-to-noise ratio of any two arrays
    check_model            where the paper's assumptions hold on a scene
    condition_near         how well near patterns tell the entries of a window apart

Besides
    progress_bar           draw a bar while a long step runs
    NearfarError           base of all errors that nearfar raises

Examples
--------
The transport of a small scene, its photos simulated. Examples of single functions go on from here.

>>> import numpy as np
>>> import nearfar
>>> size = (8, 8)  # height and width of the projector, and here of the camera
>>> scene = 0.5 * np.eye(64) + 0.003  # direct light, and some that reaches every pixel
>>> np.save("scene.npy", scene)
>>> light = nearfar.natural_picture(size, seed=1)

The steps:

>>> plan = nearfar.paper_plan(size, window=3, far=(3, 3))
>>> with nearfar.open_rig("scene.npy", size) as rig:
...     capture = nearfar.acquire(plan, "capture.zarr", rig)
>>> measurements = nearfar.measure(capture)
>>> correspondence = nearfar.correspond(capture)
>>> transport = nearfar.estimate_transport(measurements, correspondence, window=3, far=(3, 3))
>>> relit = transport @ light

The picture that the camera would see agrees with the scene's:

>>> truth = nearfar.load_exact("scene.npy", projector=size)
>>> bool(nearfar.relighting_snr(transport, truth, {"picture": light})["picture"] > 30)
True
"""

from importlib import import_module

# As in typing, which takes as long to import as all else that a command needs before it can say
# that it was interrupted.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from nearfar.applications.bounces import Bounces, bounces
    from nearfar.applications.compensate import Compensation, compensate
    from nearfar.applications.compensate_together import JointCompensation, compensate_together
    from nearfar.applications.depth import Depth, triangulate
    from nearfar.applications.dual import dual_view
    from nearfar.applications.editing import Cut, cut_far, recolour, widen_subsurface
    from nearfar.applications.masks import ProbingMask
    from nearfar.applications.probe import probe
    from nearfar.applications.reciprocity import Reciprocity, find_reciprocity
    from nearfar.applications.several_projectors import relight_together
    from nearfar.arrays import Size, parse_size
    from nearfar.capture import Capture, open_capture, write_capture
    from nearfar.correspondence import (
        Correspondence,
        given_correspondence,
        read_correspondence,
    )
    from nearfar.errors import NearfarError
    from nearfar.estimate.error_bars import ErrorBars
    from nearfar.estimate.physical import PhysicalErrorBars, PhysicalSplit, split_physically
    from nearfar.illumination.pictures import natural_picture, penguin, random_pattern, white
    from nearfar.photometry.measurements import Measurements
    from nearfar.plan import Plan, choose_plan, paper_plan, parse_plan, read_plan
    from nearfar.progress import progress_bar
    from nearfar.rigs.opening import open_rig
    from nearfar.stereo import (
        StereoCalibration,
        read_stereo_calibration,
        save_stereo_calibration,
    )
    from nearfar.transport.exact import ExactTransport
    from nearfar.transport.exact_operator import ExactOperator
    from nearfar.transport.exact_store import load_exact, save_exact
    from nearfar.transport.model import Transport
    from nearfar.transport.prepared import prepare_transport
    from nearfar.transport.store import load_transport, save_transport
    from nearfar.workflow.acquire import acquire, shoot_again
    from nearfar.workflow.check import check_model
    from nearfar.workflow.conditioning import condition_near
    from nearfar.workflow.depth import depth
    from nearfar.workflow.evaluate import relighting_snr, row_snr, snr
    from nearfar.workflow.reconstruction.options import ReconstructionOptions
    from nearfar.workflow.reconstruction.reconstruct import reconstruct, reconstruct_to_file
    from nearfar.workflow.refine import Refinement, refine_compensation
    from nearfar.workflow.steps import correspond, estimate_transport, measure
    from nearfar.workflow.superpose import Superposition, superpose
    from nearfar.workflow.verdict.keeping import judge_transport

    __version__: str

# Where each public name lives, in the order of the flow; loaded when it is first asked for, so
# that importing stays quick.
_HOMES = {
    "Size": "nearfar.arrays",
    "parse_size": "nearfar.arrays",
    "Plan": "nearfar.plan",
    "paper_plan": "nearfar.plan",
    "choose_plan": "nearfar.plan",
    "read_plan": "nearfar.plan",
    "parse_plan": "nearfar.plan",
    "open_rig": "nearfar.rigs.opening",
    "acquire": "nearfar.workflow.acquire",
    "shoot_again": "nearfar.workflow.acquire",
    "write_capture": "nearfar.capture",
    "open_capture": "nearfar.capture",
    "Capture": "nearfar.capture",
    "superpose": "nearfar.workflow.superpose",
    "Superposition": "nearfar.workflow.superpose",
    "measure": "nearfar.workflow.steps",
    "Measurements": "nearfar.photometry.measurements",
    "correspond": "nearfar.workflow.steps",
    "given_correspondence": "nearfar.correspondence",
    "read_correspondence": "nearfar.correspondence",
    "Correspondence": "nearfar.correspondence",
    "estimate_transport": "nearfar.workflow.steps",
    "reconstruct": "nearfar.workflow.reconstruction.reconstruct",
    "reconstruct_to_file": "nearfar.workflow.reconstruction.reconstruct",
    "ReconstructionOptions": "nearfar.workflow.reconstruction.options",
    "Transport": "nearfar.transport.model",
    "ErrorBars": "nearfar.estimate.error_bars",
    "prepare_transport": "nearfar.transport.prepared",
    "save_transport": "nearfar.transport.store",
    "load_transport": "nearfar.transport.store",
    "split_physically": "nearfar.estimate.physical",
    "PhysicalSplit": "nearfar.estimate.physical",
    "PhysicalErrorBars": "nearfar.estimate.physical",
    "compensate": "nearfar.applications.compensate",
    "Compensation": "nearfar.applications.compensate",
    "refine_compensation": "nearfar.workflow.refine",
    "Refinement": "nearfar.workflow.refine",
    "relight_together": "nearfar.applications.several_projectors",
    "compensate_together": "nearfar.applications.compensate_together",
    "JointCompensation": "nearfar.applications.compensate_together",
    "bounces": "nearfar.applications.bounces",
    "Bounces": "nearfar.applications.bounces",
    "probe": "nearfar.applications.probe",
    "ProbingMask": "nearfar.applications.masks",
    "dual_view": "nearfar.applications.dual",
    "find_reciprocity": "nearfar.applications.reciprocity",
    "Reciprocity": "nearfar.applications.reciprocity",
    "widen_subsurface": "nearfar.applications.editing",
    "recolour": "nearfar.applications.editing",
    "cut_far": "nearfar.applications.editing",
    "Cut": "nearfar.applications.editing",
    "depth": "nearfar.workflow.depth",
    "triangulate": "nearfar.applications.depth",
    "Depth": "nearfar.applications.depth",
    "StereoCalibration": "nearfar.stereo",
    "read_stereo_calibration": "nearfar.stereo",
    "save_stereo_calibration": "nearfar.stereo",
    "white": "nearfar.illumination.pictures",
    "natural_picture": "nearfar.illumination.pictures",
    "penguin": "nearfar.illumination.pictures",
    "random_pattern": "nearfar.illumination.pictures",
    "judge_transport": "nearfar.workflow.verdict.keeping",
    "ExactTransport": "nearfar.transport.exact",
    "ExactOperator": "nearfar.transport.exact_operator",
    "save_exact": "nearfar.transport.exact_store",
    "load_exact": "nearfar.transport.exact_store",
    "relighting_snr": "nearfar.workflow.evaluate",
    "row_snr": "nearfar.workflow.evaluate",
    "snr": "nearfar.workflow.evaluate",
    "check_model": "nearfar.workflow.check",
    "condition_near": "nearfar.workflow.conditioning",
    "progress_bar": "nearfar.progress",
    "NearfarError": "nearfar.errors",
}

# In the order of the flow, as `help(nearfar)` lists them.
__all__ = [  # noqa: RUF022
    "Size",
    "parse_size",
    "Plan",
    "paper_plan",
    "choose_plan",
    "read_plan",
    "parse_plan",
    "open_rig",
    "acquire",
    "shoot_again",
    "write_capture",
    "open_capture",
    "Capture",
    "superpose",
    "Superposition",
    "measure",
    "Measurements",
    "correspond",
    "given_correspondence",
    "read_correspondence",
    "Correspondence",
    "estimate_transport",
    "reconstruct",
    "reconstruct_to_file",
    "ReconstructionOptions",
    "Transport",
    "ErrorBars",
    "prepare_transport",
    "save_transport",
    "load_transport",
    "split_physically",
    "PhysicalSplit",
    "PhysicalErrorBars",
    "compensate",
    "Compensation",
    "refine_compensation",
    "Refinement",
    "relight_together",
    "compensate_together",
    "JointCompensation",
    "bounces",
    "Bounces",
    "probe",
    "ProbingMask",
    "dual_view",
    "find_reciprocity",
    "Reciprocity",
    "widen_subsurface",
    "recolour",
    "cut_far",
    "Cut",
    "depth",
    "triangulate",
    "Depth",
    "StereoCalibration",
    "read_stereo_calibration",
    "save_stereo_calibration",
    "white",
    "natural_picture",
    "penguin",
    "random_pattern",
    "judge_transport",
    "ExactTransport",
    "ExactOperator",
    "save_exact",
    "load_exact",
    "relighting_snr",
    "row_snr",
    "snr",
    "check_model",
    "condition_near",
    "progress_bar",
    "NearfarError",
]

# Public names of before: where each lives, and what to use instead.
_OLD = {
    "correspond_by_stripes": (
        "nearfar.correspondence",
        "use nearfar.correspond(capture, method='stripes')",
    ),
    "counted": ("nearfar.progress", "give progress what nearfar.progress_bar yields, as it is"),
    "opened_rig": ("nearfar.rigs.opening", "use nearfar.open_rig, whose rigs are contexts, too"),
    "reconstruct_on": (
        "nearfar.workflow.reconstruction.old",
        "use nearfar.reconstruct_to_file(capture, output, scheduler=address)",
    ),
    "version": ("nearfar.release", "use nearfar.__version__"),
}


def __getattr__(name: str) -> "Any":
    if name == "__version__":
        return import_module("nearfar.release").version()
    if name in _OLD:
        home, instead = _OLD[name]
        import_module("nearfar.deprecation").warn_of(f"nearfar.{name}", instead)
        return getattr(import_module(home), name)
    if name not in _HOMES:
        raise AttributeError(f"module 'nearfar' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
