"""Plain words for the names that stand in tables and summaries."""

from collections.abc import Mapping

OUTCOMES: Mapping[str, str] = {
    "delivered": "arrived",
    "fused": "reached the next node and went on in its message",
    "in_flight": "still on its way at the end",
    "dropped_queue": "lost: a queue on the way was full",
    "dropped_channel_access": "lost: the channel was busy at every try",
    "dropped_no_ack": "lost: never acknowledged",
    "dropped_not_heard": "lost: a broadcast was not heard",
    "dropped_reassembly": "lost: a fragment was missing",
    "dropped_expired": "too late to be of use",
    "dropped_budget": "lost: beyond a mote's bandwidth budget",
    "dropped_dead_node": "lost: a node on the way had stopped",
    "dropped_no_route": "lost: a node on the way knew no way on",
    "dropped_hop_limit": "lost: it had taken all the hops that it may",
    "dropped_undecodable": "lost: arrived, but could not be decoded",
    "dropped_refused": "set aside by a relay's program",
}

MESSAGES: Mapping[str, str] = {
    "packet": "bytes that only fill the air",
    "state": "the prediction that cameras work from",
    "weights": "how well each particle fits an image",
    "mixture": "where the target may be, as a few Gaussians",
    "ray": "the direction in which a camera sees the target",
    "upward batch": "answers about several targets in one message",
    "downward batch": "states of several targets in one message",
    "search": "a call to look for a target",
    "scan_line": "where in its scan line a camera sees the object, and the blobs of all others where needed",
    "places": "measured places of occluders",
    "track": "where the cluster head believes the object",
    "energy": "what a mote's battery still holds",
    "head": "who is the cluster head",
    "handover": "what a cluster head leaves to the next one",
    "image_part": "a part of a compressed image",
    "sighting": "where a camera believes that it sees a target that is sought",
}

EVENTS: Mapping[str, str] = {
    "death": "nodes that stopped for good because their battery was empty",
    "budget_reached": "motes whose bandwidth budget held a frame up, the first time of each",
    "budget_silent": "answers that no form was short enough for, within the mote's bandwidth budget",
    "frame_skipped": "images that were not taken because the processor or the imager was still busy",
    "frame_unused": "images that no state arrived for, or that the base station passed over",
    "track_lost": "tracks that the tracker gave up",
    "track_started": "tracks that the tracker began, or found again",
    "reinitialised": "times that no particle explained what was seen, and all were drawn anew",
    "frame_left_out": "frames that a tracker left out because its processor was still busy",
    "occluders_unknown": "frames whose blobs cut the floor into too many pieces; nothing was known of the "
    "occluders",
    "report_late": "reports of cameras that came after their frame was closed",
    "image_refused": "images that arrived damaged, or in parts that did not go together",
    "report_astray": "reports of cameras that had not heard who is the cluster head",
    "head_elected": "elections in which another mote became cluster head",
    "head_kept": "elections in which the cluster head stayed",
    "handed_over": "cluster heads that went on from what the one before them believed",
    "handover_late": "beliefs that were handed over when the new cluster head had begun without them",
    "head_silent": "times that the base station had heard no cluster head for so long that it gave up",
    "head_heard": "times that it heard one again",
    "sighting_late": "sightings of a lost target that arrived after the search for it was over",
    "sighting_refused": "sightings of no use, set aside",
    "weights_late": "weights that arrived after their step was closed",
    "weights_refused": "weights that nobody had asked for, or too many or too few, and were set aside",
    "mixture_late": "mixtures that arrived after their step was closed",
    "mixture_refused": "mixtures that nobody had asked for, or of cameras heard before, and were set aside",
    "ray_late": "rays that arrived after their step was closed",
    "ray_refused": "rays that nobody had asked for, or of cameras heard before, and were set aside",
}

ESTIMATES: Mapping[str, str] = {
    "update": "from measurements",
    "timed_out": "cameras were asked, none was heard in time",
    "unasked": "no camera has the target in view",
    "skipped": "the tracker was still busy with an earlier step",
    "lost": "the track was given up, its last place is held",
    "smoothed": "revised afterwards",
}

ENERGY_CAUSES: Mapping[str, str] = {
    "energy_radio_tx_j": "radio, sending",
    "energy_radio_rx_j": "radio, receiving",
    "energy_radio_listen_j": "radio, listening",
    "energy_radio_sleep_j": "radio, asleep",
    "energy_cpu_j": "processor",
    "energy_camera_j": "camera",
    "energy_board_j": "rest of the board",
}

ENERGY_USES: Mapping[str, str] = {
    "energy_radio_tx_j": "sending",
    "energy_radio_rx_j": "receiving",
    "energy_radio_listen_j": "listening for frames",
    "energy_radio_sleep_j": "its sleeping radio",
    "energy_cpu_j": "its processor",
    "energy_camera_j": "its camera",
    "energy_board_j": "the rest of its board",
}

ROLES: Mapping[str, str] = {
    "camera": "camera",
    "relay": "relay",
    "mote": "mote",
    "sink": "sink",
    "base": "base station",
}


ATTEMPTS = (
    "how often a frame that asks for an acknowledgement was sent, on average; under low-power listening "
    "each copy of a train is an attempt"
)
FAILURES = (
    "share that was not acknowledged; under low-power listening all copies of a train but the one that the "
    "receiver wakes for"
)
"""What figures of the medium access mean."""


def explained(words: Mapping[str, str], name: str) -> str:
    """Return the words for a name, or the name itself with spaces."""
    return words.get(name, name.replace("_", " "))
