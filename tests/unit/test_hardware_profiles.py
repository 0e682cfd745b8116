"""Profiles: figures that can be recomputed from the data sheets, and how they are looked up."""

import dataclasses
import math

import pytest

from wsnsim.hardware.profiles import BATTERIES, IMAGERS, PLATFORMS, RADIOS
from wsnsim.hardware.work import Work

CC2420 = RADIOS["cc2420"]
AIR_TIME_100_B_S = 3744e-6


def test_energy_of_a_100_byte_payload_matches_the_data_sheet_product():
    assert CC2420.transmit_w(0.0) * AIR_TIME_100_B_S == pytest.approx(195.4e-6, abs=0.05e-6)
    assert CC2420.receive_w * AIR_TIME_100_B_S == pytest.approx(211.2e-6, abs=0.05e-6)


@pytest.mark.parametrize(
    ("asked_dbm", "current_a"),
    [(0.0, 17.4e-3), (-1.0, 16.5e-3), (-2.0, 16.5e-3), (-3.1, 15.2e-3), (-25.0, 8.5e-3), (-40.0, 8.5e-3)],
)
def test_transmit_power_is_the_nearest_setting_not_below(asked_dbm, current_a):
    assert CC2420.transmit_w(asked_dbm) == pytest.approx(current_a * 3.0)


@pytest.mark.parametrize("asked_dbm", [0.1, math.nan])
def test_output_power_beyond_the_chip_is_refused_with_its_limit(asked_dbm):
    with pytest.raises(ValueError, match=r"cc2420: tx power must be at most 0 dBm, got (0\.1|nan) dBm"):
        CC2420.transmit_w(asked_dbm)


def test_imager_power_is_the_published_line_in_the_pixel_clock():
    imager = IMAGERS["cmos"]
    assert imager.active_w(24e6) == pytest.approx((13.1 + 5.1e-6 * 24e6) * 1e-3)
    assert imager.idle_w(24e6) == pytest.approx((4.4 + 3.35e-6 * 24e6) * 1e-3)
    assert imager.active_w() == imager.active_w(imager.pixel_clock_hz)
    assert imager.capture_seconds((320, 240), 24e6) == pytest.approx(3.2e-3)


def test_work_is_priced_by_kind_of_operation():
    telosb = PLATFORMS["telosb"]
    work = Work(int_ops=10, float_ops=3, memory_bytes=7)
    expected = 10 * telosb.cycles_per_int_op + 3 * telosb.cycles_per_float_op + 7 * telosb.cycles_per_byte
    assert telosb.cycles(work) == expected
    assert telosb.seconds(work) == expected / 4e6


@pytest.mark.parametrize("name", ["telosb", "imote2_104", "imote2_416"])
def test_processors_without_float_unit_pay_for_software_floats(name):
    platform = PLATFORMS[name]
    assert platform.cycles_per_float_op > 20 * platform.cycles_per_int_op


def test_telosb_module_draws_its_data_sheet_current_in_total():
    telosb = PLATFORMS["telosb"]
    assert telosb.cpu_active_w + telosb.board_w == pytest.approx(1.8e-3 * 3.0)
    assert telosb.cpu_idle_w + telosb.board_w == pytest.approx(54.5e-6 * 3.0)


@pytest.mark.parametrize("registry", [PLATFORMS, RADIOS, IMAGERS])
def test_every_profile_is_named_as_registered_and_cites_a_source(registry):
    for name, profile in registry.items():
        assert profile.name == name
        assert profile.source
        for field in dataclasses.fields(profile):
            value = getattr(profile, field.name)
            if isinstance(value, float):
                assert math.isfinite(value)
                assert value >= 0


def test_registries_cannot_be_changed():
    with pytest.raises(TypeError):
        PLATFORMS["mine"] = PLATFORMS["telosb"]


def test_battery_capacities():
    assert BATTERIES["two_aa"].capacity_j == 18_720
    assert BATTERIES["mains"].capacity_j is None


def test_the_80_mhz_processor_draws_its_data_sheet_current_by_the_megahertz():
    stm32 = PLATFORMS["stm32l476"]
    assert stm32.cpu_active_w == pytest.approx(100e-6 * 3.0 * 80)
    assert stm32.clock_hz == 80e6


def test_platforms_of_80_400_and_1000_mhz_do_the_same_work_ever_faster():
    """Histograms are whole numbers for the most part: the order is that of the clocks."""
    work = Work(int_ops=3e6, float_ops=1e4, memory_bytes=2e5)
    times = [PLATFORMS[name].seconds(work) for name in ("stm32l476", "imote2_416", "rpi_zero2w")]
    assert times == sorted(times, reverse=True)
    assert times[0] > 4 * times[1]
