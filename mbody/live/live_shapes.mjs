// The shapes of a scene for other numbers: corners follow anchors, which follow the numbers.

import { DEG, TURN, clamp } from "../views/viewer/elements.mjs";

const FUNCTIONS = {
  negative: (a) => -a, sin: Math.sin, cos: Math.cos, tan: Math.tan, asin: Math.asin, acos: Math.acos, atan: Math.atan,
  sqrt: Math.sqrt, abs: Math.abs, exp: Math.exp, log: Math.log, "+": (a, b) => a + b, "-": (a, b) => a - b,
  "*": (a, b) => a * b, "/": (a, b) => a / b, "^": (a, b) => a ** b, atan2: Math.atan2, hypot: Math.hypot,
  min: Math.min, max: Math.max,
};

/** The convex hull of points, counter-clockwise, without corners that protrude less than `flat`. */
export function hull(points, flat) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const ordered = sorted.filter((p, n) => !n || Math.hypot(p[0] - sorted[n - 1][0], p[1] - sorted[n - 1][1]) > 1e-9 * flat);
  if (ordered.length < 3) return ordered;
  const side = (half) => {
    const chain = [];
    for (const c of half) {
      while (chain.length > 1) {
        const [a, b] = chain.slice(-2), across = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if (across > flat * Math.hypot(c[0] - a[0], c[1] - a[1])) break;
        chain.pop();
      }
      chain.push(c);
    }
    return chain.slice(0, -1);
  };
  return [...side(ordered), ...side(ordered.reverse())];
}

