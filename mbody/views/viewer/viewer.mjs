// The viewer of mbody: one element, <mbody-viewer>, that plays a recorded motion.
//
// Its document is {"data", "scene", "others", "made"}: `data` as `run.data()` has it, `scene` the
// shapes in the axes of what carries them. A page holds them in two scripts, a lecturer's page
// names a file: <mbody-viewer src="pump.json"></mbody-viewer>. Nothing else is ever requested.

const CSS = /*css*/"";
const SVG = "http://www.w3.org/2000/svg";
const DEG = Math.PI / 180;
const MINUS = "−";

const el = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
const sv = (name, attributes = {}, ...children) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

const power = (digits, exponent) => `${+digits}·10${String(+exponent).replace(/[-0-9]/g, (sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)])}`;
/** A number for people: so many significant digits, a true minus sign. */
export function shown(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size && (size < 1e-3 || size >= 1e7)
    ? power(...value.toExponential(digits - 1).split("e")) : String(+value.toPrecision(digits));
  return text.replaceAll("-", MINUS);
}
/** The greatest of 1, 2, 5, 10, … that is not above a positive value. */
export function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return power * [5, 2, 1].find((digit) => digit * power <= value * (1 + 1e-9));
}
function ticks(low, high, most) {
  if (!(high > low)) return [low];
  const least = (high - low) / most, below = nice(least);
  const step = [1, 2, 2.5, 5].map((by) => nice(below * by)).find((one) => one >= least * (1 - 1e-9)) ?? 10 * below;
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push(n * step);
  return found;
}

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
    for (const one of scene.plots) if (one.name === name && one.values) return full(one.values);
    if (data.measures[name]) return full(data.measures[name]);
    const cut = name.lastIndexOf("."), owner = name.slice(0, cut), key = name.slice(cut + 1);
    if (key === "effort") return full(data.efforts[owner]);
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
    this.scene.carriers.forEach((carrier, n) => this.#carry(carrier, 5 * n));
  }
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

/** The shapes of one motion as SVG, in points of the paper; moved by transforms. */
class Drawing {
  constructor(motion, layer, ghost, unit) {
    Object.assign(this, { motion, unit, groups: [], stretched: [], strokes: [], sensed: [] });
    let last = null;
    for (const shape of motion.scene.shapes) {
      const carrier = motion.scene.carriers[shape.c];
      const drawn = sv(shape.k === "c" ? "circle" : "path", { class: `s-${shape.k}` });
      drawn.style.fill = shape.k === "l" || shape.f === "none" ? "none" : `var(--${shape.f})`;
      drawn.style.stroke = shape.e === "none" ? "none" : `var(--${shape.e})`;
      drawn.setAttribute("stroke-linecap", "round");
      drawn.setAttribute("stroke-linejoin", "round");
      drawn.setAttribute("vector-effect", "non-scaling-stroke");
      if (shape.n && !ghost) drawn.dataset.name = shape.n;
      this.strokes.push([drawn, shape.w, shape.d]);
      if (shape.s) this.sensed.push([drawn, ...shape.s]);
      if (carrier.x) {
        layer.append(drawn);
        this.stretched.push([drawn, shape]);
        last = null;
        continue;
      }
      if (shape.k === "c") {
        drawn.setAttribute("cx", shape.p[0] / this.unit);
        drawn.setAttribute("cy", shape.p[1] / this.unit);
        drawn.setAttribute("r", shape.r / this.unit);
      } else drawn.setAttribute("d", path(shape, (k) => [shape.p[k], shape.p[k + 1]], 2, this.unit));
      if (last?.c !== shape.c) {
        last = { c: shape.c, g: sv("g") };
        layer.append(last.g);
        this.groups.push(last);
      }
      last.g.append(drawn);
    }
  }
  /** Widths in pixels for so many of them a point. */
  width(px) {
    for (const [drawn, width, dashes] of this.strokes) {
      drawn.setAttribute("stroke-width", (width * px).toFixed(2));
      if (dashes.length) drawn.setAttribute("stroke-dasharray", dashes.map((d) => (d * width * px).toFixed(1)).join(" "));
    }
  }
  move() {
    const { frames } = this.motion, u = this.unit;
    for (const { c, g } of this.groups) {
      const o = 5 * c, a = frames[o + 2], b = frames[o + 3];
      g.setAttribute("transform", `matrix(${a} ${b} ${-b} ${a} ${frames[o] / u} ${frames[o + 1] / u})`);
    }
    for (const [drawn, quantity, sign] of this.sensed) drawn.style.display = sign * this.motion.value(quantity) > 0 ? "" : "none";
    for (const [drawn, shape] of this.stretched) {
      drawn.setAttribute("d", path(shape, (k) => this.motion.carried(shape.c, shape.p, k, 3), 3, u));
    }
  }
}
function path(shape, at, width, unit) {
  let text = "", pen = false;
  for (let k = 0; k < shape.p.length; k += width) {
    if (shape.p[k] === null) { pen = false; continue; }
    const [x, y] = at(k);
    text += `${pen ? "L" : "M"}${(x / unit).toFixed(3)} ${(y / unit).toFixed(3)}`;
    pen = true;
  }
  return shape.k === "p" ? `${text}Z` : text;
}
/** The outline of an arrow from a place by a way, in pixels. */
function arrow(x, y, dx, dy) {
  const length = Math.hypot(dx, dy), u = dx / length, v = dy / length;
  const head = Math.min(11, 0.6 * length), w = 1.15, s = 0.4 * head, l = length - head;
  const at = (a, b) => `${(x + a * u - b * v).toFixed(1)} ${(y + a * v + b * u).toFixed(1)}`;
  return `M${at(0, w)}L${at(l, w)}L${at(l, s)}L${at(length, 0)}L${at(l, -s)}L${at(l, -w)}L${at(0, -w)}Z`;
}

