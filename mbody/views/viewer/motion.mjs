// One motion: histories by name, and where everything is between instants.

import { DEG, clamp } from "./elements.mjs";

/** One motion: histories by name, poses at any time between instants. */
export class Motion {
  constructor(data, scene) {
    Object.assign(this, { data, scene, count: data.t.length, kept: new Map() });
    this.t = Float64Array.from(data.t);
    this.x = scene.axis.values ? Float64Array.from(scene.axis.values) : this.t;
    this.bodies = scene.bodies.map((name) => this.#body(name));
    this.pose = new Float64Array(5 * this.bodies.length); // x, y, angle, cos, sin
    this.frames = new Float64Array(5 * scene.carriers.length); // x, y, cos, sin, length
    this.at = -1;
  }
  #body(name) {
    if (name === "ground") return null;
    const own = this.data.bodies[name], take = (key, by = 1) => own[key] && Float64Array.from(own[key], (v) => (v ?? NaN) * by);
    const turn = this.data.units.angle === "deg" ? DEG : 1;
    return [take("x"), take("y"), take("angle", turn), take("vx"), take("vy"), take("omega")];
  }
  /** The history of a quantity, such as "crank.omega", "A.force", "coupler.P.vy"; undefined where there is none. */
  history(name) {
    if (!this.kept.has(name)) this.kept.set(name, this.#calm(name, this.#history(name)));
    return this.kept.get(name);
  }
  /** Forces that are rounding all the time are shown as zero. */
  #calm(name, q) {
    const cut = name.lastIndexOf("."), key = name.slice(cut + 1), { floors, turns } = this.scene;
    const kind = key === "effort" ? (turns[name.slice(0, cut)] ? "torque" : "force") : { fx: "force", fy: "force", force: "force", torque: "torque" }[key];
    if (q && floors[kind] && q.every((v) => !(Math.abs(v) > floors[kind]))) return q.map((v) => (Number.isNaN(v) ? v : 0));
    return q;
  }
  #history(name) {
    const { data, scene } = this, full = (list) => list && Float64Array.from(list, (v) => v ?? NaN);
    if (name === "t") return this.t;
    if (scene.senses?.[name]) return full(scene.senses[name]);
    for (const one of scene.plots) if (one.name === name && one.values) return full(one.values);
    if (data.measures[name]) return full(data.measures[name]);
    const cut = name.lastIndexOf("."), owner = name.slice(0, cut), key = name.slice(cut + 1);
    if (key === "effort") return full(data.efforts[owner]);
    if (key === "contact" && data.contacts?.[owner]) return full(data.contacts[owner]);
    if (key === "loss" && data.losses?.[owner]) return full(data.losses[owner]);
    if (scene.driven[owner]?.[key]) return full(scene.driven[owner][key]);
    for (const table of [data.bodies, data.points, data.reactions, data.loads]) {
      const own = table?.[owner];
      if (own && Array.isArray(own[key])) return full(own[key]);
      if (own && key === "force" && own.fx) return Float64Array.from(own.fx, (fx, k) => Math.hypot(fx ?? NaN, own.fy[k] ?? NaN));
    }
    return undefined;
  }
  /** Whether the motion between an instant and the next is continuous in time. */
  flows(k) { return k + 1 < this.count && this.t[k + 1] > this.t[k]; }
  /** Set all poses to a place between instants: 3.25 is a quarter of the way from instant 3 to 4. */
  set(at) {
    const k = clamp(Math.floor(at), 0, this.count - 1), f = this.flows(k) ? at - k : 0;
    const h = f ? this.t[k + 1] - this.t[k] : 0;
    this.at = k + f;
    for (let b = 0; b < this.bodies.length; b++) {
      const own = this.bodies[b], o = 5 * b;
      for (let n = 0; n < 3; n++) {
        if (!own) { this.pose[o + n] = 0; continue; }
        const q = own[n], v = own[n + 3];
        this.pose[o + n] = f ? between(q[k], q[k + 1], v?.[k], v?.[k + 1], h, f) : q[k];
      }
      this.pose[o + 3] = Math.cos(this.pose[o + 2]);
      this.pose[o + 4] = Math.sin(this.pose[o + 2]);
    }
    this.carry();
  }
  /** Place what carries the shapes by the poses. */
  carry() { this.scene.carriers.forEach((carrier, n) => this.#carry(carrier, 5 * n)); }
  #carry({ s, t, e }, o) {
    const [x, y] = this.place(s), to = this.frames;
    to[o] = x; to[o + 1] = y;
    if (e) {
      const [a, b] = this.place(e), length = Math.hypot(a - x, b - y) || 1e-300;
      to[o + 2] = (a - x) / length; to[o + 3] = (b - y) / length; to[o + 4] = length;
    } else { to[o + 2] = this.pose[5 * t + 3]; to[o + 3] = this.pose[5 * t + 4]; to[o + 4] = 1; }
  }
  /** World place of [body, x, y]. */
  place([b, x, y]) {
    const p = this.pose, o = 5 * b;
    return [p[o] + p[o + 3] * x - p[o + 4] * y, p[o + 1] + p[o + 4] * x + p[o + 3] * y];
  }
  /** World place of n numbers (2 or 3) in the axes of a carrier. */
  carried(c, point, k = 0, n = point.length) {
    const o = 5 * c, f = this.frames, along = n === 3 ? point[k + 1] + point[k] * f[o + 4] : point[k], across = point[k + n - 1];
    return [f[o] + f[o + 2] * along - f[o + 3] * across, f[o + 1] + f[o + 3] * along + f[o + 2] * across];
  }
  /** A history between instants. */
  value(name, at = this.at) {
    const q = this.history(name);
    if (!q) return NaN;
    const k = Math.floor(at), f = at - k;
    return f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k];
  }
  /** A list of numbers, one an instant, between instants. */
  value2(q) {
    const k = Math.floor(this.at), f = this.at - k;
    return f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k];
  }
  /** Mass and moment of inertia of a body. */
  masses(body) { return this.scene.free.masses[body]; }
  /** How much greater a component of a load is than in the scene: in a recorded motion it is the same. */
  grown() { return 1; }
  /** Whether everything is as it was recorded. */
  get recordedNow() { return true; }
  /** The place between instants at which the axis has a value; the nearest end outside. */
  find(x) {
    const v = this.x, up = v[this.count - 1] >= v[0];
    let low = 0, high = this.count - 1;
    if (up ? x <= v[low] : x >= v[low]) return low;
    if (up ? x >= v[high] : x <= v[high]) return high;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (up ? v[middle] <= x : v[middle] >= x) low = middle; else high = middle;
    }
    return v[high] === v[low] ? low : low + (x - v[low]) / (v[high] - v[low]);
  }
}
/** Hermite's cubic where rates are known, else a straight line. */
function between(a, b, va, vb, h, f) {
  if (va === undefined || Number.isNaN(va + vb)) return a + f * (b - a);
  const g = 1 - f;
  return g * g * (1 + 2 * f) * a + f * g * g * h * va + f * f * (3 - 2 * f) * b - f * f * g * h * vb;
}
/** The place between instants of a time. */
export function locate(t, value) {
  let low = 0, high = t.length - 1;
  if (value <= t[0]) return 0;
  if (value >= t[high]) return high;
  while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] <= value) low = middle; else high = middle; }
  return low + (value - t[low]) / (t[high] - t[low]);
}
