"""Canonical order of the joints and links of many linkages: equal graphs become equal rows.

Colours of joints and links are refined by those of their neighbours (Weisfeiler and Leman); where
joints share a colour the first of them gets one of its own, and all are refined again. Two equal
graphs could be missed only where that choice matters and the refinement does not show it: then
they are planned twice, and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbody.topologies.arrays import LinkageArrays

__all__ = ["CanonicalOrder", "canonical_order", "row_bytes"]

Words = np.ndarray


@dataclass(frozen=True, eq=False)
class CanonicalOrder:
    """The order of each linkage.

    Attributes
    ----------
    joints : array (linkages, joints)
        Joint of the description at each canonical place; those that are not there are last.
    links : array (linkages, links)
    places : array (linkages, links, places)
        Place of the description at each canonical place of each canonical link.
    slides : array (linkages, slides)
    table : array (linkages, numbers)
        The graph in that order; equal rows are equal topologies.
    """

    joints: np.ndarray
    links: np.ndarray
    places: np.ndarray
    slides: np.ndarray
    table: np.ndarray


def canonical_order(made: LinkageArrays) -> CanonicalOrder:
    """The canonical order of every linkage; those of one numbering are ordered once."""
    count = len(made)
    parts = [made.links, made.ground, made.driver, made.slides]
    rows = np.concatenate([part.reshape(count, -1) for part in parts], axis=1)
    _, first, number = np.unique(row_bytes(rows), return_index=True, return_inverse=True)
    found = _order(made.links[first], made.ground[first], made.driver[first], made.slides[first])
    return CanonicalOrder(*(part[number] for part in found))


def row_bytes(table: np.ndarray) -> np.ndarray:
    """Rows of a table as one number of many bytes each, to be compared."""
    table = np.ascontiguousarray(table)
    return table.view(np.dtype((np.void, table.itemsize * table.shape[1]))).reshape(-1)


def _order(
    described: np.ndarray, ground: np.ndarray, driver: np.ndarray, slides: np.ndarray
) -> tuple[np.ndarray, ...]:
    """The parts of a canonical order, of the parts of so many descriptions."""
    count, nodes = ground.shape
    bars, places = described.shape[1:]
    flat = described.reshape(count, -1)
    used = (flat >= 0) & (flat < nodes)
    at = np.where(used, flat, nodes)
    owner = np.repeat(np.arange(bars), places)
    slid = slides[..., 0]
    slid = np.where((slid >= 0) & (slid < nodes), slid, nodes)
    guide = np.where(slid < nodes, slides[..., 1], -1)
    guide = np.where((guide >= -1) & (guide < bars), guide, -1)
    there = np.zeros((count, nodes + 1), dtype=bool)
    np.put_along_axis(there, at, True, 1)
    there[:, nodes] = False
    fixed = np.zeros((count, nodes + 1), dtype=bool)
    fixed[:, :nodes] = ground & there[:, :nodes]
    whole = used.reshape(count, bars, places).any(axis=2)
    # by the number of its driver, from one on
    own_driver = np.zeros((count, bars), dtype=np.int64)
    for which in range(driver.shape[1]):
        driven = np.arange(bars) == driver[:, which, None]
        own_driver = np.where(driven, which + 1, own_driver)
    joint = _mixed(fixed.astype(np.uint64) + np.uint64(2) * there)
    joint[:, nodes] = 0
    link = _mixed(own_driver.astype(np.uint64) + np.uint64(2) * whole + np.uint64(7))
    # those in which joints may still share a colour
    open_rows = np.arange(count)
    while open_rows.size:
        n = open_rows
        fresh, finer = _refined(joint[n], link[n], at[n], slid[n], guide[n], owner)
        joint[n], link[n] = fresh, finer
        order = np.argsort(fresh[:, :nodes], axis=1, kind="stable")
        ranked = np.take_along_axis(fresh[:, :nodes], order, axis=1)
        same = ranked[:, 1:] == ranked[:, :-1]
        same &= np.take_along_axis(there[open_rows], order[:, 1:], axis=1)
        tied = np.flatnonzero(same.any(axis=1))
        if not tied.size:
            break
        # the first of joints that share a colour gets one of its own
        first = order[tied, same[tied].argmax(axis=1)]
        open_rows = open_rows[tied]
        joint[open_rows, first] = _mixed(joint[open_rows, first] + np.uint64(99))
    joint_order = np.lexsort((joint[:, :nodes], ~there[:, :nodes]))
    link_order = np.lexsort((link, ~whole))
    slide_key = _slide_colours(joint, link, slid, guide)
    slide_order = np.lexsort((slide_key, slid == nodes))
    place = _inverse(joint_order, nodes)
    new_link = _inverse(link_order, bars)
    links = np.where(used, np.take_along_axis(place, np.where(used, flat, 0), axis=1), nodes)
    links = links.reshape(count, bars, places)
    links = np.take_along_axis(links, link_order[:, :, None], axis=1)
    place_order = np.argsort(links, axis=2, kind="stable")
    links = np.take_along_axis(links, place_order, axis=2)
    own = np.where(slid < nodes, np.take_along_axis(place, np.minimum(slid, nodes - 1), axis=1), -1)
    on = np.where(guide >= 0, np.take_along_axis(new_link, np.maximum(guide, 0), axis=1), -1)
    table = np.concatenate(
        [
            np.where(links == nodes, -1, links).reshape(count, -1),
            np.take_along_axis(fixed, joint_order, axis=1),
            np.where(
                driver < 0, -1, np.take_along_axis(new_link, np.clip(driver, 0, bars - 1), axis=1)
            ),
            np.take_along_axis(own, slide_order, axis=1),
            np.take_along_axis(on, slide_order, axis=1),
        ],
        axis=1,
    ).astype(np.int16)
    return joint_order, link_order, place_order, slide_order, table


def _refined(
    joint: Words,
    link: Words,
    at: np.ndarray,
    slid: np.ndarray,
    guide: np.ndarray,
    owner: np.ndarray,
) -> tuple[Words, Words]:
    """Colours by those of all neighbours, as often as a graph of so many joints is wide."""
    count, nodes, bars = len(joint), joint.shape[1] - 1, link.shape[1]
    places, row = at.shape[1] // bars, np.arange(count)[:, None]
    for _ in range(nodes // 2 + 1):
        own = (_mixed(joint[row, at]) * (at < nodes)).reshape(count, bars, places)
        link = _mixed(link + np.uint64(3) * own.sum(axis=2, dtype=np.uint64))
        grown = joint.copy()
        np.add.at(grown, (row, at), _mixed(link[:, owner] + np.uint64(5)))
        if slid.shape[1]:
            key = _slide_colours(joint, link, slid, guide)
            np.add.at(grown, (row, slid), key)
            on = np.zeros((count, bars + 1), dtype=np.uint64)
            np.add.at(on, (row, np.where(guide >= 0, guide, bars)), key)
            link = _mixed(link + on[:, :bars])
        grown[:, nodes] = 0
        joint = _mixed(grown)
        joint[:, nodes] = 0
    return joint, link


def _slide_colours(joint: Words, link: Words, slid: np.ndarray, guide: np.ndarray) -> Words:
    """Colours of slides by their joints and the links that they are on."""
    row = np.arange(len(joint))[:, None]
    on = np.where(guide >= 0, link[row, np.maximum(guide, 0)], np.uint64(11))
    return _mixed(joint[row, slid] + np.uint64(13) * _mixed(on))


def _mixed(words: np.ndarray) -> Words:
    """Words that look like chance (the finisher of SplitMix64, Steele, Lea & Flood 2014)."""
    z = words.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _inverse(order: np.ndarray, size: int) -> np.ndarray:
    """Where each number of permutations (linkages, size) is."""
    found = np.empty_like(order)
    np.put_along_axis(found, order, np.broadcast_to(np.arange(size), order.shape), 1)
    return found
