"""Transceivers, medium access and queues of a run's nodes, from the scenario."""

from wsnsim.net.config import LinkConfig, RadioConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.mac.csma_ca import CsmaCaConfig, CsmaCaFamily
from wsnsim.net.mac.dcf_config import DcfConfig
from wsnsim.net.mac.dcf_family import DcfFamily
from wsnsim.net.mac.lpl_config import LplConfig, step_ns
from wsnsim.net.mac.lpl_family import LplFamily
from wsnsim.net.mac.napping import START_UP_NS
from wsnsim.net.mac.tdma_config import TdmaConfig
from wsnsim.net.mac.tdma_family import TdmaFamily
from wsnsim.scenario.schema_mac import CsmaCa, Dcf, Lpl, Tdma
from wsnsim.scenario.schema_network import NetworkParams
from wsnsim.units import to_ns

_USUAL = RadioConfig()
"""Carrier sensing of MACs that have no choice of it."""


def radio_config(network: NetworkParams) -> RadioConfig:
    """Return the transceivers of all nodes."""
    mac = network.mac
    return RadioConfig(
        tx_power_dbm=network.tx_power_dbm,
        sensitivity_dbm=network.sensitivity_dbm,
        noise_dbm=network.noise_dbm,
        lock_sinr_db=network.lock_sinr_db,
        cca_threshold_dbm=_USUAL.cca_threshold_dbm if isinstance(mac, Tdma) else mac.cca_threshold_dbm,
        cca=mac.cca if isinstance(mac, CsmaCa) else _USUAL.cca,
        collision=network.collision,
        capture_db=network.capture_db,
    )


def mac_family(network: NetworkParams) -> MacFamily:
    """Return the medium access of all nodes, and the physical layer below it."""
    mac = network.mac
    if isinstance(mac, Dcf):
        return DcfFamily(DcfConfig(**mac.values()))
    if isinstance(mac, Tdma):
        return TdmaFamily(TdmaConfig(**mac.values()))
    if isinstance(mac, Lpl):
        return LplFamily(LplConfig(**mac.values()))
    return CsmaCaFamily(
        CsmaCaConfig(
            min_be=mac.min_be,
            max_be=mac.max_be,
            max_csma_backoffs=mac.max_csma_backoffs,
            max_frame_retries=mac.max_frame_retries,
            max_channel_retries=mac.max_channel_retries,
        )
    )


def link_config(network: NetworkParams) -> LinkConfig:
    """Return queues, fragments and headers of all nodes."""
    return LinkConfig(
        mesh_header_bytes=network.mesh_header_bytes,
        queue_frames=network.mac.queue_frames,
        outbox_datagrams=network.mac.outbox_datagrams,
        queue_policy=network.queue_policy,
        reassembly_timeout_s=network.reassembly_timeout_s,
    )


def channel_bps(network: NetworkParams) -> float | None:
    """Return what the radio channel carries when it is never idle [bit/s]; None for an ideal network."""
    return None if network.standard == "ideal" else mac_family(network).phy.bit_rate_bps


def most_attempts(network: NetworkParams) -> int:
    """Return how often a frame is sent at most, the first time included; of low-power listening a train."""
    mac = network.mac
    return mac.retry_limit if isinstance(mac, Dcf) else 1 + mac.max_frame_retries


def most_sent_bytes(network: NetworkParams, mpdu_bytes: int) -> int:
    """Return what a node sends at most to get a frame to its neighbour, and one acknowledgement [B].

    Parameters
    ----------
    mpdu_bytes : length of the frame, frame check sequence included [B]
    """
    mac, copies = network.mac, 1
    if isinstance(mac, Lpl):
        # as long as every receiver takes to look: an interval, its start-up, and two copies more
        copies = 3 - (-(to_ns(mac.wake_interval_s) + START_UP_NS) // step_ns(mpdu_bytes))
    return most_attempts(network) * copies * mpdu_bytes + mac_family(network).ack_bytes