/** One diagram: any quantity of the motion over its axis. */
class Plot {
  constructor(viewer, name) {
    this.viewer = viewer;
    this.select = el("select", { "aria-label": "quantity of this diagram" });
    for (const [group, names] of viewer.quantities) {
      const part = el("optgroup", { label: group });
      for (const one of names) part.append(el("option", { value: one }, one));
      this.select.append(part);
    }
    this.select.addEventListener("change", () => { this.show(this.select.value); viewer.draw(); });
    this.output = el("output");
    this.svg = sv("svg", { role: "img", tabindex: "0" });
    this.root = el("div", { class: "plot" }, el("div", { class: "head" }, this.select, this.output), this.svg);
    const go = (event) => {
      const box = this.svg.getBoundingClientRect();
      viewer.pause();
      viewer.goTo(viewer.main.find(this.low + (event.clientX - box.left - this.left) / this.wide * (this.high - this.low)));
    };
    this.svg.addEventListener("pointerdown", (event) => { this.svg.setPointerCapture(event.pointerId); go(event); });
    this.svg.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
    this.show(name);
  }
  show(name) {
    this.name = name;
    this.select.value = name;
    const motion = this.viewer.main, width = this.svg.clientWidth || 420, height = this.svg.clientHeight || 132;
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.left = 56; this.wide = Math.max(40, width - this.left - 12); this.top = 8; this.tall = height - 30;
    const curves = this.viewer.motions.map((one) => [one, one.history(name)]).filter(([, q]) => q);
    let least = Infinity, most = -Infinity;
    this.low = Infinity; this.high = -Infinity;
    for (const [one, q] of curves) {
      for (const v of q) if (Number.isFinite(v)) { least = Math.min(least, v); most = Math.max(most, v); }
      this.low = Math.min(this.low, one.x[0], one.x[one.count - 1]);
      this.high = Math.max(this.high, one.x[0], one.x[one.count - 1]);
    }
    if (!(most >= least)) { least = -1; most = 1; }
    const peak = Math.max(Math.abs(least), Math.abs(most));
    if (most - least <= 1e-9 * peak || peak === 0) { const room = peak ? 0.1 * peak : 1; least -= room; most += room; }
    const room = 0.06 * (most - least);
    this.least = least - room; this.most = most + room;
    this.high = this.high > this.low ? this.high : this.low + 1;
    this.svg.replaceChildren();
    for (const y of ticks(this.least, this.most, 4)) {
      const at = this.y(y), zero = Math.abs(y) < 1e-9 * (this.most - this.least);
      const text = sv("text", { x: this.left - 6, y: at + 4, "text-anchor": "end" });
      text.textContent = zero ? "0" : shown(y, 4);
      this.svg.append(sv("line", { class: zero ? "zero" : "grid", x1: this.left, x2: this.left + this.wide, y1: at, y2: at }), text);
    }
    const axis = motion.scene.axis;
    let steps = ticks(this.low, this.high, clamp(Math.floor(this.wide / 60), 2, 9));
    if (axis.unit === "deg") {
      const step = [5, 10, 15, 30, 45, 60, 90, 180, 360, 720].find((s) => (this.high - this.low) / s <= this.wide / 48);
      if (step) { steps = []; for (let v = Math.ceil(this.low / step - 1e-6) * step; v <= this.high + 1e-6 * step; v += step) steps.push(v); }
    }
    for (const x of steps) {
      const at = this.x(x), text = sv("text", { x: at, y: this.top + this.tall + 15, "text-anchor": "middle" });
      text.textContent = axis.unit === "deg" ? `${shown(x, 4)}°` : shown(x, 4);
      this.svg.append(sv("line", { class: "grid", x1: at, x2: at, y1: this.top, y2: this.top + this.tall }), text);
    }
    let before = -Infinity;
    for (const one of axis.values ? [] : motion.data.events ?? []) {
      const at = this.x(one.t);
      if (at < before + 4) continue; // events without number, as of a ball that comes to rest
      before = at;
      this.svg.append(sv("line", { class: "event", x1: at, x2: at, y1: this.top, y2: this.top + this.tall }));
    }
    curves.reverse().forEach(([one, q]) => {
      const n = this.viewer.motions.indexOf(one);
      let text = "", pen = false;
      for (let k = 0; k < q.length; k++) {
        if (!Number.isFinite(q[k])) { pen = false; continue; }
        text += `${pen ? "L" : "M"}${this.x(one.x[k]).toFixed(1)} ${this.y(q[k]).toFixed(1)}`;
        pen = true;
      }
      const color = this.viewer.motions.length > 1 ? n : 0;
      this.svg.append(sv("path", { class: n ? "curve other" : "curve", d: text, style: `stroke: var(--c${color % 6})` }));
    });
    this.q = motion.history(name);
    this.cursor = sv("line", { class: "cursor", y1: this.top, y2: this.top + this.tall });
    this.dot = sv("circle", { r: 3.4, style: "fill: var(--text)" });
    this.svg.append(this.cursor, this.dot);
    this.unit = this.viewer.unitOf(name);
    const label = `${name}${this.unit ? ` in ${this.unit}` : ""} over ${axis.label}: from ${shown(least + 0)} to ${shown(most + 0)}`;
    this.svg.setAttribute("aria-label", label);
  }
  x(value) { return this.left + (value - this.low) / (this.high - this.low) * this.wide; }
  y(value) { return this.top + (this.most - value) / (this.most - this.least) * this.tall; }
  move() {
    const motion = this.viewer.main, value = motion.value(this.name), x = this.x(motion.value2(motion.x));
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const there = Number.isFinite(value);
    this.dot.style.display = there ? "" : "none";
    if (there) { this.dot.setAttribute("cx", x); this.dot.setAttribute("cy", this.y(value)); }
    this.output.textContent = `${shown(value)}${this.unit ? ` ${this.unit}` : ""}`;
  }
}
Motion.prototype.value2 = function value2(q) {
  const k = Math.floor(this.at), f = this.at - k;
  return f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k];
};

