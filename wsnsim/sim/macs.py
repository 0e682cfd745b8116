"""Transceivers, medium access and queues of a run's nodes, from the scenario."""

from wsnsim.net.config import LinkConfig, RadioConfig
from wsnsim.net.mac.base import MacFamily
from wsnsim.net.mac.csma_ca import CsmaCaConfig, CsmaCaFamily
from wsnsim.scenario.schema_network import NetworkParams


def radio_config(network: NetworkParams) -> RadioConfig:
    """Return the transceivers of all nodes."""
    return RadioConfig(
        tx_power_dbm=network.tx_power_dbm,
        sensitivity_dbm=network.sensitivity_dbm,
        noise_dbm=network.noise_dbm,
        cca_threshold_dbm=network.mac.cca_threshold_dbm,
        collision=network.collision,
    )


def mac_family(network: NetworkParams) -> MacFamily:
    """Return the medium access of all nodes, and the physical layer below it."""
    mac = network.mac
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
        reassembly_timeout_s=network.reassembly_timeout_s,
    )


def channel_bps(network: NetworkParams) -> float | None:
    """Return what the radio channel carries when it is never idle [bit/s]; None for an ideal network."""
    return None if network.standard == "ideal" else mac_family(network).phy.bit_rate_bps
