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

from collections.abc import Mapping

from wsnsim.net.routing.tree import Tree
from wsnsim.types import NodeId, Seconds

GUARD_S: Seconds = 1e-3
"""Service time of a hop over which nothing takes time: a child still comes before its parent, though its
processor was a little later than usual."""


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
        leads[node] = leads[parent] + (0.0 if node in tree.wired else hop_s[node])
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
