"""The places of labels: one algorithm for paper and films, and its twin for pages."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import mbody.views.viewer
from mbody.views.labels import (
    FreePlaces,
    places_alongside,
    places_around,
    places_by_arrow,
    places_within,
)

NAMES = Path(next(iter(mbody.views.viewer.__path__))) / "names.mjs"
TWIN = """
import { readFileSync } from "node:fs";
const { FreePlaces, alongside, around, atArrow, within } = await import(process.argv[1]);
const said = JSON.parse(readFileSync(0)).map(({ x, y, u, v, gap, w, h, dx, dy, strokes, boxes, last }) => {
  const all = [around(x, y, u, v, gap, w, h, 0.7), alongside(x, y, u, v, gap, w, h), within(x, y, w, h),
    atArrow({ x0: x, y0: y, dx, dy, long: Math.hypot(dx, dy) }, w, h)];
  const places = new FreePlaces(400, 300);
  for (const one of strokes) places.stroke(...one);
  places.boxes.push(...boxes.flat());
  return all.map((spots) => [spots, places.best(spots, w, h, last)]);
});
console.log(JSON.stringify(said));
"""  # noqa: E501 a script


def cases():
    rng = np.random.default_rng(45)
    for n in range(60):
        angle = rng.uniform(0.0, 6.3)
        yield {
            **dict(zip("xy", rng.uniform((0, 0), (400, 300)).tolist(), strict=True)),
            **{"u": float(np.cos(angle)), "v": float(np.sin(angle)), "last": [-1, 0, 3][n % 3]},
            **dict(zip(("dx", "dy"), rng.normal(0, 60, 2).tolist(), strict=True)),
            **{"gap": float(rng.uniform(2, 20)), "w": float(rng.uniform(5, 40)), "h": 7.0},
            "strokes": [
                [*rng.uniform(0, 300, 4).tolist(), float(rng.uniform(0, 3)), 0.3] for _ in range(30)
            ]
            + [[*(2 * rng.uniform(0, 300, 2).tolist()), 4.0, 1.0] for _ in range(5)],
            "boxes": [
                [*rng.uniform(0, 300, 2).tolist(), *rng.uniform(5, 40, 2).tolist()]
                for _ in range(25)
            ],
        }


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_a_page_places_labels_as_paper_and_films_do():
    data = list(cases())
    found = subprocess.run(
        ["node", "--input-type=module", "-e", TWIN, str(NAMES)],
        input=json.dumps(data),
        capture_output=True,
        text=True,
        check=True,
    )
    covered = 0
    for one, there in zip(data, json.loads(found.stdout), strict=True):
        at, size = np.array([one["x"], one["y"]]), (2.0 * one["w"], 2.0 * one["h"])
        u, vector = np.array([one["u"], one["v"]]), np.array([one["dx"], one["dy"]])
        here = (
            places_around(at, size, one["gap"], float(np.arctan2(u[1], u[0])), 0.7),
            places_alongside(at, size, one["gap"], u),
            places_within(at, size),
            places_by_arrow(at, vector, size),
        )
        places = FreePlaces(1.0, (400.0, 300.0))
        places.strokes, places.boxes = (list(map(tuple, one[key])) for key in ("strokes", "boxes"))
        for spots, (others, (best, over)) in zip(here, there, strict=True):
            assert np.allclose(spots, others, rtol=0.0, atol=1e-9)
            found_here, _, covered_here = places.best(spots, *size, one["last"])
            assert found_here == best
            assert covered_here == pytest.approx(over, abs=1e-9)
            covered += over > 0.0
    assert covered > 20  # there was something to keep clear of


def test_a_label_keeps_clear_of_lines_labels_and_edges_where_there_is_room():
    places = FreePlaces(1.0, (100.0, 100.0))
    places.stroke(np.array([[50.0, 0.0], [50.0, 100.0]]), 1.0)
    places.occupy(30.0, 50.0, 20.0, 10.0)
    spots = [(50.0, 80.0, 0.0), (32.0, 50.0, 0.0), (2.0, 20.0, 0.0), (80.0, 50.0, 0.1)]
    best, cost, over = places.best(spots, 16.0, 8.0)
    assert (best, cost, over) == (3, 0.1, 0.0)
    assert (
        places.best(spots[:2], 16.0, 8.0)[0] == 0
    )  # rather on a line than on a name, which could not be read
