"""The base station's search for a target that no track follows.

Cameras report where in their image they see something like it; where the rays of enough
of them meet twice, at two instants, a track begins: two places tell a velocity.
"""

from dataclasses import dataclass, replace

from wsnsim.estimation.kalman import Gaussian
from wsnsim.hardware.work import Work
from wsnsim.messages.search import SearchPayload, SightingPayload
from wsnsim.systems.base import Basis, Belief, Note, Scope, Send, Site, Step, Timer, TrackEstimate
from wsnsim.systems.multiview.filtering import advance, appear, position_cov
from wsnsim.systems.multiview.following import next_step
from wsnsim.systems.multiview.orientation import Attitude
from wsnsim.systems.multiview.params import MultiviewParams
from wsnsim.systems.multiview.search import meeting_point
from wsnsim.systems.multiview.track import Quest
from wsnsim.types import Seconds

_MEET_FLOATS = 300.0  # two rays: their nearest point, its distance from the others
_REPEAT_S = 1.0
"""How often the cameras are told anew to look for a target: a search may be lost on its way."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a track begins with: belief (6,) and attitude at the step before `upcoming`."""

    state: Gaussian
    attitude: Attitude
    upcoming: int


def seek(
    params: MultiviewParams, site: Site, number: int, step: int, last: TrackEstimate | None
) -> tuple[Quest, Step]:
    """Have the cameras look for a target from `step` on."""
    timer = _collected(params, site, number, step)
    sends = (Send(Scope.TREE, SearchPayload(number, step)),)
    return Quest(number, step, step, last), Step(sends=sends, timers=(timer,))


def wanted(params: MultiviewParams, site: Site, sighting: SightingPayload, quest: Quest) -> bool:
    """Tell whether a sighting is recent, and of an image after those that met before."""
    recent = _recent(params, site, sighting.step, quest.step)
    return recent and (quest.met is None or sighting.step > quest.met[0])


def meet(params: MultiviewParams, site: Site, quest: Quest, now: Seconds) -> tuple[Quest | Found, Step]:
    """Take where the cameras' last sightings meet; the second such place begins a track."""
    target, loss = site.targets[quest.number], params.searching
    work = Work(float_ops=_MEET_FLOATS * len(quest.sightings) ** 2)
    reach_m = float(target.semi_axes_m.max())
    meeting = meeting_point(quest.sightings, site.cameras, reach_m, loss.cameras_min)
    if meeting is None:
        later, step = _go_on(params, site, quest)
        return later, replace(step, work=work)
    place, cameras = meeting
    seen = max(quest.sightings[camera].step for camera in cameras)
    if quest.met is None or not _recent(params, site, quest.met[0], seen):
        # a second meeting must rest on other images
        later, step = _go_on(params, site, replace(quest, met=(seen, place), sightings={}))
        return later, replace(step, work=work)
    apart = (seen - quest.met[0]) / site.rate_hz
    state = appear(place, (place - quest.met[1]) / apart, 0.5 * reach_m, apart)
    orientation = target.start.orientation if quest.last is None else quest.last.belief.orientation
    upcoming, estimates = next_step(site, seen, now), []
    for step_number in range(seen, min(upcoming, site.steps + 1)):
        if step_number > seen:
            state = advance(state, 1.0 / site.rate_hz, params.acceleration_sd_mps2)
        estimates.append(
            TrackEstimate(
                time=step_number / site.rate_hz,
                track=target.id,
                belief=Belief(state.mean[:3], state.mean[3:], orientation),
                cov=position_cov(state),
                basis=Basis.UPDATE if step_number == seen else Basis.SKIPPED,
                asked=len(site.cameras) if step_number == seen else 0,
                heard=len(cameras) if step_number == seen else 0,
            )
        )
    note = Note("track_started", f"{target.id}: seen by {', '.join(cameras)}")
    found = Found(state, Attitude(orientation), upcoming)
    return found, Step(work=work, estimates=tuple(estimates), notes=(note,))


def _go_on(params: MultiviewParams, site: Site, quest: Quest) -> tuple[Quest, Step]:
    """Collect the sightings of the next step; tell the cameras again now and then."""
    rate_hz = site.rate_hz
    held = () if quest.last is None else (replace(quest.last, time=quest.step / rate_hz),)
    step = quest.step + 1
    if step > site.steps:
        return replace(quest, step=step), Step(estimates=held)
    again = step - quest.asked_at >= _REPEAT_S * rate_hz
    recent = {
        node: sighting
        for node, sighting in quest.sightings.items()
        if _recent(params, site, sighting.step, step)
    }
    asked_at = step if again else quest.asked_at
    later = replace(quest, step=step, asked_at=asked_at, sightings=recent)
    sends = (Send(Scope.TREE, SearchPayload(quest.number, step)),) if again else ()
    timer = _collected(params, site, quest.number, step)
    return later, Step(sends=sends, timers=(timer,), estimates=held)


def _recent(params: MultiviewParams, site: Site, seen: int, step: int) -> bool:
    """Tell whether what was seen still says something at a step: slow motes search for several frames."""
    return step - seen <= params.searching.after_s * site.rate_hz


def _collected(params: MultiviewParams, site: Site, number: int, step: int) -> Timer:
    """Return when the sightings of a step are in."""
    rate_hz = site.rate_hz
    return Timer(f"{number}:{step}", step / rate_hz + min(params.deadline(rate_hz), 0.9 / rate_hz))
