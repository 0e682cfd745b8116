"""Writes the page of maps: what cameras see and how far radios reach, before any run."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from markupsafe import Markup

from wsnsim.geometry.camera import PinholeCamera
from wsnsim.report.document import SCRIPTS, asset, figure_json, policy, template
from wsnsim.report.mapfigures import links_figure, plan_ends, seen_by_figure, share_figure
from wsnsim.report.wording import number, percent, plural, with_unit
from wsnsim.sim.maps import Coverage, Grid, Links, Maps, Reach
from wsnsim.store.folder import write_text
from wsnsim.world.world import World


@dataclass(frozen=True, eq=False)
class MapsContext:
    """A scenario that has not run, as the page of maps sees it.

    Parameters
    ----------
    name : of the scenario
    seed : of the run that it would be
    ideal : whether its network is
    world : of the scenario
    cameras : by the node that carries each
    maps : views and links
    """

    name: str
    seed: int
    ideal: bool
    world: World
    cameras: Mapping[str, PinholeCamera]
    maps: Maps


def write_maps(path: Path, context: MapsContext) -> None:
    """Write the page; the same context gives the same bytes.

    Raises
    ------
    OutputError : the file cannot be written
    """
    write_text(path, render_maps(context))


def render_maps(context: MapsContext) -> str:
    """Return the page as HTML."""
    scripts = [asset(name) for name in SCRIPTS]
    coverage, links, reach = context.maps.coverage, context.maps.links, context.maps.reach
    return template("maps.html.j2").render(
        name=context.name,
        facts=_facts(context),
        seen_words=seen_words(coverage),
        share_words=_share_words(coverage),
        links_words=_links_words(context),
        reach_words=_reach_words(reach),
        camera_rows=_camera_rows(coverage),
        link_rows=_link_rows(links),
        plan_aspect=_aspect(coverage.grid),
        links_aspect=_aspect(reach.grid),
        figures={
            "seen": figure_json(seen_by_figure(coverage, context.cameras, context.world)),
            "share": figure_json(share_figure(coverage, context.cameras, context.world)),
            "links": figure_json(links_figure(links, reach, context.world)),
        },
        scripts=[Markup(script) for script in scripts],
        style=Markup(asset("page.css")),
        licence=asset("LICENSE-plotly.js"),
        policy=policy(scripts),
    )


def map_figures(maps: Maps) -> dict[str, object]:
    """Return the figures of the maps as plain data, keys with units."""
    coverage, links = maps.coverage, maps.links
    return {
        "height_m": round(coverage.grid.height_m, 6),
        "seen_by": _seen_by(coverage),
        "cameras": [
            {
                "camera": name,
                "floor_share": coverage.floor_share(coverage.seen[at]),
                "pixel_share_largest": float(coverage.shares[at].max()),
            }
            for at, name in enumerate(coverage.cameras)
        ],
        "pixel_share_target": coverage.target,
        "weakest_usable_dbm": links.weakest_dbm,
        "links": [
            {
                "one": links.nodes[one],
                "other": links.nodes[other],
                "distance_m": float(links.distance_m[one, other]),
                "power_there_dbm": _finite(links.power_dbm[one, other]),
                "power_back_dbm": _finite(links.power_dbm[other, one]),
                "margin_db": _finite(links.margin_db[one, other]),
                "in_tree": links.in_tree(links.nodes[one], links.nodes[other]),
            }
            for one, other in zip(*(at.tolist() for at in np.triu_indices(len(links.nodes), 1)), strict=True)
        ],
    }


def _finite(value: float) -> float | None:
    """Return a number that JSON can hold, or nothing: where a file of links has none between two nodes."""
    return float(value) if np.isfinite(value) else None


def seen_words(coverage: Coverage) -> str:
    """Return how much of the floor is seen by how many cameras."""
    none, one, two, more = (percent(share) for share in _seen_by(coverage).values())
    return (
        f"At a height of {number(coverage.grid.height_m)} m, {none} of the floor is seen by no camera, "
        f"{one} by one, {two} by two, and {more} by three or more."
    )


def _seen_by(coverage: Coverage) -> dict[str, float]:
    counts = coverage.seen_by
    return {
        "none": coverage.floor_share(counts == 0),
        "one": coverage.floor_share(counts == 1),
        "two": coverage.floor_share(counts == 2),
        "three_or_more": coverage.floor_share(counts >= 3),
    }


def _facts(context: MapsContext) -> str:
    links = context.maps.links
    width, depth, _ = context.world.size_m.tolist()
    return (
        f"{plural(len(context.cameras), 'camera')} and {plural(len(links.nodes), 'node')} in all, in a world "
        f"of {number(width)} × {number(depth)} m, seed {context.seed}. Nothing was run."
    )


def _share_words(coverage: Coverage) -> str:
    seen = coverage.seen_by > 0
    if not seen.any():
        return "No camera sees any of it."
    largest = coverage.largest_share
    median, enough = float(np.median(largest[seen])), coverage.floor_share(largest >= 0.01)
    return (
        f"A target of the size of “{coverage.target}” would take {percent(median)} of "
        "an image at the median of the places that are seen, counted in the camera that shows it largest; it "
        f"would take 1 % or more on {percent(enough)} of the floor."
    )


def _links_words(context: MapsContext) -> str:
    links = context.maps.links
    ones, others = np.triu_indices(len(links.nodes), 1)
    usable = int((links.margin_db[ones, others] >= 0.0).sum())
    weakest = min(_tree_margins(links))
    ideal = (
        "The network of this scenario is ideal: the links are those that its radio settings would make, and "
        "hops are counted along the same tree. "
        if context.ideal
        else ""
    )
    return (
        f"{ideal}A link is usable where {links.weakest_dbm:.1f} dBm arrive in both directions: "
        f"{percent(links.success)} or more of the longest frames (127 bytes) get through then, if nobody "
        f"else sends. Of {plural(len(ones), 'pair')} of nodes, such a link joins {usable}. The weakest link "
        f"of the routing tree has a margin of {with_unit(weakest, 'dB')}; the tree is "
        f"{plural(links.tree.height, 'hop')} high."
    )


def _reach_words(reach: Reach) -> str:
    if np.isneginf(reach.margin_db).all():
        return "Links come from a file, which says nothing of those that one more mote would have."
    beyond = float((reach.margin_db < 0.0).mean())
    bare = "Another mote would have a usable link anywhere on this map."
    if beyond > 0.0:
        bare = f"On {percent(beyond)} of this map another mote would have none: the ground there is bare."
    return (
        "The ground shows the margin that one more mote, as high as the others are on average, would have to "
        f"the node that it hears best, by distance alone. {bare}"
    )


def _tree_margins(links: Links) -> list[float]:
    at = {node: number_ for number_, node in enumerate(links.nodes)}
    return [
        float(links.margin_db[at[node], at[parent]])
        for node, parent in links.tree.parent.items()
        if parent is not None
    ]


def _camera_rows(coverage: Coverage) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for name, seen, shares in zip(coverage.cameras, coverage.seen, coverage.shares, strict=True):
        mean = float(shares[seen].mean()) if seen.any() else None
        rows.append((name, percent(coverage.floor_share(seen)), percent(mean), percent(float(shares.max()))))
    return rows


def _link_rows(links: Links) -> list[tuple[str, ...]]:
    at = {node: number_ for number_, node in enumerate(links.nodes)}
    rows: list[tuple[str, ...]] = []
    for node, parent in links.tree.parent.items():
        if parent is None:
            continue
        one, other = at[node], at[parent]
        etx = float(links.etx[one, other])
        rows.append(
            (
                node,
                f"{parent} ({links.tree.depth[node]})",
                with_unit(float(links.distance_m[one, other]), "m"),
                f"{links.power_dbm[one, other]:.1f} dBm",
                f"{links.power_dbm[other, one]:.1f} dBm",
                f"{links.margin_db[one, other]:.1f} dB",
                number(etx) if np.isfinite(etx) else "–",
            )
        )
    return rows


def _aspect(grid: Grid) -> float:
    (left, right), (bottom, top) = plan_ends(grid)
    return (top - bottom) / (right - left)