/** The outline of all that lies within a radius of the hull, as x, y, x, y, … */
export function rounded(points, radius) {
  const corners = hull(points, 1e-3 * radius), count = corners.length, found = [];
  const arc = ([x, y], from, by) => {
    const n = 2 + Math.floor(Math.abs(by) / (9 * DEG));
    for (let k = 0; k < n; k++) {
      const angle = from + by * k / (n - 1);
      found.push(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    }
  };
  if (count === 1) arc(corners[0], 0, TURN);
  else {
    const normals = corners.map((a, n) => { const b = corners[(n + 1) % count]; return Math.atan2(a[0] - b[0], b[1] - a[1]); });
    corners.forEach((corner, n) => {
      const from = normals[(n + count - 1) % count], by = normals[n] - from;
      arc(corner, from, by - TURN * Math.floor(by / TURN));
    });
  }
  return found;
}

/** The shapes of a scene for other numbers. */
export class Shapes {
  constructor(scene, { program, rules }) {
    Object.assign(this, { scene, program, rules });
    this.at = program.shown.map((place) => [...place]);
    const first = structuredClone(scene.shapes);
    this.first = first;
    this.angles = null;
    this.ways = new Map(); // what is added to the place of an anchor
    const away = (place, n) => (n === null || n === undefined ? [0, 0] : [place[0] - this.at[n][0], place[1] - this.at[n][1]]);
    this.rest = {
      carriers: scene.carriers.map((one, n) => [away(one.s.slice(1), rules.carriers[n][0]), one.e ? away(one.e.slice(1), rules.carriers[n][1]) : null]),
      labels: scene.labels.map((one, n) => away(one.a, rules.labels[n])),
    };
    for (const one of Object.values(rules.shapes)) if ("at" in one) one.from = [...this.at[one.at]];
    this.radii = this.#run(null).slice(0, program.numbers);
  }
  #run(model) {
    const { inputs, slots, operations, targets } = this.program, now = Float64Array.from(slots);
    if (model) inputs.forEach((name, n) => (now[n] = model.get(name)));
    for (const [name, a, b, to] of operations) now[to] = FUNCTIONS[name](now[a], now[b]);
    return targets.map((slot) => now[slot]);
  }
  /** Place all anchors for the present numbers of the model; `motion` is where guides end. */
  follow(model, motion) {
    const values = this.#run(model), { numbers } = this.program, { rules, scene } = this;
    for (let n = 0; n < this.at.length; n++) this.at[n] = [values[numbers + 2 * n], values[numbers + 2 * n + 1]];
    for (const one of rules.guides) this.#guide(one, values[one.angle], motion);
    for (const [k, rule] of Object.entries(rules.shapes)) this.#shape(scene.shapes[k], this.first[k], rule, values);
    const put = (place, n, rest, from) => { if (n !== null && n !== undefined) { place[from] = this.at[n][0] + rest[0]; place[from + 1] = this.at[n][1] + rest[1]; } };
    scene.carriers.forEach((one, n) => {
      put(one.s, rules.carriers[n][0], this.rest.carriers[n][0], 1);
      if (one.e) put(one.e, rules.carriers[n][1], this.rest.carriers[n][1], 1);
    });
    scene.labels.forEach((one, n) => put(one.a, rules.labels[n], this.rest.labels[n], 0));
    scene.movers.forEach((one, n) => put(one.at, rules.movers[n], [0, 0], 1));
    scene.forces.forEach((one, n) => put(one.at, rules.forces[n], [0, 0], 1));
    for (const one of Object.values(scene.free?.bodies ?? {}).flat()) if (one.p in rules.places) put(one.at, rules.places[one.p], [0, 0], 1);
  }
  /** The ends of a guide: the range of what slides in it, with a margin. */
  #guide({ ends, rail, slides, angle: _, more }, angle, motion) {
    const { bodies } = this.program, [c, s] = [Math.cos(angle), Math.sin(angle)], [rx, ry] = this.at[rail], [px, py] = this.at[slides];
    let low = Infinity, high = -Infinity;
    const own = motion.bodies[bodies[rail]], other = motion.bodies[bodies[slides]];
    for (let k = 0; k < motion.count; k++) {
      let [x, y] = [px, py];
      if (other) { const a = other[2][k]; [x, y] = [other[0][k] + Math.cos(a) * px - Math.sin(a) * py, other[1][k] + Math.sin(a) * px + Math.cos(a) * py]; }
      if (own) { const a = own[2][k], [dx, dy] = [x - own[0][k], y - own[1][k]]; [x, y] = [Math.cos(a) * dx + Math.sin(a) * dy, Math.cos(a) * dy - Math.sin(a) * dx]; }
      const along = (x - rx) * c + (y - ry) * s;
      if (along < low) low = along;
      if (along > high) high = along;
    }
    this.at[ends[0]] = [rx + (low - more) * c, ry + (low - more) * s];
    this.at[ends[1]] = [rx + (high + more) * c, ry + (high + more) * s];
  }
  #shape(shape, first, rule, values) {
    const { at } = this;
    if (rule.nodes) shape.p = rounded(rule.nodes.map((n) => at[n]), rule.half);
    else if (rule.tie) {
      const [a, b] = rule.tie.map((n) => at[n]), way = [b[0] - a[0], b[1] - a[1]];
      const part = clamp(-(a[0] * way[0] + a[1] * way[1]) / (way[0] ** 2 + way[1] ** 2 || 1), 0, 1);
      shape.p = [a[0] + part * way[0], a[1] + part * way[1], 0, 0];
    } else if (rule.rows) {
      shape.p = rule.rows.flatMap((row) => {
        if (!row) return [null, null];
        const [a, b, part, x, y] = row;
        return [at[a][0] + part * (at[b][0] - at[a][0]) + x, at[a][1] + part * (at[b][1] - at[a][1]) + y];
      });
      if ("r" in rule) shape.r = first.r + values[rule.r] - this.radii[rule.r];
    } else {
      const [x, y] = at[rule.at], [fx, fy] = rule.from;
      const by = "by" in rule ? values[rule.by] / this.radii[rule.by] : 1, out = "out" in rule ? values[rule.out] - this.radii[rule.out] : 0;
      for (let k = 0; k < shape.p.length; k += 2) {
        if (first.p[k] === null) continue;
        const dx = first.p[k] - fx, dy = first.p[k + 1] - fy, far = 1 + out / (Math.hypot(dx, dy) || 1);
        shape.p[k] = x + by * far * dx;
        shape.p[k + 1] = y + by * far * dy;
      }
    }
  }
}
