"""What the scan-line system refuses in a scenario: where it stands, what must hold, what to do."""

import runpy
from pathlib import Path

import pytest

import wsnsim
from wsnsim.cli.main import main

POST = runpy.run_path(str(Path(__file__).parents[1] / "scanline_post.py"))
DISC = "{kind: cylinder, semi_axes_m: [0.2, 0.2, 0.9]}"


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return POST["room"](tmp_path_factory.mktemp("room"))


def refused(room, *overrides):
    """Return what is said of a scenario that is refused."""
    with pytest.raises(wsnsim.ScenarioError) as error:
        wsnsim.run(room, overrides=("network.standard=ideal", *overrides))
    return str(error.value)


def block(x, y, width, depth):
    """Return an occluder in the room, as the scenario has it."""
    return f"world.occluders=[{{id: b, kind: box, centre_m: [{x}, {y}, 1], size_m: [{width}, {depth}, 2]}}]"


def virtual(corners):
    """Return a virtual block, as the scenario has it."""
    return f"system.virtual_occluders={{count: 2, blocks_m: [{corners}]}}"


@pytest.mark.parametrize(
    ("override", "where", "what"),
    [
        (block(4, 0, 1, 1), "cameras[0].position_m", "must be outside the occluders"),
        (block(4, 3, 8, 6), "world.crowd", "found no place for body 0"),
        (block(4, 3, 7.9, 5.9), "world.crowd", "found no place for body 0"),
        ("world.size_m=[1, 1, 3]", "world.crowd", "found no place for body"),
        (
            virtual("[[3, -1], [5, -1], [5, 1], [3, 1]]"),
            "cameras[0]",
            "outside virtual_occluders.blocks_m[0]",
        ),
        (virtual("[[1, 1], [2, 1], [1.2, 1.2], [1, 2]]"), "virtual_occluders.blocks_m[0]", "must be convex"),
        (virtual("[[1, 1], [2, 1]]"), "virtual_occluders.blocks_m[0]", "must be convex with an area"),
        (virtual("[[1, 1], [1, 1], [1, 1]]"), "virtual_occluders.blocks_m[0]", "must be convex with an area"),
        (virtual("[[9, 1], [10, 1], [10, 2]]"), "virtual_occluders.blocks_m[0]", "must reach into the room"),
        (
            virtual("[[1, 1], [7, 1], [7, 5], [1, 5]]"),
            "virtual_occluders.blocks_m[0]",
            "where the object walks",
        ),
        (virtual("[[0.1, 0.1], [7.9, 0.1], [7.9, 5.9], [0.1, 5.9]]"), "system.virtual_occluders", "no place"),
        (
            "system.virtual_occluders={count: 900, diameter_m: 1}",
            "system.virtual_occluders",
            "found no place",
        ),
        ("system.virtual_occluders={count: -1}", "system.virtual_occluders.count", "must be at least 0"),
        ("system.priors={kind: stationary, sd_m: 0}", "system.priors.sd_m", "must be greater than 0"),
        (
            "system.priors={kind: kalman, sensor_sd_m: 0}",
            "system.priors.sensor_sd_m",
            "must be greater than 0",
        ),
        ("system.priors={kind: gaussian}", "system.priors.kind", 'got "gaussian"'),
        ("cameras[c1].look_at_m=[4, 3, 0.5]", "cameras[0]", "must look level, within 5°"),
        ("system.deadline_s=0", "system.deadline_s", "must be at least 0.001, got 0"),
        ("system.deadline_s=.nan", "system.deadline_s", "must be"),
        ("system.detected=0", "system.detected", "must be greater than 0"),
        ("system.detected=1.2", "system.detected", "must be at most 1"),
        ("system.noise={read_sd_px: 0}", "system.noise.read_sd_px", "must be greater than 0"),
        ("system.walk.reached=[0.9, 0.3]", "system.walk.reached", "must be probabilities of sum 1 at most"),
        ("system.tracker.particles=9", "system.tracker.particles", "must be at least 10"),
        ("system.tracker={kind: extended, particles: 50}", "system.tracker.particles", "unknown key"),
        ("system.tracker.kind=kalman", "system.tracker.kind", 'got "kalman"'),
        ("system.message=jpeg", "system", "front_end must be of kind pixels"),
        ("system.head={kind: node}", "system.head.id", "must be given"),
        ("system.head={kind: node, id: c33}", "system.head.id", 'did you mean "c3"?'),
        (
            "system.head={kind: node, id: base}",
            "system.head.id",
            "for the base station write head: {kind: base}",
        ),
        ("system.head={kind: elected, period_s: 0}", "system.head.period_s", "must be at least 1"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_place_and_what_must_hold(room, override, where, what):
    # real people and virtual occluders do not mix
    nobody = ("world.people=[]",) if "virtual" in override else ()
    said = refused(room, override, *nobody)
    assert where in said
    assert what in said
    assert "room.yaml" in said or f"--set {override}" in said


@pytest.mark.parametrize("priors", ["hull", "scan_lines"])
def test_whole_lines_do_not_fit_into_a_bearing(room, priors):
    said = refused(room, "system.message=bearing", f"system.priors.kind={priors}")
    assert f"message must be scan_line, jpeg or null where priors are {priors}, got bearing" in said


@pytest.mark.parametrize("head", ["{kind: base}", "{kind: node, id: c1}"])
def test_a_head_waits_no_longer_than_frames_can_be_told_apart(room, head):
    said = refused(room, "system.deadline_s=20", f"system.head={head}")
    assert "system.deadline_s: must be at most 128 frame periods, 17.07 s, for frames" in said


@pytest.mark.parametrize("message", ["jpeg", "scan_line"])
def test_virtual_occluders_are_in_no_image(room, message):
    keys = ("system.front_end.kind=pixels", "system.virtual_occluders.count=3", f"system.message={message}")
    assert "virtual_occluders must be null where" in refused(room, *keys)


def test_one_object_is_tracked(room):
    object_ = f"{{id: %s, shape: {DISC}, motion: {{kind: crowd}}}}"
    said = refused(room, f"world.targets=[{object_ % 'a'}, {object_ % 'b'}]")
    assert "world.targets: must be one, the object, where the system is scanline, got 2" in said
    assert "let the others be people" in said


def test_as_many_cameras_as_a_mask_holds(room):
    lens = "look_at_m: [4, 3, 1.5], resolution_px: [32, 24], focal_px: 16, rate_hz: 7.5"
    cameras = ", ".join(f"{{id: k{k}, position_m: [{0.125 * k}, 0, 1.5], {lens}}}" for k in range(63))
    said = refused(room, f"cameras=[{cameras}]")
    assert "must be 1 to 62, got 63" in said


def test_the_command_line_tells_where_and_runs_nothing(room, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "out"
    keys = ["--set", "system.head={kind: node, id: c33}", "--out", str(folder)]
    monkeypatch.setattr("sys.argv", ["wsnsim", "run", str(room), *keys])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert "system.head.id: must be the name of a mote, got 'c33'; did you mean \"c3\"?" in said
    assert not folder.exists()


def test_real_and_virtual_occluders_do_not_mix(room):
    said = refused(room, "system.virtual_occluders.count=3")
    assert "must be null, or world.people nobody" in said
    assert "got 5 people" in said
