// Names in a picture: how they are written, and where they cover least.

import { clamp, sv } from "./elements.mjs";

/** Write parts (text, "" or "sub") into an element of SVG. */
export function write(text, runs) {
  let sub = false;
  for (const [part, how] of runs) {
    const span = sv("tspan", how ? { class: "sub", dy: "4" } : sub ? { dy: "-4" } : {});
    span.textContent = part;
    text.append(span);
    sub = Boolean(how);
  }
  return text;
}
// Places and costs of labels: the twin of `mbody/views/labels.py`, which places those of paper and
// films; a test runs both on the same data.

/** Directions of a label from a point, and rings of them. */
const AROUND = 24, RINGS = 7;
/** Costs: on a line of its own height, on another label as a whole, of another place than before, cut off. */
const ON_LINE = 3, ON_LABEL = 200, MOVED = 0.5, CUT = 3;
/** Weights of arrows and pins, and of outlines. */
export const ARROW_WEIGHT = 0.3, OUTLINE_WEIGHT = 0.1;
/** Part of a label that others may cover before it is hidden, and before it is shown again. */
const COVERED = 0.25, CLEAR = 0.1;

/** From the middle of a label, w and h half its size, to its edge in a direction. */
const toEdge = (w, h, u, v) => Math.min(w / Math.max(Math.abs(u), 1e-9), h / Math.max(Math.abs(v), 1e-9));
/** Places [x, y, cost] around a point, best in the direction (u, v). */
export function around(x, y, u, v, gap, w, h, cost = 1) {
  const found = [], wanted = Math.atan2(v, u);
  for (let ring = 0; ring < RINGS; ring++) for (let n = 0; n < AROUND; n++) {
    const angle = wanted + 2 * Math.PI * n / AROUND, c = Math.cos(angle), s = Math.sin(angle), away = gap * (1 + 0.9 * ring) + toEdge(w, h, c, s);
    found.push([x + away * c, y + away * s, cost * 0.5 * (1 - Math.cos(angle - wanted)) + 1.2 * ring]);
  }
  return found;
}
/** Beside an edge, on the side of its normal (u, v) or the other, and along it. */
export function alongside(x, y, u, v, gap, w, h) {
  const found = [], away = gap + w * Math.abs(u) + h * Math.abs(v), slide = 2 * (w * Math.abs(v) + h * Math.abs(u));
  for (const side of [1, -1]) for (const part of [0, 0.5, -0.5, 1, -1]) {
    found.push([x + side * away * u + part * slide * v, y + side * away * v - part * slide * u, (side < 0 ? 0.6 : 0) + 0.5 * Math.abs(part)]);
  }
  return found;
}
/** On a plate, or somewhat aside. */
export function within(x, y, w, h) {
  return [[x, y, 0], ...[[0, 2.2], [0, -2.2], [1.4, 0], [-1.4, 0]].map(([a, b]) => [x + a * w, y + b * h, 0.5])];
}
/** At the tip of an arrow, or beside its shaft. */
export function atArrow({ x0, y0, dx, dy, long }, w, h) {
  const u = dx / long, v = dy / long, clear = toEdge(w, h, u, v), found = [];
  for (const [more, cost] of [[4, 0], [17, 0.7]]) found.push([x0 + dx + (more + clear) * u, y0 + dy + (more + clear) * v, cost]);
  for (const [more, cost] of [[4, 0.4], [15, 0.6]]) for (const part of [0.9, 0.55]) for (const side of [1, -1]) {
    const aside = side * (more + w * Math.abs(v) + h * Math.abs(u));
    found.push([x0 + part * dx - aside * v, y0 + part * dy + aside * u, cost + 0.3 * (1 - part)]);
  }
  return found;
}
/** Obstacles, and labels that are put one after another where they cover least. */
export class FreePlaces {
  /** In a picture so wide and tall, in pixels; `all` are shown, even those that cover others. */
  constructor(wide, tall, all = false) { Object.assign(this, { wide, tall, all }); }
  /** Lines: ends, half the width, weight. */
  strokes = [];
  /** Labels: middle, half the size. */
  boxes = [];
  /** Add a line as an obstacle, `half` its width. */
  stroke(ax, ay, bx, by, half, weight = 1) { this.strokes.push(ax, ay, bx, by, half, weight); }
  /** Add a closed outline [x, y, x, y, …]. */
  outline(p, weight = OUTLINE_WEIGHT) {
    for (let k = 0, n = p.length; k < n; k += 2) this.stroke(p[k], p[k + 1], p[(k + 2) % n], p[(k + 3) % n], 0.5, weight);
  }
  /** The place of least cost, and how much of it other labels cover; `last` is the place before. */
  best(spots, w, h, last = -1) {
    const { strokes, boxes } = this;
    let least = Infinity, best = 0, covered = 0;
    for (let n = 0; n < spots.length; n++) {
      const [x, y] = spots[n];
      // another place than before must be clearly better, or names would jump to and fro
      let cost = spots[n][2] + (n === last || last < 0 ? 0 : MOVED), over = 0;
      if (x < w || y < h || x > this.wide - w || y > this.tall - h) cost += CUT;
      for (let k = 0; k < boxes.length && cost < least + 1e-6; k += 4) {
        const wide = Math.min(x + w, boxes[k] + boxes[k + 2]) - Math.max(x - w, boxes[k] - boxes[k + 2]);
        const tall = Math.min(y + h, boxes[k + 1] + boxes[k + 3]) - Math.max(y - h, boxes[k + 1] - boxes[k + 3]);
        // of the smaller of the two: a long text may not hide a short one
        if (wide > 0 && tall > 0) { const part = wide * tall / (4 * Math.min(w * h, boxes[k + 2] * boxes[k + 3])); over += part; cost += ON_LABEL * part; }
      }
      for (let k = 0; k < strokes.length && cost < least + 1e-6; k += 6) cost += strokes[k + 5] * ON_LINE * inside(strokes, k, x, y, w, h) / (2 * h);
      cost = Math.round(cost * 1e6) / 1e6;
      if (cost < least) { least = cost; best = n; covered = over; }
    }
    return [best, covered];
  }
  /** Put a name {text, wide, spot, hidden} at one of its places [x, y, cost]. */
  put(label, spots) {
    const w = 0.5 * label.wide + 1, h = 7, [best, covered] = this.best(spots, w, h, label.spot);
    const [x, y] = this.all ? [clamp(spots[best][0], w, this.wide - w), clamp(spots[best][1], h, this.tall - h)] : spots[best];
    const hidden = !this.all && covered > (label.hidden ? CLEAR : COVERED);
    label.spot = best;
    if (label.hidden !== hidden) { label.hidden = hidden; label.text.style.visibility = hidden ? "hidden" : ""; }
    if (hidden) return; // the mouse still names what it is of
    this.boxes.push(x, y, w, h);
    label.text.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
  }
}
/** How much of a line lies within a label (Liang and Barsky 1984). */
function inside(strokes, k, x, y, w, h) {
  const ax = strokes[k], ay = strokes[k + 1], dx = strokes[k + 2] - ax, dy = strokes[k + 3] - ay, half = strokes[k + 4];
  let enter = 0, leave = 1;
  for (const [from, along, size] of [[ax - x, dx, w + half], [ay - y, dy, h + half]]) {
    if (Math.abs(along) < 1e-300) { if (Math.abs(from) > size) return 0; continue; }
    const a = (-size - from) / along, b = (size - from) / along;
    enter = Math.max(enter, Math.min(a, b));
    leave = Math.min(leave, Math.max(a, b));
    if (enter >= leave) return 0;
  }
  // a line that is shorter than wide counts by its width
  return (leave - enter) * Math.max(Math.hypot(dx, dy), half);
}