const SWITCHES = [
  ["names", "Names", "n", true], ["forces", "Forces", "f", false], ["velocities", "Velocities", "v", false],
  ["accelerations", "Accelerations", "a", false], ["paths", "Paths", "p", true], ["centres", "Mass centres", "c", true],
  ["ghosts", "Other designs", "g", true],
];

export class Viewer extends HTMLElement {
  /** What solves the model again while the user drags: set by the core for the browser, null where the motion is recorded. */
  live = null;

  /** Attach what solves the model again; the page no longer says that it shows a recorded motion. */
  attach(live) {
    this.live = live;
    if (this.recorded) this.recorded.hidden = Boolean(live);
  }

  async connectedCallback() {
    if (this.shadowRoot) return;
    this.attachShadow({ mode: "open" });
    if (CSS) this.shadowRoot.append(el("style", {}, CSS));
    else this.shadowRoot.append(el("link", { rel: "stylesheet", href: new URL("viewer.css", import.meta.url) }));
    this.root = el("div", { class: "mbody", tabindex: "-1" });
    this.shadowRoot.append(this.root);
    try {
      this.show(await this.#document());
    } catch (error) {
      this.root.replaceChildren(el("p", { role: "alert" }, `This motion cannot be shown: ${error.message}`));
      throw error;
    }
  }
  disconnectedCallback() { this.pause(); this.watch?.disconnect(); }

  async #document() {
    const src = this.getAttribute("src");
    if (src) {
      const answer = await fetch(src);
      if (!answer.ok) throw new Error(`'${src}' was not found (${answer.status})`);
      return answer.json();
    }
    const inside = this.querySelector('script[type="application/json"]');
    if (inside) return JSON.parse(inside.textContent);
    const read = (key) => JSON.parse(document.getElementById(this.getAttribute(key)).textContent);
    return { data: read("data"), ...read("scene") };
  }

  /** Show a document: {data, scene, others, made}. */
  show(content) {
    this.content = content;
    const { data, scene, others = [], made = {} } = content;
    this.main = new Motion(data, scene);
    this.motions = [this.main, ...others.map((one) => new Motion(one.data, one.scene))];
    this.made = made;
    this.at = 0;
    this.on = Object.fromEntries(SWITCHES.map(([key, , , first]) => [key, scene.on?.includes(key) ?? first]));
    this.quantities = this.#quantities();
    this.#build();
    this.#fit();
    this.draw();
    this.#say();
    if (this.hasAttribute("whole")) window.mbody = this.#door();
    this.dispatchEvent(new CustomEvent("ready"));
  }

