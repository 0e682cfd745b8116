"""Times and errors of 802.11b: against the standard, other ways to the same integrals, and drawn signals."""

from itertools import pairwise, product
from math import exp, log

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ive
from scipy.stats import ncx2, norm

from wsnsim.net.phy.dsss import (
    biorthogonal_symbol_errors,
    cck_11_symbol_errors,
    cck_55_symbol_errors,
    dbpsk_bit_errors,
    dqpsk_bit_errors,
)
from wsnsim.net.phy.ieee80211b import RATES_MBPS, Ieee80211b, log_bit_success
from wsnsim.net.routing.linkquality import weakest_sinr


def ratio(decibels):
    return 10.0 ** (decibels / 10.0)


def test_an_acknowledgement_at_the_basic_rate_takes_304_microseconds():
    for rate, preamble in product(RATES_MBPS, ("long", "short")):
        assert Ieee80211b(rate, preamble).air_time_ns(14, 1) == 304_000
    assert Ieee80211b(11, "long", 2).air_time_ns(14, 1) == (192 + 56) * 1000
    assert Ieee80211b(11, "short", 2).air_time_ns(14, 1) == (96 + 56) * 1000


@pytest.mark.parametrize(
    ("rate", "microseconds"),
    [(1, 8 * 1064), (2, 4 * 1064), (5.5, 1548), (11, 774)],
)
def test_air_time_is_the_head_and_a_whole_number_of_microseconds(rate, microseconds):
    """8512 bits in 1547.6 and 773.8 µs."""
    assert Ieee80211b(rate).air_time_ns(1064) == (192 + microseconds) * 1000
    head = 192 if rate == 1 else 96
    assert Ieee80211b(rate, "short").air_time_ns(1064) == (head + microseconds) * 1000


def test_rates_that_802_11b_does_not_have():
    with pytest.raises(ValueError, match=r"rate_mbps: must be 1, 2, 5\.5 or 11, got 54"):
        Ieee80211b(54)
    with pytest.raises(ValueError, match="basic_rate_mbps: must be at most rate_mbps, got 2 and 1"):
        Ieee80211b(1, basic_rate_mbps=2)


@pytest.mark.parametrize("eb_n0", [0.0, 0.5, 2.0, 5.0, 10.0, 15.0, 25.0])
def test_dqpsk_against_marcums_function(eb_n0):
    """Proakis (4th ed.), eq. 5.2-70, with Marcum's Q as the tail of a non-central chi-square."""
    a2, b2 = (2 - 2**0.5) * eb_n0, (2 + 2**0.5) * eb_n0
    marcum = ncx2.sf(b2, 2, a2) if eb_n0 else 1.0
    bessel = ive(0, (a2 * b2) ** 0.5) * exp((a2 * b2) ** 0.5 - (a2 + b2) / 2)
    assert dqpsk_bit_errors(eb_n0) == pytest.approx(marcum - 0.5 * bessel, rel=1e-9)


@pytest.mark.parametrize("es_n0", [0.0, 0.1, 1.0, 5.0, 12.0, 20.0])
def test_biorthogonal_signals_against_the_integral_of_the_right_decisions(es_n0):
    mean = (2 * es_n0) ** 0.5

    def right(x):
        return (2 * norm.cdf(x + mean) - 1) ** 7 * norm.pdf(x)

    known = 1 - quad(right, -mean, np.inf, epsabs=1e-13)[0]
    assert biorthogonal_symbol_errors(es_n0) == pytest.approx(known, rel=1e-6)


def test_pure_noise_decides_by_chance():
    assert dbpsk_bit_errors(0.0) == 0.5
    assert cck_55_symbol_errors(0.0) == pytest.approx(15 / 16)
    assert cck_11_symbol_errors(0.0) == pytest.approx(255 / 256)


def drawn_psk_errors(rng, levels, es_n0, symbols):
    """Return the share of wrong bits of Gray-coded differential PSK, from noisy phases."""
    gray = np.array([0, 1]) if levels == 2 else np.array([0, 1, 3, 2])
    steps = rng.integers(levels, size=symbols)
    sent = np.exp(2j * np.pi * np.cumsum(np.r_[0, steps]) / levels)
    noise = rng.standard_normal((2, symbols + 1)) / np.sqrt(2 * es_n0)
    heard = sent + noise[0] + 1j * noise[1]
    turned = np.angle(heard[1:] * heard[:-1].conj())
    decided = np.round(turned * levels / (2 * np.pi)).astype(int) % levels
    wrong = np.bitwise_xor(gray[steps], gray[decided])
    return np.bitwise_count(wrong).sum() / (symbols * np.log2(levels))


@pytest.mark.parametrize(("levels", "es_n0"), [(2, 1.5), (2, 4.0), (4, 4.0), (4, 8.0)])
def test_differential_psk_against_drawn_signals(test_seed, levels, es_n0):
    symbols = 200_000
    share = drawn_psk_errors(np.random.default_rng((test_seed, levels)), levels, es_n0, symbols)
    known = dbpsk_bit_errors(es_n0) if levels == 2 else dqpsk_bit_errors(es_n0 / 2)
    # neighbours share a noisy symbol: twice the variance of independent bits is a safe measure
    assert abs(share - known) < 3.5 * np.sqrt(2 * known / symbols)


