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
/** Points on a closed outline [x, y, x, y, …], about a step apart. */
export function dotted(p, step) {
  const found = [];
  for (let k = 0; k < p.length; k += 2) {
    const dx = p[(k + 2) % p.length] - p[k], dy = p[(k + 3) % p.length] - p[k + 1], count = Math.min(Math.floor(Math.hypot(dx, dy) / step), 60);
    for (let n = 0; n < count; n++) found.push(p[k] + (n + 0.5) / count * dx, p[k + 1] + (n + 0.5) / count * dy);
  }
  return found;
}
const TURNS = [0, 0.8, -0.8, 1.6, -1.6, 2.4, -2.4, Math.PI];
/** Places [x, y, cost] of a name around a point, best in the direction (u, v), then turned, then farther away. */
export function around(x, y, u, v, gap, w, h) {
  const found = [];
  for (const far of [0, 13]) for (const turn of TURNS) {
    const c = Math.cos(turn), s = Math.sin(turn), a = c * u - s * v, b = s * u + c * v;
    const reach = gap + far + Math.min(w / Math.max(Math.abs(a), 1e-9), h / Math.max(Math.abs(b), 1e-9));
    found.push([x + reach * a, y + reach * b, 0.6 * (1 - c) + (far ? 0.8 : 0)]);
  }
  return found;
}
/** Beside an edge, on this side or the other, and along it. */
export function alongside(x, y, u, v, gap, w, h) {
  const found = [], reach = gap + w * Math.abs(u) + h * Math.abs(v), slide = 2 * (w * Math.abs(v) + h * Math.abs(u));
  for (const side of [1, -1]) for (const part of [0, 0.5, -0.5, 1, -1]) {
    found.push([x + side * reach * u - part * slide * v, y + side * reach * v + part * slide * u, (side < 0 ? 0.6 : 0) + 0.5 * Math.abs(part)]);
  }
  return found;
}
/** On a plate, or somewhat aside. */
export function within(x, y, w, h) {
  return [[x, y, 0], ...[[0, 2.2], [0, -2.2], [1.4, 0], [-1.4, 0]].map(([a, b]) => [x + a * w, y + b * h, 0.5])];
}
/** At the tip of an arrow, or beside its shaft. */
export function atArrow({ x0, y0, dx, dy, long }, w, h) {
  const u = dx / long, v = dy / long, found = [];
  for (const far of [4, 17]) {
    const reach = far + Math.min(w / Math.max(Math.abs(u), 1e-9), h / Math.max(Math.abs(v), 1e-9));
    found.push([x0 + dx + reach * u, y0 + dy + reach * v, far > 4 ? 0.7 : 0]);
  }
  for (const far of [4, 15]) for (const part of [0.9, 0.55]) for (const side of [1, -1]) {
    const aside = side * (far + w * Math.abs(v) + h * Math.abs(u));
    found.push([x0 + part * dx - aside * v, y0 + part * dy + aside * u, (far > 4 ? 0.6 : 0.4) + 0.3 * (1 - part)]);
  }
  return found;
}
/** Names of a frame, put one after another where they cover least: arrows, pins and other names. */
export class Crowd {
  /** In a picture so wide and tall, in pixels; `all` are shown, even those that cover others. */
  constructor(wide, tall, all = false) { Object.assign(this, { wide, tall, all }); }
  points = [];
  edges = [];
  boxes = [];
  /** Put a name {text, wide, spot, hidden} at one of its places [x, y, cost]. */
  put(label, spots) {
    const w = 0.5 * label.wide + 1, h = 7, { points, edges, boxes } = this;
    let least = Infinity, best = 0, covered = 0;
    for (let n = 0; n < spots.length; n++) {
      const [x, y] = spots[n];
      // another place than before must be clearly better, or names would jump to and fro
      let cost = spots[n][2] + (n === label.spot || label.spot === undefined ? 0 : 0.5), over = 0;
      if (x < w || y < h || x > this.wide - w || y > this.tall - h) cost += 3; // cut off
      if (cost >= least) continue;
      for (let k = 0; k < points.length; k += 2) if (Math.abs(points[k] - x) < w && Math.abs(points[k + 1] - y) < h) cost += 0.45;
      for (let k = 0; k < edges.length && cost < least; k += 2) if (Math.abs(edges[k] - x) < w && Math.abs(edges[k + 1] - y) < h) cost += 0.15;
      for (let k = 0; k < boxes.length && cost < least; k += 4) {
        const wide = Math.min(x + w, boxes[k] + boxes[k + 2]) - Math.max(x - w, boxes[k] - boxes[k + 2]);
        const tall = Math.min(y + h, boxes[k + 1] + boxes[k + 3]) - Math.max(y - h, boxes[k + 1] - boxes[k + 3]);
        if (wide > 0 && tall > 0) { const part = wide * tall / (4 * h * Math.min(w, boxes[k + 2])); over += part; cost += 12 * part; }
      }
      if (cost < least) { least = cost; best = n; covered = over; }
    }
    const [x, y] = this.all ? [clamp(spots[best][0], w, this.wide - w), clamp(spots[best][1], h, this.tall - h)] : spots[best];
    const hidden = !this.all && covered > (label.hidden ? 0.1 : 0.25);
    label.spot = best;
    if (label.hidden !== hidden) { label.hidden = hidden; label.text.style.visibility = hidden ? "hidden" : ""; }
    if (hidden) return; // the mouse still names what it is of
    this.boxes.push(x, y, w, h);
    label.text.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
  }
}
