"""Numbers as people read them."""

import math

import pytest

from wsnsim.report.wording import count, duration, length, listed, number, percent, plural, quantity

THIN = "\u202f"


def plain(text):
    return text.replace(THIN, " ")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1_026_560.0, "1.03 Mbit/s"),
        (250_000, "250 kbit/s"),
        (999.6, "1.00 kbit/s"),
        (999.4, "999 bit/s"),
        (0.0, "0 bit/s"),
        (None, "–"),
        (math.nan, "–"),
    ],
)
def test_quantities(value, text):
    assert plain(quantity(value, "bit/s")) == text


def test_small_quantities():
    assert plain(quantity(195.4e-6, "J")) == "195 µJ"
    assert plain(quantity(3e-12, "J")) == "0.00300 nJ"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.99996, "1.00"), (12_345.6, "12 346"), (0.00123456, "0.00123"), (-4.5678, "-4.57"), (0, "0")],
)
def test_numbers(value, text):
    assert plain(number(value)) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0 %"),
        (1.0, "100 %"),
        (0.9999, "more than 99.9 %"),
        (0.0001, "less than 0.1 %"),
        (0.034, "3.4 %"),
        (0.5, "50.0 %"),
        (None, "–"),
    ],
)
def test_percentages_never_round_to_all_or_nothing(value, text):
    assert plain(percent(value)) == text


def test_lengths_and_durations():
    assert plain(length(0.0493)) == "4.93 cm"
    assert plain(length(1.6)) == "1.60 m"
    assert plain(length(None)) == "–"
    assert plain(duration(0.21)) == "210 ms"
    assert plain(duration(3.842 * 86_400)) == "3.84 days"
    assert plain(duration(119.0)) == "119 s"
    assert plain(duration(7200.0)) == "2.00 hours"


def test_counts_and_lists():
    assert plain(count(1_234_567)) == "1 234 567"
    assert plain(plural(1, "step")) == "1 step"
    assert plain(plural(36, "step")) == "36 steps"
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(list("abcdefg")) == "a, b, c, d, e and 2 more"
