"""Block fading: its distribution, its blocks, and frames that meet it on the air."""

import math

import numpy as np
import pytest
import simpy
from scipy.stats import binomtest, expon, kstest, ncx2

from wsnsim.kernels.fading import philox
from wsnsim.net.channel.channel import Channel
from wsnsim.net.channel.fading import BlockFading
from wsnsim.net.channel.links import Links
from wsnsim.net.clock import Clock
from wsnsim.net.config import RadioConfig
from wsnsim.net.phy.base import Transmission
from wsnsim.net.phy.ieee802154 import O_QPSK
from wsnsim.net.phy.medium import Medium
from wsnsim.rng import RandomStreams

BLOCK_NS = 20_000_000
ALPHA = 1e-3
RECEIVERS = np.arange(1, 101)


def fading(seed, k_ratio=0.0, coherence_ns=BLOCK_NS):
    return BlockFading(coherence_ns, k_ratio, RandomStreams(seed))


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        (0, 0, (0x6627E8D5, 0xE169C58D)),
        (0xFFFFFFFF, 0xFFFFFFFF, (0x408F276D, 0x41C83B0E)),
        (None, None, (0xD16CFE09, 0x94FDCCEB)),
    ],
)
def test_philox_gives_the_published_answers(counter, key, words):
    """Known answers of Random123, philox4x32 with 10 rounds."""
    pi = 0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0
    numbers = pi if counter is None else (counter,) * 4 + (key,) * 2
    assert philox(*(np.uint64(number) for number in numbers)) == words


@pytest.mark.parametrize("k_ratio", [0.0, 1.0, 10.0])
def test_power_gains_have_their_distribution_and_mean_one(k_ratio, test_seed):
    model = fading(test_seed, k_ratio)
    # two blocks apart, so that all are independent
    gains = np.concatenate([model.gains(0, RECEIVERS, 2 * block * BLOCK_NS) for block in range(200)])
    # |a + z|², a² = K / (1 + K), z complex normal with power 1 / (1 + K): a non-central chi-square
    scale = 1.0 / (2.0 * (1.0 + k_ratio))
    law = expon() if k_ratio == 0.0 else ncx2(2, 2.0 * k_ratio, scale=scale)
    assert kstest(gains, law.cdf).pvalue > ALPHA
    variance = (1.0 + 2.0 * k_ratio) / (1.0 + k_ratio) ** 2
    assert abs(gains.mean() - 1.0) < 3.3 * math.sqrt(variance / len(gains))


def test_both_directions_fade_alike_and_a_row_is_what_each_link_is():
    model = fading(1)
    row = model.gains(5, np.array([2, 9, 70_000]), 123)
    for gain, other in zip(row, (2, 9, 70_000), strict=True):
        assert model.gains(other, np.array([5]), 123)[0] == gain
        assert model.gains(5, np.array([other]), 123)[0] == gain
    assert len(set(row)) == 3


def test_a_gain_stays_for_a_block_and_not_longer():
    model = fading(2)
    times = np.arange(0, 40 * BLOCK_NS, BLOCK_NS // 8)
    gains = np.array([model.gains(0, RECEIVERS, int(time)) for time in times])
    changes = gains[1:] != gains[:-1]
    # every eighth step begins a block of a link, wherever its first one began
    for link in changes.T:
        (at,) = np.flatnonzero(link[:8])
        assert np.array_equal(np.flatnonzero(link), np.arange(at, len(link), 8))
    begins = [int(np.flatnonzero(link)[0]) for link in changes.T]
    # links begin their blocks at any of eight steps; that all did at the same would be no chance
    assert len(set(begins)) == 8


def test_blocks_and_links_are_independent(test_seed):
    model = fading(test_seed)
    gains = np.array([model.gains(0, RECEIVERS, block * BLOCK_NS) for block in range(300)])
    limit = 3.3 / math.sqrt(gains.size)
    centred = gains - 1.0
    # variance 1 each: means of products of independent ones have a standard error of 1 / sqrt(n)
    assert abs((centred[1:] * centred[:-1]).mean()) < limit * 1.01
    assert abs((centred[:, 1:] * centred[:, :-1]).mean()) < limit * 1.01


def test_the_seed_decides_and_nothing_else():
    first, again = fading(3), fading(3)
    times = [7, 10**12, 3 * BLOCK_NS]
    late = [first.gains(1, RECEIVERS, time).tolist() for time in times]
    assert late[::-1] == [again.gains(1, RECEIVERS, time).tolist() for time in times[::-1]]
    assert fading(4).gains(1, RECEIVERS, 7).tolist() != late[0]


def test_numbers_out_of_range_are_refused():
    with pytest.raises(ValueError, match=r"coherence_ns: must be positive, got 0 \[ns\]"):
        fading(0, coherence_ns=0)
    with pytest.raises(ValueError, match="k_ratio: must be 0 or more, got -1"):
        fading(0, -1.0)


class Ear:
    awaits_ack = False

    def __init__(self, log):
        self.log = log

    def received(self, transmission):
        self.log.append(transmission.start_ns)

    def sent(self, transmission):
        pass


def test_frames_below_the_sensitivity_are_lost_as_often_as_power_fades(test_seed):
    """Over a margin of m dB a Rayleigh link is out for 1 - exp(-10^(-m/10)) of the time."""
    margin_db, frames = 3.0, 2000
    env = simpy.Environment()
    clock, got = Clock(env), []
    config = RadioConfig(sensitivity_dbm=-80.0, noise_dbm=-107.0)
    links = Links.from_matrix(np.full((2, 2), config.sensitivity_dbm + margin_db))
    medium = Medium(clock, O_QPSK, config, Channel(links, fading(test_seed)))
    radios = [medium.add(np.random.default_rng(at), Ear(got)) for at in range(2)]

    def send(left):
        medium.turn(radios[0])
        medium.transmit(Transmission(0, bytes(20), 1, (1,), "data"))
        if left > 1:
            clock.call(2 * BLOCK_NS, lambda: send(left - 1))

    clock.call(0, lambda: send(frames))
    env.run()
    expected = math.exp(-(10.0 ** (-margin_db / 10.0)))
    assert binomtest(len(got), frames, expected).pvalue > ALPHA
