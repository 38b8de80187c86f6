// The paper of the board: grid and scale, the mechanism at one position, names, forces and marks.

import { DEG, clamp, nice, shown, sv } from "./viewer/elements.mjs";
import { Drawing } from "./viewer/drawing.mjs";
import { Motion } from "./viewer/motion.mjs";
import { Sheet } from "./viewer/sheet.mjs";
import { ARROW_WEIGHT, around, atArrow, write } from "./viewer/names.mjs";

/** Pixels of a point of the shapes, of the longest arrow, and between lines of the grid. */
const PT = 1.3, LONGEST = 85, GRID = 26;
/** Lengths across an empty page, by the unit of length. */
const ACROSS = { mm: 120, cm: 60, m: 1.5, in: 20, ft: 8 };
const LAYERS = ["picture", "grid", "ghosts", "paths", "world", "arrows", "names", "scale", "marks"];

/** A name with its number below the line: "A2" as A₂. */
const runs = (name) => { const parts = /^(.*?[^\d_])_?(\d+)$/.exec(name); return parts ? [[parts[1], ""], [parts[2], "sub"]] : [[name, ""]]; };
const text = (attributes, content) => { const made = sv("text", attributes); made.textContent = content; return made; };

export class Paper extends Sheet {
  constructor(label) {
    super(LAYERS, { id: "paper", tabindex: "0", role: "application", "aria-label": label, "aria-describedby": "paper-hint" });
    Object.assign(this, { camera: { s: 6, x: 200, y: 300 }, unit: 1, wide: 600, tall: 400, poses: {}, arms: {}, run: null, rings: [], cross: null,
      band: null });
    this.arrows = new Map();
    this.placeText = this.layers.scale.appendChild(sv("text", { class: "place" }));
  }
  /** The length of a point of the shapes, and what is written to the last digit. */
  get point() { return PT / this.camera.s; }
  get grain() { return nice(1 / this.camera.s); }
  get grid() { return nice(GRID / this.camera.s); }
  /** What places snap to: half of the grid, so that its lines are reached as well. */
  get step() { return 0.5 * this.grid; }

  // -- the mechanism ----------------------------------------------------------------------------

