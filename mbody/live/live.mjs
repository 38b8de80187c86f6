// The live part of a view: the core for browsers solves the model again while the reader drags a
// link, moves a number, or lets it run freely. It takes part in the viewer (viewer.mjs) as its
// `solver`: a motion whose histories are those of the present numbers, and a panel.

import { Motion, shown } from "./viewer.mjs";

const TURN = 2 * Math.PI;
const DEG = Math.PI / 180;
const KEYS = ["x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"];
/** Greatest step of a driver of an angle at once, and of any other in lengths of the model. */
const STEP = 0.15;
/** Steps towards the pointer in one frame. */
const STEPS = 12;
/** Part of a number by which it changes at once, so that loops keep their branch. */
const CHANGE = 0.05;

const STYLE = `
.live { margin-top: 0.8rem; border: 1px solid var(--line); border-radius: 8px; padding: 0.6rem 0.8rem; }
.live h2 { font-size: 1rem; margin: 0 0 0.25rem; }
.live p { margin: 0.2rem 0 0.5rem; color: var(--soft); font-size: 0.92rem; }
.live .message { min-height: 1.4em; color: var(--text); font-weight: 500; }
.live .message.bad { color: var(--load); }
.live .groups { columns: 21rem; column-gap: 1.8rem; }
.live fieldset { border: 0; padding: 0; margin: 0 0 0.4rem; min-width: 0; }
.live .row, .live legend { break-inside: avoid; }
.live legend { color: var(--soft); font-size: 0.88rem; padding: 0; margin-top: 0.3rem; }
.live .row { display: grid; grid-template-columns: minmax(6rem, 1.4fr) minmax(4rem, 1fr) 6.2rem 3.4rem; gap: 0.45rem; align-items: center; margin: 0.12rem 0; font-size: 0.92rem; }
.live .row .unit { color: var(--soft); font-size: 0.85rem; overflow-wrap: anywhere; }
.live .row .name { overflow-wrap: break-word; line-height: 1.2; }
.live .row.changed .name { font-weight: 650; color: var(--strong); }
.live input[type="range"] { width: 100%; min-width: 0; accent-color: var(--strong); }
.live input[type="number"] { font: inherit; width: 100%; min-width: 0; color: var(--text); background: var(--panel); border: 1px solid var(--line); border-radius: 5px; padding: 0.1rem 0.3rem; }
.live .drives { display: grid; gap: 0.2rem; max-width: 44rem; }
.live .table h2 { margin-top: 0.6rem; }
.live .why { font-size: 0.88rem; color: var(--soft); margin: 0.2rem 0; padding-left: 1.1rem; }
.live td.num, .live th.num { text-align: right; }
.stage svg .can { cursor: pointer; }
.stage svg { user-select: none; -webkit-user-select: none; }
@media print { .live .bar, .live .drives, .live .groups { display: none; } }
`;

