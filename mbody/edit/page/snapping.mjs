// Where the pointer snaps: points, lines, levels of points, angles, the grid. Places of the world.

import { DEG } from "./viewer/elements.mjs";

export const away = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
const clean = (xy) => xy.map((v) => +v.toPrecision(12) + 0);

/** The point of a list [[pin, place], …] that is nearest to a place, if within a length. */
export function nearest(points, to, within) {
  let best = null, least = within;
  for (const [pin, at] of points) { const long = away(at, to); if (long < least) [best, least] = [pin, long]; }
  return best;
}
/** The place of a segment that is nearest to another place, with their distance. */
function onSegment([a, b], to) {
  const dx = b[0] - a[0], dy = b[1] - a[1], size = dx * dx + dy * dy || 1;
  const t = Math.min(1, Math.max(0, ((to[0] - a[0]) * dx + (to[1] - a[1]) * dy) / size)), at = [a[0] + t * dx, a[1] + t * dy];
  return [at, away(at, to)];
}
/** Where a place snaps: {xy, pin, line, guides}.
    `points`: [[pin, place], …]; `lines`: [[body, [place, place]], …]; `from`: where what is drawn begins, or null;
    `near`: length within which it snaps; `grid`: its step; `angles`: 15° about `from`; `free`: not at all. */
export function snapped(raw, { points, lines, from, near, grid, angles, free }) {
  const pin = nearest(points, raw, near);
  if (pin) return { pin, xy: points.find(([one]) => one === pin)[1], line: null, guides: [] };
  if (free) return { pin: null, xy: clean(raw), line: null, guides: [] };
  if (angles && from) {
    const long = away(raw, from), angle = Math.round(Math.atan2(raw[1] - from[1], raw[0] - from[0]) / (15 * DEG)) * 15 * DEG;
    const xy = [from[0] + long * Math.cos(angle), from[1] + long * Math.sin(angle)];
    return { pin: null, xy: clean(xy), line: null, guides: [[from, xy]] };
  }
  const onGrid = raw.map((v) => Math.round(v / grid) * grid);
  let line = null, least = 0.6 * near, onLine = null;
  for (const [body, ends] of lines) {
    const [, long] = onSegment(ends, raw); // on the line, beside the nearest place of the grid
    if (long < least) [line, least, onLine] = [body, long, onSegment(ends, onGrid)[0]];
  }
  if (line) return { pin: null, xy: clean(onLine), line, guides: [] };
  // level with a point that is off the grid, else on the grid
  const xy = [...onGrid], guides = [];
  for (const i of [0, 1]) {
    let best = Math.min(0.35 * near, Math.abs(raw[i] - xy[i]));
    for (const [, at] of points) if (Math.abs(at[i] - raw[i]) < best) { best = Math.abs(at[i] - raw[i]); xy[i] = at[i]; guides[i] = at; }
  }
  return { pin: null, xy: clean(xy), line: null, guides: guides.filter(Boolean).map((at) => [at, xy]) };
}
/** A direction in whole steps of 5 degrees. */
export const direction = (a, b) => Math.round(Math.atan2(b[1] - a[1], b[0] - a[0]) / (5 * DEG)) * 5;