def cck_code(p1, p2, p3, p4):
    """Return the eight chips of IEEE Std 802.11-2007, sec. 18.4.6.6, eq. 18-1."""
    phases = [p1 + p2 + p3 + p4, p1 + p3 + p4, p1 + p2 + p4, p1 + p4, p1 + p2 + p3, p1 + p3, p1 + p2, p1]
    return np.exp(1j * np.array(phases)) * np.array([1, 1, 1, -1, 1, 1, -1, 1])


QUARTERS = np.arange(4) * np.pi / 2
CCK_11 = np.array([cck_code(*phases) for phases in product(QUARTERS, repeat=4)])
CCK_55 = np.array(
    [cck_code(p, d2 + np.pi / 2, 0, d3) for p in QUARTERS for d2 in (0, np.pi) for d3 in (0, np.pi)]
)


def drawn_cck_errors(rng, codes, es_n0, symbols):
    """Return the share of wrong symbols of the best decision between all code words."""
    sent = rng.integers(len(codes), size=symbols)
    words = np.hstack([codes.real, codes.imag])
    heard = words[sent] + rng.standard_normal((symbols, 16)) * np.sqrt(8 / es_n0 / 2)
    return np.mean((heard @ words.T).argmax(axis=1) != sent)


@pytest.mark.parametrize("es_n0_db", [3.0, 6.0, 9.0])
def test_cck_at_5_5_against_drawn_signals(test_seed, es_n0_db):
    symbols, es_n0 = 60_000, ratio(es_n0_db)
    share = drawn_cck_errors(np.random.default_rng((test_seed, 55)), CCK_55, es_n0, symbols)
    known = cck_55_symbol_errors(es_n0)
    assert abs(share - known) < 3.5 * np.sqrt(known * (1 - known) / symbols)


@pytest.mark.parametrize("es_n0_db", [9.0, 11.0])
def test_cck_at_11_is_at_most_a_sixth_better_than_its_formula(test_seed, es_n0_db):
    symbols, es_n0 = 30_000, ratio(es_n0_db)
    share = drawn_cck_errors(np.random.default_rng((test_seed, 11)), CCK_11, es_n0, symbols)
    known = cck_11_symbol_errors(es_n0)
    margin = 3.5 * np.sqrt(known * (1 - known) / symbols)
    assert known * 24 / 28 - margin < share < known + margin


def test_distances_of_the_code_words_are_those_the_formulas_stand_on():
    """Eight chips of energy 1: orthogonal words are 16 apart (squared), opposite ones 32."""

    def counted(codes):
        apart = np.round((np.abs(codes - codes[0]) ** 2).sum(axis=1))
        return dict(zip(*(each.tolist() for each in np.unique(apart, return_counts=True)), strict=True))

    assert counted(CCK_55) == {0: 1, 16: 14, 32: 1}
    assert counted(CCK_11)[8] == 24


@pytest.mark.parametrize(
    ("rate", "card_dbm", "tolerance_db"), [(1, -91, 1.2), (2, -88, 1.2), (5.5, -85, 1.2), (11, -82, 1.2)]
)
def test_sensitivity_at_the_default_noise_is_about_that_of_a_card(rate, card_dbm, tolerance_db):
    """As the standard defines it: 8 % of frames of 1024 B lost."""
    model_dbm = -89.0 + 10 * np.log10(weakest_sinr(Ieee80211b(rate), 1024, 0.92))
    assert model_dbm == pytest.approx(card_dbm, abs=tolerance_db)


def test_processing_gain_is_the_bandwidth_over_the_rate():
    sinr = ratio(-4.0)
    assert log_bit_success(1, sinr) == pytest.approx(np.log1p(-0.5 * exp(-22 * sinr)))
    assert log_bit_success(2, sinr) == pytest.approx(np.log1p(-dqpsk_bit_errors(11 * sinr)))
    # 16 times the SINR a symbol, less 3 dB
    assert log_bit_success(5.5, sinr) == pytest.approx(np.log1p(-cck_55_symbol_errors(8 * sinr)) / 4)
    assert log_bit_success(11, sinr) == pytest.approx(np.log1p(-cck_11_symbol_errors(8 * sinr)) / 8)


@pytest.mark.parametrize(("preamble", "heads"), [("long", [(1, 192)]), ("short", [(1, 72), (2, 24)])])
def test_head_and_data_have_their_own_rates(preamble, heads):
    sinr, phy = ratio(-1.0), Ieee80211b(11, preamble)
    expected = sum(rate * microseconds * log_bit_success(rate, sinr) for rate, microseconds in heads)
    expected += 11 * 100 * log_bit_success(11, sinr)
    end_ns = phy.head_ns() + 100_000
    assert phy.log_success(sinr, 0, end_ns) == pytest.approx(expected)
    # stretches add up, wherever they are cut
    cuts = [0, 30_000, 72_000, 90_000, 190_000, end_ns]
    parts = [phy.log_success(sinr, a, b) for a, b in pairwise(cuts)]
    assert sum(parts) == pytest.approx(expected)
    assert log(phy.frame_success(sinr, 137)) == pytest.approx(expected)


def test_the_basic_rate_reaches_farther_than_the_data():
    phy = Ieee80211b(11)
    sinr = ratio(0.0)
    assert phy.frame_success(sinr, 100, phy.control_mode) > 0.999
    assert phy.frame_success(sinr, 100) < 0.01