  #quantities() {
    const { data, scene } = this.main, found = [];
    const add = (group, names) => { if (names.length) found.push([group, names]); };
    const fields = (table, keys) => Object.entries(table ?? {}).flatMap(([name, own]) =>
      keys.filter((key) => Array.isArray(own[key]) || (key === "force" && own.fx)).map((key) => `${name}.${key}`));
    add("measures", [...new Set([...scene.plots.map((one) => one.name).filter((n) => !n.includes(".") || data.measures[n] || scene.plots.find((p) => p.name === n).values),
      ...Object.keys(data.measures).filter((name) => data.measures[name])])]);
    add("drivers", [...Object.keys(data.efforts).map((name) => `${name}.effort`), ...fields(scene.driven, ["value", "rate", "acceleration"])]);
    add("joints", fields(data.reactions, ["force", "fx", "fy", "torque"]));
    add("loads", fields(data.loads, ["force", "fx", "fy", "torque", "length", "angle", "rate"]));
    const bodies = this.main.count * Object.keys(data.bodies).length > 2e5 ? {} : data.bodies;
    add("bodies", fields(bodies, ["angle", "omega", "alpha", "x", "y", "vx", "vy", "ax", "ay"]));
    add("points", fields(data.points, ["x", "y", "vx", "vy", "ax", "ay"]));
    return found;
  }
  unitOf(name) {
    const { scene, data } = this.main, units = scene.units;
    const plotted = scene.plots.find((one) => one.name === name);
    if (plotted) return plotted.unit;
    if (name in (scene.measures ?? {})) return scene.measures[name];
    const cut = name.lastIndexOf("."), owner = name.slice(0, cut), key = name.slice(cut + 1);
    const turns = scene.turns[owner];
    if (key === "effort") return turns ? units.torque : units.force;
    if (key === "value") return turns ? "deg" : units.length;
    if (key === "rate" || key === "acceleration") {
      const angular = turns ?? Boolean(data.loads[owner]?.angle);
      return key === "rate" ? (angular ? units.omega : units.v) : (angular ? units.alpha : units.a);
    }
    return { x: units.length, y: units.length, length: units.length, angle: "deg", vx: units.v, vy: units.v, omega: units.omega,
      ax: units.a, ay: units.a, alpha: units.alpha, fx: units.force, fy: units.force, force: units.force, torque: units.torque }[key] ?? "";
  }

  // -- building -------------------------------------------------------------------------------

  #build() {
    const { data, scene } = this.main, root = this.root;
    root.replaceChildren();
    const button = (text, attributes, act) => {
      const made = el("button", { type: "button", ...attributes }, text);
      made.addEventListener("click", act);
      return made;
    };
    const title = el("h1", {}, data.model);
    const head = el("header", {}, title, button("Dark / light", { title: "change between dark and light" }, () => this.#theme(!root.classList.contains("dark"))));
    if (this.made.file) head.append(button("Model file", { title: `save ${this.made.name}` }, () => this.#save()));
    this.where = el("p", { class: "where" });
    this.stage = el("div", { class: "stage" });
    this.svg = sv("svg", { role: "img", tabindex: "0", "aria-label": `Picture of ${data.model}, moved by the controls below` });
    const layers = {};
    for (const name of ["ghosts", "paths", "world"]) this.svg.append(layers[name] = sv("g", { class: name }));
    for (const name of ["arrows", "names", "key"]) this.svg.append(layers[name] = sv("g", { class: name }));
    this.layers = layers;
    this.tip = el("div", { class: "tip", hidden: "" });
    this.stage.append(this.svg, el("div", { class: "zoom" },
      button("+", { title: "zoom in (+)", "aria-label": "zoom in" }, () => this.zoom(1.3)),
      button(MINUS, { title: "zoom out (−)", "aria-label": "zoom out" }, () => this.zoom(1 / 1.3)),
      button("Fit", { title: "show the whole motion (0)" }, () => { this.#fit(); this.draw(); })), this.tip);
    this.drawings = this.motions.map((motion, n) => {
      const layer = n ? layers.ghosts.appendChild(sv("g", { class: "ghost" })) : layers.world;
      return new Drawing(motion, layer, n > 0, scene.unit);
    });
    this.centres = layers.world.querySelectorAll('[data-name^="cg:"], [data-name^="tie:"]');
    this.#overlay();

    this.playing = false;
    this.playButton = button("Play", { class: "play", "aria-keyshortcuts": "Space" }, () => (this.playing ? this.pause() : this.play()));
    this.scrub = el("input", { class: "scrub", type: "range", min: 0, max: this.main.count - 1, step: 1, value: 0, "aria-label": "instant" });
    this.scrub.addEventListener("input", () => { this.pause(); this.goTo(+this.scrub.value); });
    this.speed = el("select", { "aria-label": "speed" });
    for (const factor of [0.1, 0.25, 0.5, 1, 2, 4]) this.speed.append(el("option", { value: factor }, `${factor} ×`));
    this.speed.value = "1";
    this.speed.addEventListener("change", () => this.draw());
    const bar = el("div", { class: "bar" }, this.playButton,
      button("◂", { title: "one instant back (←)", "aria-label": "one instant back" }, () => this.step(-1)),
      button("▸", { title: "one instant on (→)", "aria-label": "one instant on" }, () => this.step(1)),
      this.scrub, el("label", {}, "Speed ", this.speed));
    const toggles = el("div", { class: "bar", role: "group", "aria-label": "what is shown" });
    this.switches = {};
    for (const [key, text, shortcut] of SWITCHES) {
      if (!this.#has(key)) continue;
      const made = button(text, { "aria-pressed": this.on[key], title: `${text.toLowerCase()} on and off (${shortcut})`, "aria-keyshortcuts": shortcut }, () => this.toggle(key));
      toggles.append(this.switches[key] = made);
    }
    this.size = el("input", { class: "size", type: "range", min: -2, max: 2, step: 0.1, value: 0, "aria-label": "length of the arrows" });
    this.size.addEventListener("input", () => this.draw());
    toggles.append(el("label", {}, "Arrows ", this.size));

    const left = el("div", {}, this.stage, bar, toggles);
    this.plotBox = el("div", { class: "plots" });
    this.body = el("div", { class: "body" }, left, this.plotBox);
    this.said = el("div", { class: "said", "aria-live": "polite" });
    root.append(head, this.where, this.body, this.said);
    if (this.motions.length > 1) {
      const legend = el("div", { class: "legend" });
      this.motions.forEach((one, n) => legend.append(el("span", {}, el("i", { style: `border-color: var(--c${n % 6})` }), one.scene.design || data.model)));
      this.where.after(legend);
    }
    root.append(this.#values(), this.#about());
    this.plots = [];
    const over = `over ${scene.axis.label}${scene.axis.unit && scene.axis.unit !== "deg" ? ` [${scene.axis.unit}]` : ""}`;
    for (const one of scene.plots.slice(0, 3)) {
      const plot = new Plot(this, one.name);
      this.plotBox.append(plot.root);
      this.plots.push(plot);
    }
    if (this.plots.length) this.plotBox.append(el("p", { class: "over" }, over));
    this.#theme(null);
    this.#listen();
  }
  #has(key) {
    const { scene } = this.main;
    return { names: scene.labels.length, forces: scene.forces.length, velocities: scene.movers.length, accelerations: scene.movers.length && scene.rates,
      paths: scene.movers.length, centres: scene.shapes.some((s) => s.n.startsWith("cg:")), ghosts: this.motions.length > 1 }[key];
  }
  #overlay() {
    const { scene } = this.main, { arrows, names, paths } = this.layers;
    this.labels = scene.labels.map((label) => {
      const text = sv("text", { "dominant-baseline": "central" });
      for (const [part, how] of label.t) {
        const span = sv("tspan", how === "sub" ? { class: "sub", dy: "4" } : {});
        span.textContent = part;
        text.append(span);
      }
      if (label.e) text.style.fill = `var(--${label.e})`;
      if (!label.i) text.classList.add("upright");
      names.append(text);
      return { ...label, text, wide: 0, tall: 13 };
    });
    const make = (color, name) => {
      const drawn = sv("path", { "data-name": name });
      drawn.style.fill = `var(--${color})`;
      arrows.append(drawn);
      return drawn;
    };
    this.arrows = [];
    const peak = (lists) => {
      let most = 0;
      for (const [x, y] of lists) for (let k = 0; k < (x?.length ?? 0); k++) { const r = Math.hypot(x[k], y[k]); if (Number.isFinite(r)) most = Math.max(most, r); }
      return most;
    };
    const add = (kind, color, list) => {
      const most = peak(list.map((one) => [one.x, one.y]));
      for (const one of list) {
        const text = one.label ? sv("text", { style: `fill: var(--${color})` }) : null;
        if (text) arrows.append(text);
        this.arrows.push({ kind, most, path: make(color, one.name), text, ...one });
      }
      return most;
    };
    const m = this.main;
    this.most = {
      forces: add("forces", "force", scene.forces.map((f) => ({ name: f.n, x: m.history(`${f.of}.fx`), y: m.history(`${f.of}.fy`), sign: f.sign, at: f.at, places: f.places, label: scene.forces.length > 30 ? null : f.t, color: f.load ? "load" : "force" }))),
      velocities: add("velocities", "speed", scene.movers.map((p) => ({ name: `v:${p.n}`, x: m.history(`${p.n}.vx`), y: m.history(`${p.n}.vy`), sign: 1, at: p.at }))),
      accelerations: scene.rates ? add("accelerations", "change", scene.movers.map((p) => ({ name: `a:${p.n}`, x: m.history(`${p.n}.ax`), y: m.history(`${p.n}.ay`), sign: 1, at: p.at }))) : 0,
    };
    for (const one of this.arrows) if (one.color) { one.path.style.fill = `var(--${one.color})`; if (one.text) one.text.style.fill = `var(--${one.color})`; }
    this.tracks = this.motions.flatMap((motion, n) => motion.scene.movers.map((p) => {
      const x = motion.history(`${p.n}.x`), y = motion.history(`${p.n}.y`), u = scene.unit;
      const drawn = sv("path", { "data-name": `path:${p.n}`, fill: "none", "stroke-width": 1.4, "stroke-dasharray": n ? "2 3" : "6 4", "vector-effect": "non-scaling-stroke" });
      drawn.style.stroke = n ? `var(--c${n % 6})` : "var(--soft)";
      paths.append(drawn);
      return { name: p.n, drawn, on: motion.scene.paths.includes(p.n), d: () => {
        let text = "";
        for (let k = 0; k < x.length; k++) text += `${k ? "L" : "M"}${(x[k] / u).toFixed(2)} ${(y[k] / u).toFixed(2)}`;
        return text;
      } };
    }));
    this.#tracks();
  }
  #tracks() {
    for (const one of this.tracks) {
      if (one.on && !one.drawn.hasAttribute("d")) one.drawn.setAttribute("d", one.d());
      one.drawn.style.display = one.on ? "" : "none";
    }
  }
  /** Show the path of a point, or hide it. */
  trace(name, on) {
    for (const one of this.tracks) if (one.name === name) one.on = on ?? !one.on;
    this.#tracks();
  }
  #values() {
    this.table = el("table");
    this.tableBox = el("details", {}, el("summary", {}, "All values at this instant"), el("div", { class: "table", tabindex: "0" }, this.table));
    this.tableBox.addEventListener("toggle", () => this.#tabulate());
    return this.tableBox;
  }
  #tabulate() {
    if (!this.tableBox.open || this.playing) return;
    const rows = [el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "quantity"), el("th", { scope: "col" }, "value"), el("th", { scope: "col" }, "unit")))];
    const body = el("tbody");
    for (const [, names] of this.quantities) for (const name of names.slice(0, 400)) {
      body.append(el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, shown(this.main.value(name), 7)), el("td", {}, this.unitOf(name))));
    }
    this.table.replaceChildren(...rows, body);
  }
  #about() {
    const { data, scene } = this.main, made = this.made, lines = [];
    const notes = el("ul", { class: "notes" });
    for (const text of [...(data.doubts ?? []).map((d) => `In doubt: ${d.message ?? d}`), ...(data.notes ?? []), ...(scene.notes ?? [])]) notes.append(el("li", {}, text));
    this.recorded = el("li", {}, `This page shows the recorded motion, ${this.main.count} instants; it does not solve the model again.`);
    this.recorded.hidden = Boolean(this.live);
    notes.append(this.recorded);
    lines.push(`${data.analysis} by mbody ${data.mbody}: ${data.status}.`);
    if (made.command) lines.push("Made by: ", el("code", {}, made.command));
    const about = el("details", {}, el("summary", {}, "How this was made"), el("p", {}, ...lines.flatMap((l) => [l, " "])));
    if (data.digest) about.append(el("p", {}, "SHA-256 of the model file: ", el("code", {}, data.digest)));
    if (made.why) about.append(el("p", {}, made.why));
    about.append(el("p", {}, "Keys: Space plays, ← and → step (with Shift by ten), Home and End, + and − zoom, 0 fits, n f v a p c g switch what is shown. Drag moves the picture, a click on a pin or point shows its path."));
    return el("div", {}, notes, about);
  }
  #theme(dark) {
    const system = matchMedia("(prefers-color-scheme: dark)");
    if (dark === null && !this.themed) { this.themed = true; system.addEventListener("change", (event) => this.#theme(event.matches)); }
    const own = this.getAttribute("theme");
    const is = dark ?? (own ? own === "dark" : system.matches);
    this.root.classList.toggle("dark", is);
    this.root.classList.toggle("light", !is);
    if (this.hasAttribute("whole")) document.documentElement.style.background = is ? "#151b21" : "#ffffff";
  }
  #save() {
    const link = el("a", { href: URL.createObjectURL(new Blob([this.made.file], { type: "application/toml" })), download: this.made.name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // -- the user -------------------------------------------------------------------------------

  #listen() {
    const svg = this.svg, fingers = new Map();
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0016 * event.deltaY), this.#here(event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, this.#here(event));
      this.moved = 0;
    });
    svg.addEventListener("pointermove", (event) => {
      const here = this.#here(event), before = fingers.get(event.pointerId);
      if (!before) return this.#hover(event, here);
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      if (others.length) {
        const [o] = others, old = Math.hypot(before[0] - o[0], before[1] - o[1]), now = Math.hypot(here[0] - o[0], here[1] - o[1]);
        if (old > 0) this.zoom(now / old, o);
      } else {
        this.camera.x += here[0] - before[0];
        this.camera.y += here[1] - before[1];
        this.moved += Math.abs(here[0] - before[0]) + Math.abs(here[1] - before[1]);
        this.draw();
      }
      fingers.set(event.pointerId, here);
    });
    const up = (event) => {
      fingers.delete(event.pointerId);
      if (this.moved < 4 && event.type === "pointerup") this.#clicked(this.#here(event));
    };
    svg.addEventListener("pointerup", up);
    svg.addEventListener("pointercancel", up);
    svg.addEventListener("pointerleave", () => { this.tip.hidden = true; this.hovered = null; });
    if (!this.keyed) {
      this.keyed = true;
      this.root.addEventListener("keydown", (event) => this.#key(event));
      if (this.hasAttribute("whole")) document.addEventListener("keydown", (event) => { if (event.target === document.body) this.#key(event); });
      this.watch = new ResizeObserver(() => this.#resized());
      this.watch.observe(this);
    }
  }
  #here(event) {
    const box = this.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.composedPath()[0], tag = target.tagName;
    if (tag === "SELECT" || (tag === "INPUT" && event.key !== " ")) return;
    if ((tag === "BUTTON" || tag === "SUMMARY") && (event.key === " " || event.key === "Enter")) return;
    const by = event.shiftKey ? 10 : 1, own = SWITCHES.find(([, , key]) => key === event.key.toLowerCase());
    const acts = { " ": () => (this.playing ? this.pause() : this.play()), ArrowLeft: () => this.step(-by), ArrowRight: () => this.step(by),
      Home: () => { this.pause(); this.goTo(0); }, End: () => { this.pause(); this.goTo(this.main.count - 1); },
      "+": () => this.zoom(1.3), "-": () => this.zoom(1 / 1.3), 0: () => { this.#fit(); this.draw(); } };
    const act = acts[event.key] ?? (own && this.switches[own[0]] ? () => this.toggle(own[0]) : null);
    if (act) { event.preventDefault(); act(); }
  }
  #resized() {
    const before = this.wide;
    this.#sized();
    if (before === this.wide) return;
    this.#fit();
    for (const plot of this.plots) plot.show(plot.name);
    this.draw();
  }
  #hover(event, here) {
    const found = event.composedPath().find((one) => one.dataset?.name);
    this.hovered = found?.dataset.name ?? null;
    this.tip.hidden = !this.hovered;
    if (!this.hovered) return;
    this.#describe();
    const box = this.stage.getBoundingClientRect(), right = here[0] > box.width - 230;
    this.tip.style.left = right ? "" : `${here[0] + 14}px`;
    this.tip.style.right = right ? `${box.width - here[0] + 10}px` : "";
    this.tip.style.top = `${Math.max(4, Math.min(here[1] + 12, box.height - 130))}px`;
  }
  #describe() {
    const [kind, ...rest] = this.hovered.split(":"), name = rest.join(":"), { data, scene } = this.main;
    const owner = (table) => (name in (table ?? {}) ? name : name.replace(/\.[^.]*$/, ""));
    const rows = [];
    const add = (of, keys) => { for (const key of keys) { const v = this.main.value(`${of}.${key}`); if (Number.isFinite(v)) rows.push([key, v, this.unitOf(`${of}.${key}`)]); } };
    let text = name;
    const forced = scene.forces.find((f) => f.n === this.hovered);
    if (forced) { text = forced.t.map(([part]) => part).join(""); add(forced.of, ["force", "fx", "fy", "torque"]); }
    else if (kind === "v") add(name, ["vx", "vy", "omega"]);
    else if (kind === "a") add(name, ["ax", "ay", "alpha"]);
    else if (kind === "point" || kind === "path") add(name, ["x", "y", "vx", "vy"]);
    else if (kind === "cg" || kind === "link" || kind === "tie") {
      text = kind === "link" ? `link ${name}` : `mass centre of ${name}`;
      add(name, kind === "link" ? ["angle", "omega", "alpha", "x", "y"] : ["x", "y", "vx", "vy", "ax", "ay"]);
    } else {
      const joint = owner(data.reactions), load = owner(data.loads), driver = owner(scene.driven);
      if (data.reactions[joint]) { text = `joint ${joint}`; add(joint, ["force", "fx", "fy", "torque"]); }
      else if (data.loads?.[load]) { text = load; add(load, ["force", "torque", "length", "angle", "rate"]); }
      else if (scene.driven[driver]) { text = `driver ${driver}`; add(driver, ["value", "rate", "effort"]); }
      else if (data.efforts[name] !== undefined) add(name, ["effort"]);
    }
    const table = el("table");
    for (const [key, value, unit] of rows.slice(0, 7)) table.append(el("tr", {}, el("td", {}, key), el("td", {}, shown(value)), el("td", {}, unit)));
    this.tip.replaceChildren(el("b", {}, text), table);
  }
  #clicked([x, y]) {
    let best = 14, name = null;
    for (const one of this.main.scene.movers) {
      const [px, py] = this.#screen(this.main.place(one.at)), away = Math.hypot(px - x, py - y);
      if (away < best) { best = away; name = one.n; }
    }
    if (name) {
      if (!this.on.paths) this.toggle("paths");
      this.trace(name);
    }
  }
  toggle(key) {
    this.on[key] = !this.on[key];
    this.switches[key]?.setAttribute("aria-pressed", this.on[key]);
    this.draw();
    this.said.textContent = `${SWITCHES.find(([k]) => k === key)[1]} ${this.on[key] ? "on" : "off"}`;
  }

  // -- the camera -----------------------------------------------------------------------------

  #sized() {
    const { low, high } = this.main.scene.box;
    this.wide = this.stage.clientWidth || 800;
    this.body.classList.toggle("wide", this.root.clientWidth > 880 && this.plots.length > 0);
    this.wide = this.stage.clientWidth || 800;
    const ratio = (high[1] - low[1]) / Math.max(high[0] - low[0], 1e-300);
    const least = this.body.classList.contains("wide") ? 360 : 240;
    this.tall = Math.round(clamp(this.wide * clamp(ratio, 0.35, 0.9) + 50, least, Math.max(300, 0.72 * (window.innerHeight || 800))));
    this.stage.style.height = `${this.tall}px`;
  }
  #fit() {
    this.#sized();
    this.#frame([34, 34, 34, 34]);
    // once more, with room for the arrows that are shown
    const edges = [34, 34, 34, 34], size = 90 * 2 ** +this.size.value, m = this.main, tall = this.tall - 16;
    const shown = this.arrows.filter((one) => this.on[one.kind] && one.most > 0 && one.x);
    for (let n = 0; shown.length && n < 24; n++) {
      const k = Math.round(n / 23 * (m.count - 1));
      m.set(k);
      for (const one of shown) {
        const by = one.sign * size / one.most;
        const [x, y] = this.#screen(one.places ? [one.places.x[k], one.places.y[k]] : m.place(one.at)), dx = by * one.x[k], dy = -by * one.y[k];
        if (!Number.isFinite(x + y + dx + dy)) continue;
        const room = one.text ? 36 : 8;
        [-(x + dx), x + dx - this.wide, -(y + dy), y + dy - tall].forEach((over, side) => { edges[side] = Math.max(edges[side], Math.min(34 + over + room, 0.25 * this.wide)); });
      }
    }
    this.#frame(edges);
  }
  /** The camera that shows the whole motion, with so many pixels left, right, above and below. */
  #frame([left, right, above, below]) {
    const { low, high } = this.main.scene.box, unit = this.main.scene.unit, wide = this.wide - left - right, tall = this.tall - 16 - above - below;
    const s = Math.max(Math.min(wide / ((high[0] - low[0]) / unit), tall / ((high[1] - low[1]) / unit), 4), 1e-3);
    this.camera = { s, x: left + 0.5 * wide - s * 0.5 * (low[0] + high[0]) / unit, y: above + 0.5 * tall + s * 0.5 * (low[1] + high[1]) / unit };
    this.fitted = s;
  }
  /** Zoom by a factor about a place of the picture, in pixels. */
  zoom(factor, [x, y] = [0.5 * this.wide, 0.5 * this.tall]) {
    const c = this.camera, by = clamp(c.s * factor, this.fitted / 20, this.fitted * 200) / c.s;
    Object.assign(c, { s: c.s * by, x: x + by * (c.x - x), y: y + by * (c.y - y) });
    this.draw();
  }
  #screen([x, y]) {
    const c = this.camera, u = this.main.scene.unit;
    return [c.x + c.s * x / u, c.y - c.s * y / u];
  }

  // -- time -----------------------------------------------------------------------------------

  /** Seconds that the whole motion takes on the screen. */
  get lasts() {
    const span = this.main.t[this.main.count - 1] - this.main.t[0];
    const own = span * this.main.scene.second;
    return own >= 2 && own <= 20 ? own : Math.min(8, Math.max(4, this.main.count / 60));
  }
  play() {
    if (this.playing) return;
    if (this.at >= this.main.count - 1) this.at = 0;
    this.playing = true;
    this.playButton.textContent = "Pause";
    let last = null;
    const frame = (now) => {
      if (!this.playing) return;
      if (last !== null) this.#advance((now - last) / 1000);
      last = now;
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  #advance(seconds) {
    const m = this.main, part = seconds * this.speed.value / this.lasts, end = m.count - 1;
    if (m.t[end] > m.t[0]) {
      let t = this.time() + part * (m.t[end] - m.t[0]);
      if (t >= m.t[end]) t = m.t[0] + (t - m.t[end]) % (m.t[end] - m.t[0]);
      this.at = locate(m.t, t);
    } else this.at = (this.at + part * end) % (end || 1);
  }
  time() {
    const t = this.main.t, k = Math.floor(this.at), f = this.at - k;
    return f && k + 1 < t.length ? t[k] + f * (t[k + 1] - t[k]) : t[k];
  }
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.playButton.textContent = "Play";
    this.goTo(Math.round(this.at));
  }
  step(by) { this.pause(); this.goTo(clamp(Math.round(this.at) + by, 0, this.main.count - 1)); }
  /** Go to an instant, by its number; parts lie between instants. */
  goTo(at) {
    this.at = this.playing ? at : Math.round(at);
    this.draw();
    this.#say();
    this.#tabulate();
  }
  /** Go to a time, or with {instant: n} to an instant. */
  seek(to) {
    const m = this.main;
    if (typeof to === "object") return this.goTo(clamp(to.instant, 0, m.count - 1));
    return this.goTo(m.t[m.count - 1] > m.t[0] ? locate(m.t, to) : clamp(to, 0, m.count - 1));
  }
  /** What scripts on the page use; `state` is a function, and has its entries as properties too. */
  #door() {
    const state = () => this.state();
    for (const key of Object.keys(this.state())) Object.defineProperty(state, key, { get: () => this.state()[key] });
    return { viewer: this, state, play: () => this.play(), pause: () => this.pause(), seek: (to) => this.seek(to) };
  }
  state() {
    return { instant: Math.round(this.at), instants: this.main.count, t: this.time(), x: this.main.value2(this.main.x), playing: this.playing, shown: { ...this.on } };
  }
  #position() {
    const { scene } = this.main, x = this.main.value2(this.main.x), unit = scene.axis.unit === "deg" ? "°" : scene.axis.unit ? ` ${scene.axis.unit}` : "";
    const parts = [`${scene.axis.label}${scene.axis.unit === "deg" || scene.axis.label === "instant" ? "" : " ="} ${scene.axis.unit === "deg" ? x.toFixed(1).replace("-", MINUS) : shown(x, 4)}${unit}`];
    if (scene.axis.values && this.main.t[this.main.count - 1] > this.main.t[0]) parts.push(`t = ${shown(this.time(), 4)} ${scene.units.time}`);
    return parts.join(", ");
  }
  #say() {
    if (this.playing) return;
    const values = this.plots.map((plot) => `${plot.name} ${plot.output.textContent}`);
    this.said.textContent = [`instant ${Math.round(this.at) + 1} of ${this.main.count}`, this.#position(), ...values].join(", ");
  }

  // -- a frame --------------------------------------------------------------------------------

  draw() {
    const m = this.main, c = this.camera;
    m.set(this.at);
    if (this.on.ghosts) for (const one of this.motions.slice(1)) one.set(one.find(m.value2(m.x)));
    if (this.scaled !== c.s) {
      this.scaled = c.s;
      const px = clamp(c.s, 0.55, 1.9);
      for (const drawing of this.drawings) drawing.width(px);
    }
    const matrix = `matrix(${c.s} 0 0 ${-c.s} ${c.x} ${c.y})`;
    for (const name of ["world", "ghosts", "paths"]) this.layers[name].setAttribute("transform", matrix);
    this.drawings[0].move();
    this.layers.ghosts.style.display = this.on.ghosts ? "" : "none";
    if (this.on.ghosts) for (const drawing of this.drawings.slice(1)) drawing.move();
    this.layers.paths.style.display = this.on.paths ? "" : "none";
    if (this.showedCentres !== this.on.centres) {
      this.showedCentres = this.on.centres;
      for (const one of this.centres) one.style.display = this.on.centres ? "" : "none";
    }
    this.#arrows();
    this.#names();
    this.#scales();
    for (const plot of this.plots) plot.move();
    this.scrub.value = Math.round(this.at);
    const text = this.#position();
    if (this.where.textContent !== text) this.where.textContent = text;
    this.scrub.setAttribute("aria-valuetext", text);
    if (this.hovered) this.#describe();
  }
  #arrows() {
    const m = this.main, k = Math.floor(this.at), f = this.at - k, size = 90 * 2 ** +this.size.value;
    const at = (q) => (f && k + 1 < q.length ? q[k] + f * (q[k + 1] - q[k]) : q[k]);
    for (const one of this.arrows) {
      const visible = this.on[one.kind] && one.most > 0 && one.x;
      const by = visible ? one.sign * size / one.most : 0, dx = visible ? by * at(one.x) : 0, dy = visible ? -by * at(one.y) : 0;
      const long = Math.hypot(dx, dy);
      if (!(long > 2.5)) {
        if (one.seen !== false) { one.path.style.display = "none"; if (one.text) one.text.style.display = "none"; one.seen = false; }
        continue;
      }
      const [x, y] = this.#screen(one.places ? [at(one.places.x), at(one.places.y)] : m.place(one.at));
      one.path.setAttribute("d", arrow(x, y, dx, dy));
      if (one.text) {
        const u = dx / long, v = dy / long;
        if (!one.text.firstChild) for (const [part, how] of one.label) { const span = sv("tspan", how === "sub" ? { "font-size": "10", dy: "3" } : {}); span.textContent = part; one.text.append(span); }
        one.text.setAttribute("x", (x + dx + 12 * u).toFixed(1));
        one.text.setAttribute("y", (y + dy + 10 * v + 4).toFixed(1));
        one.text.setAttribute("text-anchor", u > 0.35 ? "start" : u < -0.35 ? "end" : "middle");
      }
      if (one.seen !== true) { one.path.style.display = ""; if (one.text) one.text.style.display = ""; one.seen = true; }
    }
  }
  #names() {
    const on = this.on.names;
    this.layers.names.style.display = on ? "" : "none";
    if (!on) return;
    const m = this.main, px = this.camera.s / m.scene.unit;
    for (const label of this.labels) {
      if (!label.wide) { const box = label.text.getBBox?.(); label.wide = box?.width || 8 * label.t.length; }
      const [x, y] = this.#screen(m.carried(label.c, label.a, 0));
      let [ux, uy] = label.u;
      if (label.turns) {
        const o = 5 * label.c, f = m.frames;
        [ux, uy] = [f[o + 2] * ux - f[o + 3] * uy, f[o + 3] * ux + f[o + 2] * uy];
      }
      const w = 0.5 * label.wide + 2, h = 0.5 * label.tall;
      const gap = label.g * px + 2;
      const reach = !ux && !uy ? 0 : label.turns ? gap + w * Math.abs(ux) + h * Math.abs(uy) : gap + Math.min(w / Math.max(Math.abs(ux), 1e-9), h / Math.max(Math.abs(uy), 1e-9));
      label.text.setAttribute("transform", `translate(${(x + reach * ux).toFixed(1)} ${(y - reach * uy).toFixed(1)})`);
    }
  }
  /** The scale of lengths, and of the arrows that are shown. */
  #scales() {
    const { scene } = this.main, px = this.camera.s / scene.unit, size = 2 ** +this.size.value;
    const state = [px, size, this.wide, this.tall, this.on.forces, this.on.velocities, this.on.accelerations].join();
    if (state === this.keyState) return;
    this.keyState = state;
    const length = nice(Math.max(70 / px, 1e-300)), y = this.tall - 14;
    let x = 14;
    this.layers.key.replaceChildren();
    const put = (text, color) => {
      const made = sv("text", { x, y: y + 4, style: `fill: var(--${color})` });
      made.textContent = text;
      this.layers.key.append(made);
      x += 8.2 * text.length + 18;
    };
    const wide = length * px;
    this.layers.key.append(sv("path", { d: `M${x} ${y - 4}V${y + 4}M${x} ${y}H${x + wide}M${x + wide} ${y - 4}V${y + 4}`, style: "stroke: var(--soft); fill: none", "stroke-width": 1.4 }));
    x += wide + 7;
    put(`${shown(length)} ${scene.units.length}`, "soft");
    for (const [kind, color, unit] of [["forces", "force", scene.units.force], ["velocities", "speed", scene.units.v], ["accelerations", "change", scene.units.a]]) {
      if (!this.on[kind] || !(this.most[kind] > 0)) continue;
      const value = nice(0.6 * this.most[kind] / size), long = 90 * size * value / this.most[kind];
      const drawn = sv("path", { d: arrow(x, y, long, 0), style: `fill: var(--${color})` });
      this.layers.key.append(drawn);
      x += long + 7;
      put(`${shown(value)} ${unit}`, color);
    }
  }
}
/** The place between instants of a time. */
function locate(t, value) {
  let low = 0, high = t.length - 1;
  if (value <= t[0]) return 0;
  if (value >= t[high]) return high;
  while (high - low > 1) { const middle = (low + high) >> 1; if (t[middle] <= value) low = middle; else high = middle; }
  return low + (value - t[low]) / (t[high] - t[low]);
}

if (!customElements.get("mbody-viewer")) customElements.define("mbody-viewer", Viewer);
