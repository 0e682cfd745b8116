"""What the page says of the other trackers, the visual hull, and of costs over IEEE 802.15.4."""

from wsnsim.claims.markdown import paragraph, ratio_text
from wsnsim.claims.scanline.evidence import BYTES, HEARD, LATE, Evidence
from wsnsim.claims.scanline.measures import COMPONENTS, energy_a_frame, head_cycles, ratio
from wsnsim.claims.scanline.settings import hulled
from wsnsim.claims.scanline.studies import ALONE, HULL_CROWDS, RADIO_STUDY, params_of, runs_of
from wsnsim.claims.scanline.words import steps_of
from wsnsim.report.wording import count, listed, number, percent, quantity

_SENT = {"bearing": "bearings", "scan_line": "whole scan lines", "jpeg": "JPEG images"}


def trackers(evidence: Evidence) -> str:
    """Say what the other trackers are."""
    return paragraph(
        f"The setting of Fig. 10, {count(steps_of(evidence, 'trackers'))} steps, with the trackers that "
        "Sec. 4 finds wanting. The Kalman filters have no use for what is known of the occluders. A filter "
        "that loses the object stays certain and does not find it again: *worse than nothing* counts the "
        "runs without priors whose error is above that of who takes the object to be in the room's centre. "
        "*As printed* is without floors under the weights and without the rescaling of Eq. 5; *one stage* "
        "draws its particles without a look at the measurements."
    )


def hulls(evidence: Evidence) -> str:
    """Say what the visual hull is tried on, and what it brings."""
    said = []
    for m in HULL_CROWDS:
        found = ratio(hulled(m, "ellipses"), hulled(m, "none"))(evidence)
        assert found is not None
        said.append(f"× {ratio_text(found)} among {count(m)} occluders")
    return paragraph(
        f"Eight cameras without the block, {count(steps_of(evidence, 'hull'))} steps. Ellipses and polygons "
        "are the two readings of the visual hull in Sec. 4.4, without phantoms and the object's own piece; "
        "*scan_lines* uses the same messages without a hull: a blind camera must show a blob where the "
        f"object would be. Error with ellipses over that with nothing: {listed(said)}."
    )


def radio(evidence: Evidence) -> str:
    """Say what is run over the radio."""
    images, deadline_s = evidence.on_air("jpeg"), params_of(runs_of(RADIO_STUDY, "bearing")[0]).deadline_s
    assert images is not None
    assert deadline_s is not None
    return paragraph(
        f"Eight cameras with the block at 7.5 frames a second, {count(steps_of(evidence, 'radio'))} steps "
        f"(JPEG: {count(images.steps)}), motes Imote2 at 416 MHz with radios always on, the base station as "
        "the cluster head. Bytes on the air are those of all frames, with headers, repeats and "
        f"acknowledgements. A report is heard in time if it is there {quantity(deadline_s, 's')} after its "
        "frame. The motes that measure the occluders' places for *kalman* and *perfect* do so for nothing "
        "here: no sensor for it is reckoned with. Energies are of a camera's node; processing is priced by "
        "the pixel (difference to the background, threshold, sum of the columns) whatever is said of it."
    )


def costs(evidence: Evidence) -> str:
    """Say what bearings, scan lines and images cost."""
    said = []
    for cell, name in _SENT.items():
        place = evidence.on_air(cell)
        assert place is not None
        heard = percent(float(place.figure(HEARD).mean()))
        said.append(
            f"{name} {quantity(_sent(evidence, cell), 'J')} of {quantity(_whole(evidence, cell), 'J')}, "
            f"{heard} in time"
        )
    alone = evidence.on_air(ALONE)
    assert alone is not None
    size, late = float(alone.figure(BYTES).mean()), float(alone.figure(LATE).mean())
    times = _sent(evidence, ALONE) / _sent(evidence, "bearing")
    shown = ("bearing", "kalman", "scan_line")
    cycles = [f"{cell} {number(head_cycles(evidence, cell) / 1e6)}" for cell in shown]
    return paragraph(
        "Left, what a camera's node draws from one frame to the next. Energy for sending of all energy, a "
        f"frame: {'; '.join(said)}. Of JPEG images at this rate next to nothing is sent before its time is "
        "over. A camera that has the channel to itself, one image in ten seconds, needs "
        f"{quantity(_sent(evidence, ALONE), 'J')} and {number(late)} s for {quantity(size, 'B')}: "
        f"× {number(times)} of a bearing's, where all of a frame with bearings takes "
        f"{quantity(_whole(evidence, 'bearing'), 'J')}. Bearings and scan lines differ on the channel, not "
        "in the battery: the radio listens for most of its energy, and processor and board take far more. "
        f"What priors cost is the head's work, in millions of cycles a frame: {listed(cycles)}."
    )


def _sent(evidence: Evidence, cell: str) -> float:
    return float(energy_a_frame(evidence, cell)["radio_tx"].mean())


def _whole(evidence: Evidence, cell: str) -> float:
    parts = energy_a_frame(evidence, cell)
    return sum(float(parts[each].mean()) for each in COMPONENTS)
