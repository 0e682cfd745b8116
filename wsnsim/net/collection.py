"""When a node of a collection tree must send on what it has gathered, at the latest.

As in TAG, deeper nodes go earlier, so that what they send finds their parents
still waiting. The instants are counted back from the time by which the base
station wants everything: each hop on the way takes the time of making an
aggregate and the time that the MAC needs to bring it to the next node. Nodes
of one depth go at the same time and share the channel; nodes of different
depths do not, if everyone keeps its instant.

References
----------
Madden, Franklin, Hellerstein, Hong, TAG: a Tiny AGgregation Service for Ad-Hoc
Sensor Networks (OSDI 2002), sec. 4.1: the epoch is cut up among the depths of
the tree.
"""

from collections.abc import Mapping, Sequence

from wsnsim.net.frames import ACK_BYTES
from wsnsim.net.phy import (
    ACK_WAIT_NS,
    CCA_NS,
    TURNAROUND_NS,
    UNIT_BACKOFF_NS,
    air_time_ns,
    interframe_space_ns,
)
from wsnsim.net.routing import Tree
from wsnsim.types import Nanoseconds, NodeId, Seconds

GUARD_S: Seconds = 1e-3
"""Service time of a hop over which nothing takes time: a child still comes before its parent, though its
processor was a little later than usual."""


def csma_ca_service_ns(mpdu_bytes: Sequence[int], contenders: int, min_be: int) -> Nanoseconds:
    """Return the time in which unslotted CSMA/CA brings a datagram over one hop, as a rule [ns].

    A frame of L octets that nobody disturbs takes

        T(L) = (2^BE - 1)/2 · backoff + CCA + turnaround + air(L) + turnaround + air(ACK) + space(L),

    the mean of its first backoff, and all that follows up to the instant at
    which the next frame may contend. Where c nodes begin together with one
    datagram each, the channel carries one frame at a time, so the last datagram is
    through when all are, after about c · Σ T(L) over its frames. (Backoffs
    overlap, which saves time, and frames collide, which costs it. For 2 and 3
    nodes the two cancel; from 5 nodes on the mean of the last arrival is less,
    because CSMA/CA gives frames up.) One attempt in vain at the longest frame is allowed for:

        R(L) = (2^BE - 1)/2 · backoff + CCA + turnaround + air(L) + macAckWaitDuration.

    Parameters
    ----------
    mpdu_bytes : lengths of the datagram's frames, frame check sequence included [B]
    contenders : nodes that have such a datagram to send at the same time, the node itself among them
    min_be : macMinBE

    References
    ----------
    IEEE Std 802.15.4-2006, sec. 7.5.1.3 (spacing), 7.5.1.4 (CSMA-CA), 7.5.6.4 (acknowledgement, retries).
    """
    begin_ns = ((1 << min_be) - 1) * UNIT_BACKOFF_NS // 2 + CCA_NS + TURNAROUND_NS
    exchanges_ns = sum(
        begin_ns + air_time_ns(size) + TURNAROUND_NS + air_time_ns(ACK_BYTES) + interframe_space_ns(size)
        for size in mpdu_bytes
    )
    retry_ns = begin_ns + air_time_ns(max(mpdu_bytes)) + ACK_WAIT_NS
    return contenders * exchanges_ns + retry_ns


def leads_s(tree: Tree, hop_s: Mapping[NodeId, Seconds]) -> dict[NodeId, Seconds]:
    """Return how long before the base wants it each node must begin an aggregate [s].

    Parameters
    ----------
    tree : the routing tree
    hop_s : time from beginning an aggregate at a node until its parent has it, for all but the base [s]
    """
    leads = {tree.root: 0.0}
    for node in tree.descendants(tree.root):
        parent = tree.parent[node]
        assert parent is not None
        leads[node] = leads[parent] + hop_s[node]
    return leads


def latest_s(due_s: Seconds, lead_s: Seconds, frame_s: Seconds) -> Seconds:
    """Return the instant after which a node waits no longer [s].

    Parameters
    ----------
    due_s : when the base station wants a group's messages
    lead_s : how long before that the node must begin
    frame_s : when the group's images are taken; nobody goes before there is anything to send
    """
    return max(due_s - lead_s, frame_s)
