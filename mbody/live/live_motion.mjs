// A motion whose histories are those of the present numbers of a live page.

import { DEG } from "../views/viewer/elements.mjs";
import { Motion } from "../views/viewer/motion.mjs";

const KEYS = ["x", "y", "angle", "vx", "vy", "omega", "ax", "ay", "alpha"];

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
export class LiveMotion extends Motion {
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
  get recordedNow() { return !this.here && !this.solver.changed; }
  masses(body) {
    const { model } = this.solver, [mass, inertia] = super.masses(body);
    const by = (keys) => { const name = keys.map((key) => `${body}.${key}`).find((one) => model.numbers.includes(one)); return name ? this.grown(name) : 1; };
    return [mass * by(["weight", "mass"]), inertia * by(["inertia"])];
  }
  /** How much greater a number is than in the model; of a load, one of its components. */
  grown(of, key) {
    const name = key ? `${of}.${key}` : of, first = this.solver.first.get(name);
    if (first === undefined) return 1;
    const now = this.solver.model.get(name);
    return now === first ? 1 : first ? now / first : NaN;
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