  /** Show a state of the document, at home. */
  show(state) {
    const first = !this.state;
    this.state = state;
    this.ghosts = [];
    this.layers.ghosts.replaceChildren();
    this.#build(state.scene);
    this.home();
    this.#names();
    this.#picture();
    if (first) this.look();
  }
  #build(scene) {
    this.scene = scene;
    this.layers.world.replaceChildren();
    this.motion = this.#motion(Object.fromEntries(Object.entries(this.state.bodies).map(([name, one]) => [name, one.pose])));
    this.drawing = new Drawing(this.motion, this.layers.world, scene.unit);
    this.shapes = scene.shapes.map((shape) => ({ ...shape }));
  }
  #motion(poses) {
    const { scene, state: { run } } = this, data = { t: [0], units: { angle: "rad" }, measures: {}, efforts: run?.efforts ?? {}, reactions: run?.reactions,
      loads: run?.loads, contacts: run?.contacts };
    data.bodies = Object.fromEntries(Object.entries(poses).map(([name, [x, y, angle]]) => [name, { x: [x], y: [y], angle: [angle] }]));
    const motion = new Motion(data, { ...scene, floors: {}, turns: {}, plots: [], driven: {}, axis: { values: null } });
    motion.set(0);
    return motion;
  }
  /** Everything where the file has it. */
  home() {
    const { state } = this;
    this.by = 0; // pixels a force
    if (this.scene !== state.scene) this.#build(state.scene);
    this.poses = Object.fromEntries(Object.entries(state.bodies).map(([name, one]) => [name, one.pose]));
    this.arms = Object.fromEntries(Object.entries(state.bodies).map(([name, one]) => [name, one.points]));
    this.arms.ground = state.ground;
    this.sites = Object.fromEntries(Object.entries(state.sites ?? {}).map(([name, site]) => [name, { ...site, point: this.#pointOf(site) }]));
    this.run = state.run;
    this.velocities = state.velocities;
    this.#paths(state.paths ?? {});
    this.#reshape(this.shapes.entries());
  }
  /** The named point at a place of a body, which an arrow follows while dimensions change. */
  #pointOf({ body, arm: [u, v] }) {
    const near = 0.1 * this.point;
    return body !== "ground" && Object.entries(this.arms[body] ?? {}).find(([, [a, b]]) => Math.hypot(a - u, b - v) < near)?.[0];
  }
  /** Where the arrow of a joint or a load stands. */
  site({ body, arm, point }) { return this.carried(body, point ? this.arms[body][point] : arm); }
  #reshape(shapes) {
    let changed = false;
    for (const [n, shape] of shapes) if (this.scene.shapes[n]) { Object.assign(this.scene.shapes[n], shape); changed = true; }
    if (changed) this.drawing.renew();
  }
  /** Show where a drag has led. */
  follow({ poses, points, shapes, scene, run, sites, paths, velocities }) {
    if (scene) this.#build(scene); // with other shapes than before
    this.poses = { ...this.poses, ...poses };
    if (run !== undefined) this.run = run;
    if (velocities) this.velocities = velocities;
    if (paths) this.#paths(paths);
    if (sites) this.sites = { ...this.sites, ...sites };
    for (const [body, own] of Object.entries(points ?? {})) this.arms[body] = { ...this.arms[body], ...own };
    if (shapes) this.#reshape(Object.entries(shapes));
  }
  /** Paths of the points over the motion. */
  #paths(paths) {
    const drawn = this.state.pins.map((pin) => paths[pin.places.find((one) => !one.startsWith("ground."))]).filter((one) => one);
    this.layers.paths.replaceChildren(...drawn.map(({ x, y }) => sv("path", { class: "track", d: `M${x.map((v, n) => `${v} ${y[n]}`).join("L")}` })));
  }
  /** Where a place of a body is, from its mass centre in its axes; and back. */
  carried(body, [u, v]) {
    const [x, y, a] = this.poses[body] ?? [0, 0, 0], c = Math.cos(a), s = Math.sin(a);
    return [x + c * u - s * v, y + s * u + c * v];
  }
  arm(body, [x, y]) {
    const [cx, cy, a] = this.poses[body] ?? [0, 0, 0], c = Math.cos(a), s = Math.sin(a);
    return [c * (x - cx) + s * (y - cy), c * (y - cy) - s * (x - cx)];
  }
  placeOf(name) {
    const cut = name.indexOf("."), body = name.slice(0, cut), arm = this.arms[body]?.[name.slice(cut + 1)];
    return arm ? this.carried(body, arm) : null;
  }
  /** Where a point is now. */
  where(pin) { return this.placeOf(pin.places.find((one) => !one.startsWith("ground.")) ?? pin.places[0]) ?? pin.xy; }
  /** The points with their places; but for one that is dragged. */
  points(but = null) {
    const still = (pin) => pin.places.every((one) => one.startsWith("ground.")); // of two at one place the one of a link is meant
    return (this.state?.pins ?? []).filter((pin) => pin.places[0] !== but?.places[0]).sort((a, b) => still(a) - still(b)).map((pin) => [pin, this.where(pin)]);
  }
  /** The lines of links: [[body, [place, place]], …]. */
  lines(but = "") {
    return Object.keys(this.state?.bodies ?? {}).filter((body) => body !== but).flatMap((body) => {
      const at = Object.values(this.arms[body]).map((arm) => this.carried(body, arm));
      return at.flatMap((a, n) => at.slice(n + 1).map((b) => [body, [a, b]]));
    });
  }
  /** Ghosts of other assembly modes: [{name, poses}]. */
  showGhosts(modes) {
    this.layers.ghosts.replaceChildren();
    this.ghosts = modes.map((mode) => {
      const layer = sv("g", { class: "ghost", "data-mode": mode.index });
      this.layers.ghosts.append(layer);
      const drawing = new Drawing(this.#motion(mode.poses), layer, this.scene.unit, { named: false });
      drawing.width(PT);
      drawing.move();
      return drawing;
    });
    this.draw();
  }
  #picture() {
    const own = this.state.views?.underlay, layer = this.layers.picture;
    if (!own) return layer.replaceChildren();
    const image = layer.firstChild ?? layer.appendChild(sv("image", { preserveAspectRatio: "xMinYMax meet" })),
      name = `underlay?${encodeURIComponent(own.file)}`;
    if (image.getAttribute("href") !== name) image.setAttribute("href", name);
    const tall = own.height ?? 10 * own.width;
    Object.entries({ x: 0, y: -tall, width: own.width, height: tall, opacity: own.opacity ?? 0.5 }).forEach(([key, value]) => image.setAttribute(key, value));
    image.setAttribute("transform", `translate(${own.x} ${own.y}) rotate(${own.angle ?? 0}) scale(1 -1)`);
  }

  // -- the camera -------------------------------------------------------------------------------

  size(wide, tall) {
    Object.assign(this, { wide: wide || 600, tall: tall || 400 });
    this.svg.setAttribute("viewBox", `0 0 ${this.wide} ${this.tall}`);
  }
  /** The first view: as it was kept, or everything. */
  look() {
    const own = this.state.views?.camera;
    this.fitted = false;
    if (own) { this.camera = { s: 1 / own.unit, x: 0.5 * this.wide - own.x / own.unit, y: 0.5 * this.tall + own.y / own.unit }; return; }
    this.fit();
  }
  /** The view that shows everything, or some lengths of empty paper. */
  fit() {
    this.fitted = true;
    const all = this.points().map(([, at]) => at), { scene } = this;
    for (const { c, p, r = 0 } of scene.shapes) { // wheels and cams too
      const n = scene.carriers[c].x ? 3 : 2;
      for (let k = 0; k < p.length; k += n) if (p[k] !== null) { const [x, y] = this.motion.carried(c, p, k, n); all.push([x - r, y - r], [x + r, y + r]); }
    }
    if (!all.length) {
      const s = Math.min(this.wide, 1.6 * this.tall) / (ACROSS[this.state.units.length] ?? 100);
      this.camera = { s, x: 0.2 * this.wide, y: 0.62 * this.tall };
      return;
    }
    const low = [0, 1].map((i) => Math.min(...all.map((p) => p[i]))), high = [0, 1].map((i) => Math.max(...all.map((p) => p[i])));
    const [w, h] = [0, 1].map((i) => high[i] - low[i]), least = (ACROSS[this.state.units.length] ?? 100) * 1e-3;
    const s = Math.min(Math.max(60, this.wide - 150) / Math.max(w, least), Math.max(60, this.tall - 150) / Math.max(h, least), 1e9);
    this.camera = { s, x: 0.5 * this.wide - 0.5 * s * (low[0] + high[0]), y: 0.5 * this.tall + 0.5 * s * (low[1] + high[1]) };
  }
  /** The view as it is kept beside the model: its middle, and the length of a pixel. */
  get view() { const [x, y] = this.world([0.5 * this.wide, 0.5 * this.tall]); return { x, y, unit: 1 / this.camera.s }; }
  zoom(by, [x, y] = [0.5 * this.wide, 0.5 * this.tall]) {
    this.fitted = false;
    const c = this.camera, s = clamp(c.s * by, 1e-6, 1e9), k = s / c.s;
    Object.assign(c, { s, x: x + k * (c.x - x), y: y + k * (c.y - y) });
  }

  // -- a frame ----------------------------------------------------------------------------------

  draw() {
    const { state, layers, camera: c } = this;
    if (!state) return;
    this.scene.bodies.forEach((body, n) => {
      const pose = this.poses[body];
      if (pose) this.motion.pose.set([...pose, Math.cos(pose[2]), Math.sin(pose[2])], 5 * n);
    });
    this.motion.carry();
    const u = this.scene.unit, matrix = `matrix(${c.s * u} 0 0 ${-c.s * u} ${c.x} ${c.y})`;
    for (const layer of [layers.world, layers.ghosts]) layer.setAttribute("transform", matrix);
    for (const layer of [layers.picture, layers.paths]) layer.setAttribute("transform", this.matrix);
    this.drawing.width(PT);
    this.drawing.move();
    this.#grid();
    this.clear();
    this.#forces();
    this.#named();
    this.mark();
  }
  #grid() {
    const c = this.camera, minor = this.grid, key = [c.s, c.x, c.y, this.wide, this.tall, this.state.units.length].join();
    if (key === this.gridKey) return;
    this.gridKey = key;
    const every = [10, 5, 4].find((n) => Math.abs(nice(minor * n) - minor * n) < 1e-9 * minor) ?? 5, paths = { minor: "", major: "" }, texts = [];
    const [x0, y1] = this.world([0, 0]), [x1, y0] = this.world([this.wide, this.tall]);
    for (let n = Math.ceil(x0 / minor); n * minor <= x1; n++) {
      const x = this.screen([n * minor, 0])[0];
      paths[n % every ? "minor" : "major"] += `M${x.toFixed(1)} 0V${this.tall}`;
      if (n % every === 0 && x < this.wide - 60) texts.push([x + 3, this.tall - 5, shown(n * minor)]);
    }
    for (let n = Math.ceil(y0 / minor); n * minor <= y1; n++) {
      const y = this.screen([0, n * minor])[1];
      paths[n % every ? "minor" : "major"] += `M0 ${y.toFixed(1)}H${this.wide}`;
      if (n % every === 0 && y > 16 && y < this.tall - 20) texts.push([4, y - 3, shown(n * minor)]);
    }
    this.layers.grid.replaceChildren(...["minor", "major"].map((name) => sv("path", { d: paths[name], class: name })),
      sv("path", { d: `M${c.x} 0V${this.tall}M0 ${c.y}H${this.wide}`, class: "axis" }));
    this.layers.scale.replaceChildren(...texts.map(([x, y, t]) => text({ x, y }, t)), text({ x: this.wide - 8, y: this.tall - 5, "text-anchor": "end" },
      this.state.units.length), this.placeText);
  }
  /** Reactions on the second body of each joint, loads, and velocities, at the shown position. */
  #forces() {
    const { state, run, arrows } = this, list = [];
    for (const [table, color] of [["reactions", "force"], ["loads", "load"]]) for (const [name, own] of Object.entries(run?.[table] ?? {})) {
      const site = this.sites[name], x = own.fx?.at(-1), y = own.fy?.at(-1);
      if (site && Number.isFinite(x + y)) list.push({ name, color, x, y, at: this.site(site) });
    }
    const most = (rows) => Math.max(0, ...rows.map(({ x, y }) => Math.hypot(x, y))), top = most(list);
    // one scale as long as the greatest fits, so that arrows grow and shrink as forces do
    if (!this.by || top * this.by > 1.35 * LONGEST || top * this.by < 0.3 * LONGEST) this.by = top > 1e-9 ? LONGEST / top : 0;
    const fast = state.pins.map((pin) => ({ name: `v ${pin.name}`, color: "drive", at: this.where(pin), v: this.velocities?.[pin.places.find((one) =>
      !one.startsWith("ground."))] })).filter(({ v }) => v && Math.hypot(...v) > 0).map((one) => ({ ...one, x: one.v[0], y: one.v[1], unit: state.units.velocity }));
    for (const one of fast) one.by = 0.7 * LONGEST / most(fast);
    const gone = new Set(arrows.keys());
    for (const { name, color, x, y, at, by = this.by, unit = state.units.force } of [...list, ...fast]) {
      gone.delete(name);
      let one = arrows.get(name);
      if (!one) {
        one = { path: sv("path", { "data-force": name }), text: sv("text", { "dominant-baseline": "central" }), label: [[name, ""]] };
        arrows.set(name, one);
        this.layers.arrows.append(one.text, one.path);
      }
      one.path.style.fill = one.text.style.fill = `var(--${color})`;
      this.putArrow(one, this.screen(at), x * by, -y * by);
      const label = `${name} ${shown(Math.hypot(x, y), 3)} ${unit}`;
      if (one.seen && one.said !== label) { one.said = one.text.textContent = label; one.wide = 6.8 * label.length; }
    }
    for (const name of gone) { const one = arrows.get(name); one.path.remove(); one.text.remove(); arrows.delete(name); }
  }
  #names() {
    const { state } = this, bodies = Object.keys(state.bodies).map((body) => ({ body, t: body, runs: [[body, ""]] })), named = new Map();
    for (const [pin, at] of this.points().reverse()) named.set(`${pin.name} ${at.map((v) => Math.round(v / this.point))}`, pin); // two of one name in one place: once
    this.labels = [...[...named.values()].map((pin) => ({ pin, t: pin.name, runs: runs(pin.name) })), ...bodies].map((one) => {
      const made = write(sv("text", { "dominant-baseline": "central", ...(one.body ? { class: "link" } : {}) }), one.runs);
      return { ...one, text: made, wide: (one.body ? 7 : 9) * one.t.length };
    });
    this.layers.names.replaceChildren(...this.labels.map((one) => one.text));
  }
  #named() {
    for (const [, [a, b]] of this.lines()) this.places.stroke(...this.screen(a), ...this.screen(b), 4);
    for (const [, at] of this.points()) { const [x, y] = this.screen(at); this.places.stroke(x, y, x, y, 6, ARROW_WEIGHT); }
    for (const one of this.labels) {
      if (one.pin) { const [x, y] = this.screen(this.where(one.pin)); this.putName(one, (w, h) => around(x, y, -0.7, -0.7, 9, w, h)); continue; }
      const ends = Object.values(this.arms[one.body]).map((arm) => this.screen(this.carried(one.body, arm)));
      if (!ends.length) ends.push(this.screen(this.carried(one.body, [0, 0])));
      const [x, y] = [0, 1].map((i) => ends.reduce((sum, p) => sum + p[i], 0) / ends.length),
        [a, b] = ends.length > 1 ? [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]] : [1, 0], long = Math.hypot(a, b) || 1;
      this.putName(one, (w, h) => around(x, y, b / long, -a / long, 11, w, h));
    }
    for (const one of this.arrows.values()) if (one.seen) this.putName(one, (w, h) => atArrow(one, w, h));
  }
  /** What is chosen, focused, at fault or about to join: `rings` [[place, class]], `picked` links, cross, band and guides. */
  mark() {
    const made = [], line = (points, kind) =>
      made.push(sv("polyline", { points: points.map((p) => this.screen(p).map((v) => v.toFixed(1)).join()).join(" "), class: kind }));
    for (const [at, kind] of this.rings) { const [cx, cy] = this.screen(at);
    made.push(sv("circle", { cx, cy, r: kind.includes("join") ? 14 : 11, class: `ring ${kind}` })); }
    for (const guide of this.guides ?? []) line(guide, "guide");
    if (this.band) line(this.band, "rubber");
    if (this.cross) { const [x, y] = this.screen(this.cross);
    made.push(sv("path", { d: `M${x - 14} ${y}H${x + 14}M${x} ${y - 14}V${y + 14}`, class: "cross" })); }
    for (const drawn of this.layers.world.querySelectorAll(".picked, .faulty")) drawn.classList.remove("picked", "faulty");
    for (const [body, kind] of this.picked ?? []) for (const drawn of this.layers.world.querySelectorAll(`[data-name="link:${CSS.escape(body)}"]`)) drawn.classList.add(kind);
    this.layers.marks.replaceChildren(...made);
  }
  /** Numbers beside a place: its coordinates, or length and angle of a band. */
  tell(at, said = "") {
    this.placeText.textContent = at ? said || at.map((v) => shown(+v.toPrecision(6))).join(", ") : "";
    if (!at) return;
    const [x, y] = this.screen(at);
    this.placeText.setAttribute("x", clamp(x + 16, 4, Math.max(4, this.wide - 190)));
    this.placeText.setAttribute("y", clamp(y - 14, 14, this.tall - 24));
  }
  /** Length and angle of the last part of a band, in words. */
  measured(band) {
    const [a, b] = band.slice(-2), angle = Math.atan2(b[1] - a[1], b[0] - a[0]) / DEG;
    return `${shown(Math.hypot(b[0] - a[0], b[1] - a[1]), 4)} ${this.state.units.length}  ${shown(Math.abs(angle) < 1e-9 ? 0 : angle, 3)}°`;
  }
}
