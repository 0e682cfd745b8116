"""What one step of a tracker costs this machine, stage by stage: all cameras, relays and the base station.

The stages are the programs' own functions on images of a scenario; radio, rendering and
the event loop are left out. Beside the whole stands the same step with histograms from
NumPy, over all pixels of the image.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from wsnsim.bench.timing import by_turns
from wsnsim.bench.twins import full_mask_similarities
from wsnsim.bench.vision import NUMPY, Measure
from wsnsim.geometry.quadrics import ellipsoid_outlines
from wsnsim.messages.mixture import MixturePayload
from wsnsim.messages.state import StatePayload
from wsnsim.scenario.load import load_scenario
from wsnsim.sim.build import build
from wsnsim.sim.engine import Simulation
from wsnsim.systems.base import Belief
from wsnsim.systems.multiview.eye import Eye
from wsnsim.systems.multiview.filtering import start
from wsnsim.systems.multiview.following import begin, fuse
from wsnsim.systems.multiview.history import History
from wsnsim.systems.multiview.joining import join
from wsnsim.systems.multiview.orientation import Attitude
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.proposal import takes_part
from wsnsim.systems.multiview.reference_model import learn
from wsnsim.systems.multiview.rules import InitialError
from wsnsim.systems.multiview.sight import facing_viewpoint
from wsnsim.systems.multiview.track import Track
from wsnsim.systems.multiview.variants import Report, Said, variant
from wsnsim.types import NodeId
from wsnsim.vision.features import FeatureSpace
from wsnsim.vision.frame import Frame

_STEPS = (2, 8, 14, 20, 26, 32)
_TURNS = 5
_INITIAL_ERROR = InitialError(position_sd_m=0.1, velocity_sd_mps=0.3)
"""What a filter that follows its target is unsure of, about."""

DRAW, WEIGH, ANSWER, JOIN, FUSE = (
    "who takes part, particles drawn",
    "particles weighed",
    "cameras' answers: weighed, orientation, mixture",
    "relays: mixtures fused",
    "base station: fused, filtered, next state",
)


@dataclass(frozen=True, eq=False)
class _Moment:
    """One step of a run: what the base station asks, what the cameras see."""

    track: Track
    frames: dict[NodeId, Frame]
    said: dict[NodeId, Said]


def bench_tracker(scenario: Path, overrides: Sequence[str] = (), *, quick: bool = False) -> list[Measure]:
    """Time the stages of a multi-view tracker's steps, spread over a run.

    Parameters
    ----------
    scenario : a YAML file
    overrides : as after ``--set``
    quick : one step and one turn, to see that everything runs

    Raises
    ------
    ScenarioError : the scenario cannot be run, or its system is another
    """
    loaded = load_scenario(scenario, overrides)
    params = loaded.system_params
    if not isinstance(params, MultiviewParams):
        raise loaded.error(("system", "kind"), "must be multiview, whose trackers are timed here")
    simulation = build(loaded)
    site = simulation.site
    features = FeatureSpace(params.colour_space)
    models = tuple(learn(target, features) for target in site.targets)
    eyes = {node: Eye(params, site, node, models) for node in site.cameras}
    parts = {node: variant(params.variant).camera(eye) for node, eye in eyes.items()}
    steps = [step for step in _STEPS if step <= site.steps][: 1 if quick else None]
    moments = [_moment(params, simulation, step) for step in steps]

    def drawn() -> None:
        for moment in moments:
            for camera in site.cameras.values():
                takes_part(camera, moment.track.proposal, moment.track.heard_state, params, site)

    def weighed(weigh: Callable[[Eye, Frame, Track], object]) -> None:
        for moment in moments:
            for node in moment.track.asked:
                weigh(eyes[node], moment.frames[node], moment.track)

    def answered() -> None:
        for moment in moments:
            track = moment.track
            for node in track.asked:
                said, _ = parts[node].answer(moment.frames[node], track.heard_state, track.proposal)
                if said is not None:
                    moment.said[node] = said

    def joined() -> None:
        for moment in moments:
            mixtures = [said for said in moment.said.values() if isinstance(said, MixturePayload)]
            for first, second in zip(mixtures[::2], mixtures[1::2], strict=False):
                join([first, second], params, site, 0)

    def fused() -> None:
        for moment in moments:
            moment.track.reports[:] = [Report((node,), said) for node, said in moment.said.items()]
            fusion = fuse(params, site, moment.track, moment.track.step / site.rate_hz)
            begin(params, site, 0, fusion.state, fusion.attitude, moment.track.step + 1, 0.0, fusion.history)

    answered()
    stages: dict[str, Callable[[], object]] = {DRAW: drawn, ANSWER: answered, FUSE: fused}
    if variant(params.variant).fused_on_the_way:
        stages[JOIN] = joined
    if params.variant in ("T0", "T1", "T2"):
        stages[WEIGH] = partial(weighed, _weighed)
        stages[NUMPY] = partial(weighed, partial(_full_mask, features))
    times = by_turns(stages, 1 if quick else _TURNS)
    per_step = {name: 1e3 * times.typical(name) / len(moments) for name in stages}
    setup = f"{scenario.stem} {params.variant}"
    whole = sum(per_step[name] for name in (DRAW, ANSWER, FUSE, JOIN) if name in per_step)
    asked = sum(len(moment.track.asked) for moment in moments) / len(moments)
    measures = [
        Measure(name, setup, per_step[name]) for name in (DRAW, WEIGH, ANSWER, JOIN, FUSE) if name in per_step
    ]
    note = f"{len(site.cameras)} cameras, of which {asked:.1f} take part; {params.particles} particles"
    if NUMPY not in per_step:
        return [*measures, Measure("one step", setup, whole, note=note)]
    plain = whole - per_step[WEIGH] + per_step[NUMPY]
    return [*measures, Measure("one step", setup, whole, NUMPY, plain, plain / whole, note=note)]


def _moment(params: MultiviewParams, simulation: Simulation, step: int) -> _Moment:
    """Return what is asked and seen at a step, the filter a little beside the truth."""
    site, world = simulation.site, simulation.world
    before = world.at((step - 1) / site.rate_hz)[0]
    belief = Belief(before.position, before.velocity, before.orientation)
    history = History(params.smoothing_scans)
    track = begin(
        params, site, 0, start(belief, _INITIAL_ERROR), Attitude(before.orientation), step, 0.0, history
    )
    time = step / site.rate_hz
    bodies, poses = world.moving_bodies, world.moving_at(time)
    frames = {}
    for camera in simulation.cameras:
        image = camera.renderer.render(step, bodies, poses)
        frames[camera.node.id] = Frame(step, time, camera.node.id, partial(np.copy, image))
    return _Moment(track, frames, {})


def _weighed(eye: Eye, frame: Frame, track: Track) -> object:
    return eye.weigh(frame, track.heard_state, track.proposal)


def _full_mask(features: FeatureSpace, eye: Eye, frame: Frame, track: Track) -> object:
    """Weigh the particles as `Eye.weigh` does, with NumPy over all pixels."""
    state: StatePayload = track.heard_state
    image, camera, model = frame.image, eye.camera, eye.models[state.target]
    height, width, _ = image.shape
    region = features.bin_region(image, (0, 0, width, height))
    semi_axes = eye.semi_axes(state.target)
    outlines = ellipsoid_outlines(camera, track.proposal.particles, state.orientation, semi_axes)
    view = facing_viewpoint(model, camera, track.proposal.mean, state.orientation)
    return full_mask_similarities(
        region.colour, region.texture, outlines, model.sqrt_colour[view] ** 2, model.sqrt_texture[view] ** 2
    )
