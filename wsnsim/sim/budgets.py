"""The bandwidth budgets of a run's motes, from the scenario."""

from functools import partial

from wsnsim.errors import ScenarioError
from wsnsim.net.budget import BudgetConfig
from wsnsim.scenario.faults import Fault, KeyPath
from wsnsim.scenario.load import LoadedScenario
from wsnsim.scenario.nodes import placed_nodes
from wsnsim.scenario.schema_motes import Budget
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.sim.macs import mac_family, most_sent_bytes
from wsnsim.types import NodeId

_BITS = 8


def budget_configs(loaded: LoadedScenario) -> dict[NodeId, BudgetConfig]:
    """Return the budgets of the motes that have one.

    Raises
    ------
    ScenarioError : a burst in which no frame fits, or an ideal network, where nothing is on the air
    """
    scenario = loaded.scenario
    asked = {node.id: node.budget for node in placed_nodes(scenario) if node.budget is not None}
    if not asked:
        return {}
    path: KeyPath = ("motes", "default", "budget")
    paths: dict[NodeId, KeyPath] = {
        entry.id: ("motes", "nodes", number, "budget")
        for number, entry in enumerate(scenario.motes.nodes)
        if entry.budget is not None
    }
    if scenario.network.standard == "ideal":
        where = path if scenario.motes.default.budget else next(iter(paths.values()))
        message = "must be left out: over an ideal network nothing is on the air; got a budget"
        raise loaded.error(where, message)
    least = least_burst_bytes(scenario.network)
    faults = {
        Fault(
            (*paths.get(node, path), "burst_bytes"),
            f"must be at least {least}, the longest frame with all its repeats and an acknowledgement, "
            f"got {budget.burst_bytes} [bytes]",
        ): None
        for node, budget in asked.items()
        if budget.burst_bytes is not None and budget.burst_bytes < least
    }
    if faults:
        raise ScenarioError([loaded.marks.problem(fault) for fault in faults])
    return {node: _config(budget, least, scenario.network) for node, budget in asked.items()}


def least_burst_bytes(network: NetworkParams) -> int:
    """Return what a burst must hold for the longest frame to be sent at all [B]."""
    family = mac_family(network)
    return most_sent_bytes(network, family.overhead_bytes + family.max_payload_bytes)


def _config(budget: Budget, least_bytes: int, network: NetworkParams) -> BudgetConfig:
    burst_bytes = budget.burst_bytes
    if burst_bytes is None:
        burst_bytes = max(least_bytes, budget.bandwidth_bps // _BITS)
    most = partial(most_sent_bytes, network)
    return BudgetConfig(budget.bandwidth_bps, burst_bytes, budget.at_limit, most)