const el = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
const button = (text, title, act) => {
  const made = el("button", { type: "button", title }, text);
  made.addEventListener("click", act);
  return made;
};
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/** The bytes of packed text. */
async function unpacked(text) {
  const packed = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

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
class Shapes {
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

/** Of a place [body, x, y]: way from the mass centre, as the body has turned. */
const along = (p, o, [, x, y]) => Math.cos(p[o + 2]) * x - Math.sin(p[o + 2]) * y;
const across = (p, o, [, x, y]) => Math.sin(p[o + 2]) * x + Math.cos(p[o + 2]) * y;
/** The motion of a place from a page of n coordinates, their rates and accelerations. */
const POINT = Object.fromEntries(Object.entries({
  x: (p, o, n, at) => p[o] + along(p, o, at),
  y: (p, o, n, at) => p[o + 1] + across(p, o, at),
  vx: (p, o, n, at) => p[o + n] - p[o + n + 2] * across(p, o, at),
  vy: (p, o, n, at) => p[o + n + 1] + p[o + n + 2] * along(p, o, at),
  ax: (p, o, n, at) => p[o + 2 * n] - p[o + 2 * n + 2] * across(p, o, at) - p[o + n + 2] ** 2 * along(p, o, at),
  ay: (p, o, n, at) => p[o + 2 * n + 1] + p[o + 2 * n + 2] * along(p, o, at) - p[o + n + 2] ** 2 * across(p, o, at),
}).map(([key, of]) => [key, (p, o, n, at) => (at[0] ? of(p, o + 3 * (at[0] - 1), n, at) : { x: at[1], y: at[2] }[key] ?? 0)]));

/** A motion whose histories are those of the present numbers; `here` is one state beside them. */
class LiveMotion extends Motion {
  constructor(data, scene, solver, found) {
    super({ ...data, t: Array.from(found.t) }, scene);
    Object.assign(this, { solver, found, here: null, names: new Map() });
    this.recorded = new Motion(data, scene);
    this.bodies = scene.bodies.map((name, n) => (n ? Array.from({ length: 6 }, () => new Float64Array(this.count)) : null));
    this.kept = new Map();
    this.x = scene.axis.values ? new Float64Array(this.count) : this.t;
    this.fill(found);
  }
  /** Take the histories of another motion of as many instants. */
  fill(found) {
    this.found = found;
    this.t.set(found.t);
    const { rows } = found, n = 3 * (this.bodies.length - 1), drive = this.solver.axisDriver;
    for (let b = 1; b < this.bodies.length; b++) for (let key = 0; key < 6; key++) {
      const to = this.bodies[b][key], from = (key < 3 ? 0 : n) + 3 * (b - 1) + key % 3;
      for (let k = 0; k < this.count; k++) to[k] = found.pages[k * rows + from];
    }
    if (this.x !== this.t) {
      if (drive) { const value = this.solver.column(found, `${drive}.value`); for (let k = 0; k < this.count; k++) this.x[k] = Math.abs(value[k]) < 1e-12 ? 0 : value[k] * this.solver.axisFactor; } else for (let k = 0; k < this.count; k++) this.x[k] = k + 1;
    }
    for (const [name, q] of this.kept) if (q) q.set(this.#compute(name, found));
  }
  history(name) {
    if (name === "t") return this.t;
    if (!this.kept.has(name)) {
      const values = this.#compute(name, this.found);
      if (values) this.names.set(values, name);
      this.kept.set(name, values);
    }
    return this.kept.get(name);
  }
  #compute(name, found) {
    const cut = name.lastIndexOf("."), owner = name.slice(0, cut), key = name.slice(cut + 1), count = found.t.length;
    const b = this.scene.bodies.indexOf(owner), place = KEYS.indexOf(key), n = 3 * (this.bodies.length - 1);
    if (b > 0 && place >= 0) {
      const from = n * Math.floor(place / 3) + 3 * (b - 1) + place % 3, by = key === "angle" ? 1 / DEG : 1;
      const q = new Float64Array(count), { pages, rows } = found;
      for (let k = 0; k < count; k++) q[k] = by * pages[k * rows + from];
      return q;
    }
    const at = place >= 0 && key !== "angle" ? this.solver.point(owner) : null;
    if (at) {
      const q = new Float64Array(count), one = POINT[key];
      for (let k = 0; k < count; k++) q[k] = one(found.pages, k * found.rows, n, at);
      return q;
    }
    if (!this.solver.model.measures.includes(name)) {
      const old = this.recorded.history(name); // compiled code of mbody computes it
      return old && (this.solver.changed || old.length !== count ? new Float64Array(count).fill(NaN) : Float64Array.from(old));
    }
    return this.solver.column(found, name, this.solver.factor(name));
  }
  /** Be at a state that is no instant of the motion; null: at the instants again. */
  stand(found, x) {
    this.here = found && { found, t: found.t[0], x, values: new Map() };
  }
  set(at) {
    super.set(at);
    if (!this.here) return;
    const { pages } = this.here.found;
    for (let b = 1; b < this.bodies.length; b++) {
      const o = 5 * b;
      for (let n = 0; n < 3; n++) this.pose[o + n] = pages[3 * (b - 1) + n];
      this.pose[o + 3] = Math.cos(this.pose[o + 2]);
      this.pose[o + 4] = Math.sin(this.pose[o + 2]);
    }
    this.carry();
  }
  #now(name) {
    const { values, found } = this.here;
    if (!values.has(name)) values.set(name, this.#compute(name, found)?.[0] ?? NaN);
    return values.get(name);
  }
  value(name, at = this.at) {
    if (!this.here) return super.value(name, at);
    return name === "t" ? this.here.t : this.#now(name);
  }
  value2(q) {
    if (!this.here) return super.value2(q);
    if (q === this.x) return this.here.x;
    if (q === this.t) return this.here.t;
    if (this.names.has(q)) return this.#now(this.names.get(q));
    const at = this.find(this.here.x), k = Math.floor(at), f = at - k; // where contacts are, as recorded
    return f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k];
  }
}

/** What solves the model of a page again, and its panel. */
class Solver {
  constructor(viewer, content, core, image) {
    Object.assign(this, { viewer, content, part: content.live, changed: false, grip: null, running: false });
    this.model = core.open(image);
    const { scene, data } = content, { model } = this;
    this.axisDriver = scene.axis.values && model.manifest.drivers.length === 1 ? model.manifest.drivers[0] : "";
    this.axisFactor = scene.axis.unit === "deg" ? 1 / DEG : 1;
    this.recordedScene = structuredClone(scene);
    this.shapes = this.part.places.program ? new Shapes(scene, this.part.places) : null;
    this.points = new Map(scene.movers.map((one) => [one.n, one.at]));
    this.way = this.#way(data, scene);
    const found = this.#solve();
    this.home = this.#values(found, 0);
    this.motion = new LiveMotion(data, scene, this, found);
    this.before = model.save();
    content.others = [...(content.others ?? []), { data, scene: { ...this.recordedScene, design: "recorded" } }];
    scene.design = scene.design || "now";
    this.motion.fill(found);
  }

  // -- solving --------------------------------------------------------------------------------

  /** How the recorded motion is solved again. */
  #way(data, scene) {
    const { model } = this, t = data.t, n = t.length - 1;
    if (!model.can("turn")) return { kind: "run", until: t[n] };
    const ends = scene.axis.unit === "deg" && scene.axis.values ? scene.axis.values[n] - scene.axis.values[0] : 0;
    if (this.axisDriver && Math.abs(Math.abs(ends) - 360) < 1e-4) return { kind: "turn" };
    if (t[n] > t[0]) return { kind: "time", from: t[0], to: t[n] };
    return { kind: "values" };
  }
  #solve() {
    const { model, way } = this;
    if (way.kind === "run") return model.run({ until: way.until });
    if (way.kind === "time") return model.turn(way);
    if (way.kind === "values") {
      try {
        return this.#along();
      } catch (error) { // an end of the recorded range is too near a dead centre to begin there
        if (way.within || !(error instanceof this.api.MbodyError)) throw error;
        way.within = 0.04;
        return this.#along();
      }
    }
    let found = model.turn(), name = this.axisDriver;
    for (let n = 0; n < 4; n++) { // a whole turn at another speed takes another time
      const value = this.column(found, `${name}.value`), last = found.t.length - 1, ratio = TURN / Math.abs(value[last] - value[0]);
      if (Math.abs(ratio - 1) < 1e-9 || !Number.isFinite(ratio)) break;
      found = model.turn({ from: found.s[0], to: found.s[0] + ratio * (found.s[last] - found.s[0]) });
    }
    return found;
  }
  /** The motion through the recorded values of the drivers. */
  #along() {
    const { model } = this, { scene } = this.content, names = model.manifest.drivers, count = this.content.data.t.length;
    const of = (key, k) => Object.fromEntries(names.map((name) => {
      const q = scene.driven[name][key], middle = 0.5 * (q[0] + q[count - 1]), value = q[k] ?? 0;
      if (key !== "value") return [name, value];
      return [name, (this.way.within ? middle + (1 - 2 * this.way.within) * (value - middle) : value) * (scene.turns[name] ? DEG : 1)];
    }));
    const pages = [], measured = [];
    let one = null;
    model.close({ drive: of("value", 0) });
    for (let k = 0; k < count; k++) {
      one = model.step(of("value", k), { rate: of("rate", k), acceleration: of("acceleration", k) });
      pages.push(one.pages);
      measured.push(one.measured);
    }
    const joined = (parts) => { const all = new Float64Array(parts.length * parts[0].length); parts.forEach((part, k) => all.set(part, k * part.length)); return all; };
    const t = Float64Array.from(this.content.data.t);
    model.step(of("value", 0));
    return new this.api.Motion(model, t, t, joined(pages), joined(measured), one.stats);
  }
  #values(found, k) {
    return Object.fromEntries(this.model.manifest.drivers.map((name) => [name, this.column(found, `${name}.value`)[k]]));
  }
  /** A measured quantity of a motion, times a factor. */
  column(found, name, by = 1) {
    const from = this.model._column(name), wide = this.model.measures.length, { measured } = found;
    const q = new Float64Array(found.t.length);
    for (let k = 0; k < q.length; k++) q[k] = by * measured[k * wide + from];
    return q;
  }
  /** By what a measured quantity is multiplied for the unit of the page. */
  factor(name) {
    const { scene } = this.content, unit = this.model.unit(name), key = name.slice(name.lastIndexOf(".") + 1), owner = name.slice(0, -key.length - 1);
    const page = scene.plots.find((one) => one.name === name)?.unit ?? scene.measures[name] ?? (key === "value" && scene.turns[owner] ? "deg" : key === "angle" ? "deg" : unit);
    return page === "deg" && unit === "rad" ? 1 / DEG : 1;
  }
  /** A named point: [body, x, y]. */
  point(name) {
    const { rules, program } = this.part.places, n = rules?.points[name];
    return n !== undefined && this.shapes ? [program.bodies[n], ...this.shapes.at[n]] : this.points.get(name);
  }

  // -- driving --------------------------------------------------------------------------------

  get drives() { return this.model.can("step") ? this.model.manifest.drivers : []; }
  /** The rate and acceleration that drivers have at these values, as in the motion. */
  #pace(drive) {
    const [name, ...others] = this.drives, rate = {}, acceleration = {};
    if (others.length || !name) return { rate, acceleration };
    const value = this.column(this.motion.found, `${name}.value`), n = value.length - 1, { found } = this.motion;
    let wanted = drive[name], low = 0, high = n;
    const span = value[n] - value[0], up = span >= 0;
    if (this.way.kind === "turn") wanted -= Math.floor((wanted - value[0]) / span) * span;
    while (high - low > 1) { const middle = (low + high) >> 1; if (up ? value[middle] <= wanted : value[middle] >= wanted) low = middle; else high = middle; }
    const part = value[high] === value[low] ? 0 : clamp((wanted - value[low]) / (value[high] - value[low]), 0, 1);
    for (const [key, to] of [["rate", rate], ["acceleration", acceleration]]) { const q = this.column(found, `${name}.${key}`); to[name] = q[low] === q[high] ? q[low] : q[low] + part * (q[high] - q[low]); }
    return { rate, acceleration, t: found.t[low] + part * (found.t[high] - found.t[low]) };
  }
  #axis(drive, t) {
    if (!this.axisDriver) return this.motion.x === this.motion.t ? t : this.motion.value2(this.motion.x);
    const x = this.motion.x, n = this.motion.count - 1, value = drive[this.axisDriver] * this.axisFactor, span = x[n] - x[0];
    return this.way.kind === "turn" && span ? value - Math.floor((value - x[0]) / span) * span : value;
  }
  /** The state of the drivers now: where the page stands. */
  present() {
    if (this.drive) return { ...this.drive };
    const { found } = this.motion, k = Math.floor(this.viewer.at), f = this.viewer.at - k;
    return Object.fromEntries(this.drives.map((name) => { const q = this.column(found, `${name}.value`); return [name, f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k]]; }));
  }
  /** Move drivers to values along the branch; the page stands there with all forces. */
  to(drive, pace = null) {
    const there = { ...this.present(), ...drive };
    if (!this.drive) this.#enter();
    const motion = this.model.step(there, pace ?? this.#pace(there));
    this.#stand(motion, there);
    return motion;
  }
  #enter() {
    const now = this.present();
    this.viewer.pause();
    if (!Object.keys(this.model._drive).length) this.model.close({ drive: this.home });
    this.model.step(now);
    this.drive = now;
  }
  #stand(motion, drive) {
    this.drive = { ...drive };
    this.motion.stand(motion, this.#axis(drive, motion.t[0]));
    this.#showDrives();
  }
  /** Be at the instants of the motion again. */
  leave() {
    if (this.running) this.pause();
    if (!this.motion.here) return;
    this.motion.stand(null);
    this.drive = null;
  }
  /** The pointer takes a link, at a place of the world. */
  grab(event, at) {
    if (!this.drives.length || event.button) return false;
    const name = event.composedPath()[0].dataset?.name;
    const shape = name && this.content.scene.shapes.find((one) => one.n === name);
    if (!shape) return false;
    const carrier = this.content.scene.carriers[shape.c];
    const body = carrier.e ? 0 : carrier.s[0] || carrier.t;
    if (!body || !/^(link|pin|block|cg|point|wheel|piston|rod|roller|stem|cam)/.test(name)) return false;
    const p = this.motion.pose, o = 5 * body, dx = at[0] - p[o], dy = at[1] - p[o + 1];
    this.grip = { place: [body, p[o + 3] * dx + p[o + 4] * dy, p[o + 3] * dy - p[o + 4] * dx], to: at };
    return true;
  }
  /** The pointer has moved; whether it holds a link. */
  drag(at) {
    if (!this.grip) return false;
    this.grip.to = at;
    if (!this.asked) {
      this.asked = true;
      requestAnimationFrame(() => { this.asked = false; this.follow(); });
    }
    return true;
  }
  drop() { if (this.grip) { this.follow(); this.grip = null; } }
  /** Bring the place that is held as near to the pointer as the drivers can. */
  follow() {
    if (!this.grip) return;
    this.guarded(() => {
      const { place, to } = this.grip;
      for (let n = 0; n < STEPS; n++) {
        const now = this.present(), change = this.#towards(place, to, now);
        const size = Math.max(...Object.entries(change).map(([name, by]) => Math.abs(by) / this.#scale(name)));
        if (size < 1e-7) break;
        const by = Math.min(1, STEP / size);
        this.to(Object.fromEntries(Object.entries(change).map(([name, own]) => [name, now[name] + by * own])));
      }
      this.say("");
    });
  }
  #scale(name) { return this.content.scene.turns[name] ? 1 : this.model.manifest.length; }
  /** Least squares: the change of the drivers that brings a place nearest. */
  #towards(place, to, now) {
    if (!this.drive) this.#enter();
    const names = this.drives, columns = [];
    let at = null;
    for (const name of names) {
      const one = this.model.step(now, { rate: Object.fromEntries(names.map((other) => [other, other === name ? 1 : 0])) });
      const { pages } = one, n = this.model.manifest.coordinates, o = 3 * (place[0] - 1), c = Math.cos(pages[o + 2]), s = Math.sin(pages[o + 2]);
      const dx = c * place[1] - s * place[2], dy = s * place[1] + c * place[2], w = pages[n + o + 2];
      at = [pages[o] + dx, pages[o + 1] + dy];
      columns.push([pages[n + o] - w * dy, pages[n + o + 1] + w * dx]);
    }
    const off = [to[0] - at[0], to[1] - at[1]], change = {};
    names.forEach((name, n) => { // one driver after the other takes what is left
      const [x, y] = columns[n], size = x * x + y * y, low = 1e-6 * (this.model.manifest.length / this.#scale(name)) ** 2;
      const by = size > low ? (off[0] * x + off[1] * y) / size : 0;
      change[name] = by;
      off[0] -= by * x;
      off[1] -= by * y;
    });
    return change;
  }

  // -- changing numbers -----------------------------------------------------------------------

  /** Change numbers by dotted name; the page shows the motion of them all. */
  change(values) {
    const { model } = this, saved = model.save(), keep = this.drive && { ...this.drive }, names = Object.keys(values);
    const fresh = this.changed, from = Object.fromEntries(names.map((name) => [name, model.get(name)]));
    try {
      if (this.running) this.pause();
      this.started = false;
      if (model.can("step") && Object.keys(model._drive).length) model.step(this.home);
      const most = Math.max(0, ...names.map((name) => Math.abs(values[name] - from[name]) / (Math.max(Math.abs(from[name]), Math.abs(values[name])) || 1)));
      const count = clamp(Math.ceil(most / CHANGE), 1, 40), moves = model.can("close") && names.some((name) => this.moving.has(name));
      for (let k = 1; k <= count; k++) {
        if (!moves && k < count) continue;
        model.set(Object.fromEntries(names.map((name) => [name, k === count ? values[name] : from[name] + k / count * (values[name] - from[name])])));
        if (model.can("close") && this.drives.length) model.close({ drive: this.home });
      }
      this.changed = true;
      const found = this.#solve();
      if (found.t.length !== this.motion.count) throw new this.api.MbodyError("the motion has another number of instants");
      if (this.drives.length) this.home = this.#values(found, 0);
      this.motion.stand(null);
      this.motion.fill(found);
      const near = this.way.kind === "run" && names.some((name) => this.moving.has(name)) ? ["the free motion begins at the nearest position in which the loops close"] : [];
      this.say([...found.stats.doubts, ...near].map((text) => `${text[0].toUpperCase()}${text.slice(1)}.`).join(" "));
    } catch (error) {
      model.restore(saved);
      this.changed = fresh;
      throw error;
    }
    this.drive = null;
    this.shapes?.follow(model, this.motion);
    this.#signs();
    this.#contacts();
    if (keep) this.guarded(() => this.to(keep));
    this.viewer.renew(this.#grown());
    if (!this.viewer.on.ghosts && !fresh) this.viewer.toggle("ghosts");
    this.#peaks();
  }
  /** Whether the motion needs more room than the picture has; then it gets it. */
  #grown() {
    const { scene, motion } = { scene: this.content.scene, motion: this.motion }, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let n = 0; n <= 24; n++) {
      Motion.prototype.set.call(motion, Math.round(n / 24 * (motion.count - 1)));
      for (const shape of scene.shapes) {
        const wide = scene.carriers[shape.c].x ? 3 : 2, r = shape.r ?? 0;
        for (let k = 0; k < shape.p.length; k += wide) {
          if (shape.p[k] === null) continue;
          const at = motion.carried(shape.c, shape.p, k, wide);
          for (const i of [0, 1]) { low[i] = Math.min(low[i], at[i] - r); high[i] = Math.max(high[i], at[i] + r); }
        }
      }
    }
    const { box } = scene, room = 0.02 * Math.max(box.high[0] - box.low[0], box.high[1] - box.low[1]);
    const grown = [0, 1].some((i) => low[i] < box.low[i] - room || high[i] > box.high[i] + room);
    if (grown) for (const i of [0, 1]) { box.low[i] = Math.min(box.low[i], low[i]); box.high[i] = Math.max(box.high[i], high[i]); }
    return grown;
  }
  /** Places of contacts are recorded: with other lengths their forces have no arrows. */
  #contacts() {
    const lengths = this.part.numbers.some((one) => one.now !== one.value && Object.keys(one.factors).some((name) => this.moving.has(name)));
    let hidden = false;
    for (const one of this.viewer.arrows) {
      if (!one.places) continue;
      one.own ??= one.x;
      one.x = lengths ? null : one.own;
      hidden ||= lengths;
    }
    if (hidden && !this.message.textContent) this.say("Where lengths have changed, forces of contacts have no arrows; diagrams have them.");
  }
  /** Arrows of drivers that turn the other way now are not shown. */
  #signs() {
    for (const drawn of this.viewer.layers.world.querySelectorAll('[data-name^="driver:"]')) {
      const name = drawn.dataset.name.split(":")[1], rate = this.motion.history(`${name}.rate`)?.[0], old = this.motion.recorded.history(`${name}.rate`)?.[0];
      drawn.style.display = rate * old < 0 ? "none" : "";
    }
  }
  /** Do something that mbody may refuse: its sentence is shown, and the last good state stays. */
  guarded(act) {
    try {
      act();
      return true;
    } catch (error) {
      if (!(error instanceof this.api.MbodyError)) throw error;
      this.say(`${error.message}. The page stays where it was.`, true);
      return false;
    } finally {
      this.viewer.draw();
    }
  }
  say(text, bad = false) {
    if (!this.message) return;
    if (this.message.textContent !== text) this.message.textContent = text;
    this.message.classList.toggle("bad", bad);
  }

  // -- free motion ----------------------------------------------------------------------------

  get free() { return this.model.can("advance") && !this.model.can("step"); }
  run() {
    if (this.running) return this.pause();
    this.viewer.pause();
    this.guarded(() => {
      if (!this.started) { this.model.start({ t: this.motion.t[0], until: this.motion.t[0] + 3600 / this.content.scene.second }); this.started = true; this.clock = this.motion.t[0]; }
      this.running = true;
      this.runButton.textContent = "Pause";
      let last = null;
      const frame = (now) => {
        if (!this.running) return;
        if (last !== null) this.onward(Math.min(0.05, (now - last) / 1000) * this.viewer.speed.value / this.content.scene.second);
        last = now;
        this.viewer.draw();
        requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    });
  }
  /** Go on with the free motion by a time. */
  onward(by) {
    if (!(by > 0)) return;
    const good = this.guarded(() => {
      const motion = this.model.advance(this.clock + by);
      this.clock += by;
      this.motion.stand(motion, this.motion.x === this.motion.t ? motion.t[0] : this.motion.x[0]);
    });
    if (!good) this.pause();
  }
  pause() {
    this.running = false;
    if (this.runButton) this.runButton.textContent = "Run freely";
  }
  restart() {
    this.pause();
    this.started = false;
    this.say("");
    this.motion.stand(null);
    this.viewer.goTo(0);
  }

  // -- the panel ------------------------------------------------------------------------------

  begin() {
    const { viewer, part, content } = this;
    viewer.shadowRoot.append(el("style", {}, STYLE));
    if (content.others.length === 1) { // the recorded motion alone, which is the same as yet
      viewer.on.ghosts = false;
      viewer.switches.ghosts.setAttribute("aria-pressed", "false");
      viewer.switches.ghosts.textContent = "Recorded";
    }
    this.message = el("p", { class: "message", role: "status", "aria-live": "polite" });
    const panel = el("section", { class: "live", "aria-label": "live" }, el("h2", {}, "Change it"));
    const can = this.drives.length ? "Drag a link or a pin in the picture, or use the sliders: position and forces are solved again as you go."
      : "This motion is free: it is solved again from numbers that you change, and runs in real time.";
    panel.append(el("p", {}, can), this.message);
    if (this.drives.length) panel.append(this.#driveRows());
    const bar = el("div", { class: "bar" });
    if (this.free) {
      this.runButton = button("Run freely", "solve on in real time", () => this.run());
      bar.append(this.runButton, button("From the start", "begin the free motion again", () => this.restart()));
    }
    bar.append(button("As recorded", "all numbers as in the model", () => this.reset()));
    if (part.text.length && part.numbers.length) bar.append(button("Save changed model", `save ${this.#fileName()}`, () => this.save()));
    panel.append(bar, this.#numbers());
    this.table = el("table");
    this.peakBox = el("div", { class: "table", hidden: "" }, el("h2", {}, "Peaks, recorded and now"), this.table);
    panel.append(this.peakBox);
    viewer.body.after(panel);
    for (const drawn of this.drives.length ? viewer.layers.world.querySelectorAll('[data-name^="link:"], [data-name^="pin:"], [data-name^="block:"]') : []) drawn.classList.add("can");
    this.#showDrives();
  }
  #driveRows() {
    const box = el("div", { class: "drives" });
    this.driveInputs = this.drives.map((name) => {
      const turns = this.content.scene.turns[name], by = turns ? 1 / DEG : 1, unit = turns ? "deg" : this.content.scene.units.length;
      const value = this.column(this.motion.found, `${name}.value`), low = Math.min(...value) * by, high = Math.max(...value) * by;
      const range = el("input", { type: "range", min: low, max: high, step: turns ? 0.5 : (high - low) / 400 || 1, "aria-label": `${name} in ${unit}` });
      const number = el("input", { type: "number", step: "any", "aria-label": `${name}, value in ${unit}` });
      const go = (input) => { if (input.value !== "" && this.guarded(() => this.walk({ [name]: input.value / by }))) this.say(""); };
      range.addEventListener("input", () => go(range));
      number.addEventListener("change", () => go(number));
      box.append(el("div", { class: "row" }, el("span", { class: "name" }, name), range, number, el("span", { class: "unit" }, unit)));
      return { name, range, number, by };
    });
    return box;
  }
  /** Go to values of drivers in steps that a path can follow; of a turn the shorter way. */
  walk(wanted) {
    const from = this.present(), drive = Object.fromEntries(Object.entries(wanted).map(([name, to]) => [name, this.way.kind === "turn" ? to + TURN * Math.round((from[name] - to) / TURN) : to])), count = clamp(Math.ceil(Math.max(...Object.entries(drive).map(([name, to]) => Math.abs(to - from[name]) / this.#scale(name))) / STEP), 1, 400);
    for (let k = 1; k <= count; k++) this.to(Object.fromEntries(Object.entries(drive).map(([name, to]) => [name, k === count ? to : from[name] + k / count * (to - from[name])])));
  }
  #showDrives() {
    const now = this.driveInputs?.length ? this.present() : {};
    for (const { name, range, number, by } of this.driveInputs ?? []) {
      if (this.way.kind === "turn" && name === this.axisDriver) { const first = this.home[name]; now[name] -= Math.floor((now[name] - first) / TURN + 1e-9) * TURN; }
      range.value = now[name] * by;
      if (this.viewer.shadowRoot.activeElement !== number) number.value = Math.abs(now[name]) < 1e-12 * this.#scale(name) ? 0 : +(now[name] * by).toPrecision(8);
    }
  }
  #numbers() {
    const groups = new Map(), zeros = [], fixed = new Map(Object.entries(this.part.fixed));
    this.inputs = [];
    this.moving = new Set();
    for (const one of this.part.numbers) {
      one.now = one.value;
      const names = Object.keys(one.factors);
      if (one.why) { for (const name of names) fixed.set(name, one.why); continue; }
      if (one.moves) names.forEach((name) => this.moving.add(name));
      const row = this.#row(one, names.join(", "));
      if (one.value === 0 && one.group !== "loads") zeros.push(row);
      else groups.set(one.group, [...(groups.get(one.group) ?? []), row]);
    }
    const box = el("details", { open: "" }, el("summary", {}, "Numbers of the model"));
    const order = ["parameters", "drivers", "loads", "masses", "lengths and places"].filter((name) => groups.has(name));
    const all = el("div", { class: "groups" });
    for (const name of order) all.append(el("fieldset", {}, el("legend", {}, name), ...groups.get(name)));
    box.append(all);
    if (zeros.length) box.append(el("details", {}, el("summary", {}, `${zeros.length} numbers that are zero`), el("div", { class: "groups" }, el("fieldset", {}, ...zeros))));
    if (fixed.size || this.part.why) {
      const why = el("ul", { class: "why" });
      if (this.part.why) why.append(el("li", {}, this.part.why));
      const reasons = new Map();
      for (const [name, text] of fixed) reasons.set(text, [...(reasons.get(text) ?? []), name]);
      for (const [text, names] of reasons) why.append(el("li", {}, `${names.join(", ")}: ${text}`));
      box.append(el("details", {}, el("summary", {}, "Numbers that cannot be changed here"), why));
    }
    return box;
  }
  #row(one, names) {
    const size = Math.abs(one.value), length = this.model.manifest.length;
    let low = 0, high = 2 * one.value;
    if (one.value < 0) [low, high] = [2 * one.value, 0];
    if (one.unit === "deg" || one.unit === "rad") { const by = one.unit === "deg" ? 45 : 45 * DEG; [low, high] = [one.value - by, one.value + by]; }
    if (one.sign === "positive") low = 0.05 * size;
    if (!one.value) [low, high] = one.group === "lengths and places" && one.unit !== "deg" ? [-0.25 * length, 0.25 * length] : one.unit === "deg" ? [-45, 45] : [one.sign ? 0 : -1, 1];
    const step = (high - low) / 400;
    const range = el("input", { type: "range", min: low, max: high, step, "aria-label": `${names} in ${one.unit || "1"}` });
    const number = el("input", { type: "number", step: "any", "aria-label": `${names}, value in ${one.unit || "1"}` });
    const text = el("span", { class: "name" });
    for (const part of names.split(/(?<=[._])/)) text.append(part, el("wbr"));
    const row = el("div", { class: "row" }, text, range, number, el("span", { class: "unit" }, one.unit.replaceAll("*", "·").replaceAll("^2", "²").replaceAll("^3", "³")));
    const show = () => { range.value = one.now; number.value = one.now; row.classList.toggle("changed", one.now !== one.value); };
    one.show = show;
    const go = (value) => {
      if (!Number.isFinite(value) || value === one.now) return show();
      const old = one.now;
      one.now = value;
      if (!this.guarded(() => this.change(this.#given(one)))) one.now = old;
      show();
    };
    let wanted = null;
    range.addEventListener("input", () => {
      const own = Math.abs(+range.value - one.value) < 0.5 * step ? one.value : +(+range.value).toPrecision(6);
      if (wanted === null) requestAnimationFrame(() => { const value = wanted; wanted = null; go(value); });
      wanted = own;
    });
    number.addEventListener("change", () => go(number.value === "" ? NaN : +number.value));
    show();
    return row;
  }
  #given(one) {
    return Object.fromEntries(Object.entries(one.factors).map(([name, factor]) => [name, one.now * factor]));
  }
  /** Set numbers of the file by a name that they give, in the unit of the file. */
  set(values) {
    const given = {}, touched = [];
    for (const [name, value] of Object.entries(values)) {
      const one = this.part.numbers.find((own) => name in own.factors);
      if (!one || one.why) throw new this.api.MbodyError(`'${name}' cannot be changed on this page${one ? `: ${one.why}` : ""}`);
      touched.push([one, one.now]);
      one.now = value;
      Object.assign(given, this.#given(one));
    }
    const good = this.guarded(() => this.change(given));
    for (const [one, old] of touched) { if (!good) one.now = old; one.show?.(); }
    return good;
  }
  /** All numbers as in the model. */
  reset() {
    if (this.running) this.pause();
    const given = {};
    for (const one of this.part.numbers) if (one.now !== one.value) { one.now = one.value; Object.assign(given, this.#given(one)); one.show?.(); }
    if (Object.keys(given).length && !this.guarded(() => this.change(given))) return;
    this.started = false;
    this.changed = false;
    if (Object.keys(given).length) { this.motion.fill(this.motion.found); this.viewer.renew(); }
    if (this.viewer.on.ghosts && this.content.others.length === 1) this.viewer.toggle("ghosts");
    this.#contacts();
    this.peakBox.hidden = true;
    this.viewer.goTo(0);
    this.#showDrives();
    this.say("");
  }
  #peaks() {
    const names = [...new Set([...this.viewer.plots.map((plot) => plot.name), ...this.drives.map((name) => `${name}.effort`), ...this.content.scene.forces.filter((one) => !one.load).map((one) => `${one.of}.force`)])];
    const peak = (q) => { let most = 0; for (const v of q ?? []) if (Math.abs(v) > Math.abs(most)) most = v; return most; };
    const body = el("tbody");
    for (const name of names.slice(0, 12)) {
      const now = this.motion.history(name), old = this.motion.recorded.history(name);
      if (!now || !old || !now.some(Number.isFinite)) continue;
      const [a, b] = [peak(old), peak(now)], ratio = Math.abs(a) > 1e-9 * Math.abs(b) && a ? 100 * (b / a - 1) : NaN;
      body.append(el("tr", {}, el("th", { scope: "row" }, name), el("td", { class: "num" }, shown(a)), el("td", { class: "num" }, shown(b)), el("td", {}, this.viewer.unitOf(name)), el("td", { class: "num" }, Number.isFinite(ratio) ? `${ratio >= 0 ? "+" : ""}${shown(Math.round(10 * ratio) / 10, 4)} %` : "")));
    }
    this.table.replaceChildren(el("thead", {}, el("tr", {}, ...["quantity", "recorded", "now", "unit", "change"].map((text, n) => el("th", { scope: "col", ...(n === 1 || n === 2 || n === 4 ? { class: "num" } : {}) }, text)))), body);
    this.peakBox.hidden = false;
  }

  // -- the file -------------------------------------------------------------------------------

  /** The model file with the present numbers. */
  file() {
    const { text, numbers } = this.part;
    return text.map((part, n) => part + (n < numbers.length ? String(numbers[n].now) : "")).join("");
  }
  #fileName() { return (this.content.made.name ?? "model.toml").replace(/\.toml$/, this.changed ? "-changed.toml" : ".toml"); }
  save() {
    const link = el("a", { href: URL.createObjectURL(new Blob([this.file()], { type: "application/toml" })), download: this.#fileName() });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}

/** Take part in the viewer. */
export function begin(viewers, api) {
  Solver.prototype.api = api;
  viewers.solver = async (viewer, content) => {
    try {
      const core = await api.Core.load(await unpacked(content.live.core));
      return new Solver(viewer, content, core, await unpacked(content.live.image));
    } catch (error) {
      content.recorded = `This page shows the recorded motion; it cannot solve the model again: ${error.message}.`;
      return null;
    }
  };
}
