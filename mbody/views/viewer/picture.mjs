// The picture of one motion: its shapes, names, arrows and paths. Several pictures side by side
// have one camera, so that they are at one scale, and one length of arrows.

import { clamp, el, nice, shown, sv } from "./elements.mjs";
import { Drawing, arrow } from "./drawing.mjs";
import { Poles } from "./poles.mjs";
import { Sheet } from "./sheet.mjs";
import { ARROW_WEIGHT, alongside, around, atArrow, within, write } from "./names.mjs";

/** Pixels of the longest arrow, less in low pictures, where the slider for arrows is in the middle. */
const LONGEST = 90;
/** The kinds of arrows: key, colour, the unit of their scale. */
const ARROWS = [["forces", "force", "force"], ["velocities", "speed", "v"], ["accelerations", "change", "a"]];

/** The arrows of a motion: kind, components over the instants, place, name. */
function arrowsOf(motion, live = false) {
  const { scene } = motion, q = (name) => motion.history(name);
  const forces = scene.forces.map((f) => ({ kind: "forces", name: f.n, x: f.own ? f.own.x : q(`${f.of}.fx`), y: f.own ? f.own.y : q(`${f.of}.fy`), sign: f.sign, at: f.at, places: live ? f.places : f.drawn ?? f.places, label: scene.forces.length > 30 ? null : f.t, color: f.load ? "load" : "force" }));
  const of = (kind, letter, x, y, color) => scene.movers.map((p) => ({ kind, name: `${letter}:${p.n}`, x: q(`${p.n}.${x}`), y: q(`${p.n}.${y}`), sign: 1, at: p.at, color }));
  return [...forces, ...of("velocities", "v", "vx", "vy", "speed"), ...(scene.rates ? of("accelerations", "a", "ax", "ay", "change") : [])];
}
/** The longest of each kind of arrow in several motions. */
export function longest(motions) {
  const most = { forces: 0, velocities: 0, accelerations: 0 };
  for (const motion of motions) for (const { kind, x, y } of arrowsOf(motion)) {
    for (let k = 0; k < (x?.length ?? 0); k++) { const r = Math.hypot(x[k], y[k]); if (r > most[kind]) most[kind] = r; }
  }
  return most;
}

export class Picture extends Sheet {
  /** Of motion n of a viewer; the first shows the others as ghosts too. */
  constructor(viewer, n) {
    super(["ghosts", "paths", "world", "arrows", "names", "key"], { role: "img", tabindex: "0" });
    Object.assign(this, { viewer, n, motion: viewer.motions[n], hovered: null });
    const { scene, data } = this.motion, name = scene.design || data.model;
    this.caption = el("div", { class: "caption", hidden: "" }, el("i", { style: `border-color: var(--c${n % 6})` }), name);
    this.root = el("div", { class: "cell" }, this.caption, this.svg);
    const unit = viewer.main.scene.unit;
    this.drawing = new Drawing(this.motion, this.layers.world, unit);
    this.ghosts = n ? [] : viewer.motions.slice(1).map((motion) => new Drawing(motion, this.layers.ghosts.appendChild(sv("g", { class: "ghost" })), unit, { named: false }));
    this.centres = this.layers.world.querySelectorAll('[data-name^="cg:"], [data-name^="centre:"], [data-name^="tie:"]');
    this.#overlay();
    this.poles = this.motion.scene.poles ? new Poles(this) : null;
    this.#follow();
  }
  get camera() { return this.viewer.camera; }
  get unit() { return this.viewer.main.scene.unit; }
  get wide() { return this.viewer.wide; }
  get tall() { return this.viewer.tall; }
  /** What the picture is called by who cannot see it. */
  describe(several) {
    const { data } = this.motion;
    this.caption.hidden = !several;
    this.captionWide = undefined;
    this.svg.setAttribute("aria-label", `Picture of ${data.model}${several ? `, ${this.caption.textContent}` : ""}, moved by the controls below`);
  }

  // -- what lies above the shapes ---------------------------------------------------------------

  #overlay() {
    const { scene } = this.motion, { arrows, names } = this.layers;
    this.labels = scene.labels.map((label) => {
      const text = sv("text", { "dominant-baseline": "central" });
      write(text, label.t);
      if (label.e) text.style.fill = `var(--${label.e})`;
      if (!label.i) text.classList.add("upright");
      names.append(text);
      return { ...label, text, wide: 0 };
    });
    this.arrows = arrowsOf(this.motion, Boolean(this.viewer.live)).map((one) => {
      const path = sv("path", { "data-name": one.name }), text = one.label ? sv("text", { "dominant-baseline": "central" }) : null;
      for (const drawn of [path, text]) if (drawn) drawn.style.fill = `var(--${one.color})`;
      return { ...one, path, text };
    });
    for (const { text } of this.arrows) if (text) arrows.append(text);
    for (const { path } of this.arrows) arrows.append(path);
    const motions = this.n ? [[this.motion, this.n]] : this.viewer.motions.map((motion, n) => [motion, n]);
    this.tracks = motions.flatMap(([motion, n]) => this.#tracksOf(motion, n));
    this.showTracks();
  }
  #tracksOf(motion, n) {
    const u = this.viewer.main.scene.unit;
    return motion.scene.movers.map((p) => {
      const x = motion.history(`${p.n}.x`), y = motion.history(`${p.n}.y`), other = n !== this.n;
      const drawn = sv("path", { "data-name": `path:${p.n}`, fill: "none", "stroke-width": 1.4, "stroke-dasharray": other ? "2 3" : "6 4", "vector-effect": "non-scaling-stroke" });
      drawn.style.stroke = n ? `var(--c${n % 6})` : "var(--soft)";
      this.layers.paths.append(drawn);
      return { name: p.n, drawn, other, on: motion.scene.paths.includes(p.n), d: () => {
        let text = "";
        for (let k = 0; k < x.length; k++) text += `${k ? "L" : "M"}${(x[k] / u).toFixed(2)} ${(y[k] / u).toFixed(2)}`;
        return text;
      } };
    });
  }
  /** Show shapes and histories that have changed. */
  renew() {
    this.drawing.renew();
    this.outlines = this.signs = undefined;
    this.showTracks(true);
  }
  /** Draw the paths that are on; `again` where they have changed. */
  showTracks(again = false) {
    for (const one of this.tracks) {
      if (again) one.drawn.removeAttribute("d");
      const on = one.on && !(one.other && this.viewer.beside);
      if (on && !one.drawn.hasAttribute("d")) one.drawn.setAttribute("d", one.d());
      one.drawn.style.display = on ? "" : "none";
    }
  }
  /** Show the path of a point, or hide it. */
  trace(name, on) {
    for (const one of this.tracks) if (one.name === name) one.on = on ?? !one.on;
    this.showTracks();
  }

  // -- a frame ----------------------------------------------------------------------------------

  /** Draw the present place of the motion. */
  draw() {
    const { viewer, layers } = this, c = viewer.camera, { on } = viewer;
    const ghosts = on.ghosts && !viewer.beside;
    if (this.scaled !== c.s) {
      this.scaled = c.s;
      const px = clamp(c.s, 0.55, 1.9);
      for (const drawing of [this.drawing, ...this.ghosts]) drawing.width(px);
    }
    const { matrix } = this;
    for (const name of ["world", "ghosts", "paths"]) layers[name].setAttribute("transform", matrix);
    this.drawing.move(on.forces);
    layers.ghosts.style.display = ghosts ? "" : "none";
    if (ghosts) for (const drawing of this.ghosts) drawing.move(on.forces);
    layers.paths.style.display = on.paths ? "" : "none";
    if (this.showedCentres !== on.centres) {
      this.showedCentres = on.centres;
      for (const one of this.centres) one.style.display = on.centres ? "" : "none";
    }
    layers.world.classList.toggle("bare", !on.forces);
    layers.world.classList.toggle("solved", Boolean(viewer.live)); // marks and circles of friction are of the recorded motion
    this.#arrows();
    this.#names();
    this.poles?.draw(matrix);
    this.#scales();
    if (this.hovered) this.#describe();
  }
  /** Pixels for each unit of a kind of arrow. */
  #by(kind) { return Math.min(LONGEST, 0.3 * this.viewer.tall) * 2 ** +this.viewer.size.value / this.viewer.most[kind]; }
  #arrows() {
    const m = this.motion, at = (q) => m.value2(q);
    this.clear();
    for (const one of this.arrows) {
      const visible = this.viewer.on[one.kind] && this.viewer.most[one.kind] > 0 && one.x;
      const by = visible ? one.sign * this.#by(one.kind) : 0, dx = visible ? by * at(one.x) : 0, dy = visible ? -by * at(one.y) : 0;
      this.putArrow(one, visible ? this.screen(one.places ? [at(one.places.x), at(one.places.y)] : m.place(one.at)) : [0, 0], dx, dy);
    }
  }
  #names() {
    const on = this.viewer.on.names;
    this.layers.names.style.display = on ? "" : "none";
    const m = this.motion, px = this.camera.s / this.unit;
    for (const label of on ? this.labels : []) {
      const [x, y] = this.screen(m.carried(label.c, label.a, 0));
      let [ux, uy] = label.u;
      if (label.turns) {
        const o = 5 * label.c, f = m.frames;
        [ux, uy] = [f[o + 2] * ux - f[o + 3] * uy, f[o + 3] * ux + f[o + 2] * uy];
      }
      Object.assign(label, { x, y, ux, uy });
      if ((ux || uy) && !label.turns) this.places.stroke(x, y, x, y, 1.5, ARROW_WEIGHT);
    }
    this.#outlined();
    for (const label of on ? this.labels : []) {
      const { x, y, ux, uy } = label, gap = label.g * px + 2;
      this.putName(label, (w, h) => (!ux && !uy ? within(x, y, w, h) : label.turns ? alongside(x, y, ux, -uy, gap, w, h) : around(x, y, ux, -uy, gap, w, h)));
    }
    for (const one of this.arrows) if (one.text && one.seen) this.putName(one, (w, h) => atArrow(one, w, h));
  }
  /** Pins, mass centres and outlines of links, which names had better not cover. */
  #outlined() {
    const m = this.motion, { viewer, places } = this, c = viewer.camera, u = viewer.main.scene.unit;
    if (!this.caption.hidden) {
      this.captionWide ??= this.caption.offsetWidth;
      places.boxes.push(10 + 0.5 * this.captionWide, 17, 0.5 * this.captionWide, 11);
    }
    this.outlines ??= m.scene.shapes.filter((shape) => shape.k === "p" && shape.n.startsWith("link:") && !m.scene.carriers[shape.c].x).map((shape) => [5 * shape.c, shape.p]);
    this.signs ??= m.scene.shapes.filter((shape) => shape.k === "c" && /^(pin|cg):/.test(shape.n)).map((shape) => [shape.c, shape.p, shape.r / u]);
    for (const [carrier, p, radius] of this.signs) {
      const [x, y] = this.screen(m.carried(carrier, p)), r = c.s * radius;
      places.stroke(x, y, x, y, r, ARROW_WEIGHT);
    }
    for (const [o, points] of this.outlines) {
      const f = m.frames, s = c.s / u, x = c.x + s * f[o], y = c.y - s * f[o + 1], cos = s * f[o + 2], sin = s * f[o + 3], outline = [];
      for (let k = 0; k < points.length; k += 2) outline.push(x + cos * points[k] - sin * points[k + 1], y - sin * points[k] - cos * points[k + 1]);
      places.outline(outline);
    }
  }
  /** The scale of lengths, and of the arrows that are shown; of several pictures in the first. */
  #scales() {
    const { viewer } = this, { units } = viewer.main.scene, px = viewer.camera.s / viewer.main.scene.unit;
    const state = this.n ? "" : [px, viewer.size.value, viewer.wide, viewer.tall, ...ARROWS.map(([kind]) => viewer.on[kind])].join();
    if (state === this.keyState) return;
    this.keyState = state;
    this.layers.key.replaceChildren();
    if (this.n) return;
    const [symbol, one] = units.length, length = nice(Math.max(70 / px / one, 1e-300)) * one, y = viewer.tall - 14, wide = length * px;
    let x = 14;
    const put = (text, color) => {
      const made = sv("text", { x, y: y + 4, style: `fill: var(--${color})` });
      made.textContent = text;
      this.layers.key.append(made);
      x += 8.2 * text.length + 18;
    };
    this.layers.key.append(sv("path", { d: `M${x} ${y - 4}V${y + 4}M${x} ${y}H${x + wide}M${x + wide} ${y - 4}V${y + 4}`, style: "stroke: var(--soft); fill: none", "stroke-width": 1.4 }));
    x += wide + 7;
    put(`${shown(length / one)} ${symbol}`, "soft");
    for (const [kind, color, unit] of ARROWS) {
      if (!viewer.on[kind] || !(viewer.most[kind] > 0)) continue;
      const [symbol, one] = units[unit], value = nice(54 / this.#by(kind) / one) * one, long = this.#by(kind) * value;
      this.layers.key.append(sv("path", { d: arrow(x, y, long, 0), style: `fill: var(--${color})` }));
      x += long + 7;
      put(`${shown(value / one)} ${symbol}`, color);
    }
  }
  /** The pixels that arrows need beyond the picture: left, right, above, below. */
  beyond(edges, tall) {
    const m = this.motion, { viewer } = this, seen = this.arrows.filter((one) => viewer.on[one.kind] && viewer.most[one.kind] > 0 && one.x);
    for (let n = 0; seen.length && n < 24; n++) {
      const k = Math.round(n / 23 * (m.count - 1));
      m.set(k);
      for (const one of seen) {
        const by = one.sign * this.#by(one.kind), dx = by * one.x[k], dy = -by * one.y[k];
        const [x, y] = this.screen(one.places ? [one.places.x[k], one.places.y[k]] : m.place(one.at));
        if (!Number.isFinite(x + y + dx + dy)) continue;
        const room = one.text ? 36 : 8;
        [-(x + dx), x + dx - viewer.wide, -(y + dy), y + dy - tall].forEach((over, side) => { edges[side] = Math.max(edges[side], Math.min(34 + over + room, side < 2 ? 0.25 * viewer.wide : 0.25 * viewer.tall)); });
      }
    }
  }

  // -- the pointer ------------------------------------------------------------------------------

  #follow() {
    const { viewer } = this, live = () => (this.n ? null : viewer.live), at = (event) => this.world(this.here(event));
    this.listen({
      grab: (event) => live()?.grab(event, at(event)), drag: (event) => live()?.drag(at(event)), drop: () => live()?.drop(),
      zoom: (factor, pixel) => viewer.zoom(factor, pixel), moved: () => viewer.draw(), clicked: (pixel) => this.#clicked(pixel),
      hover: (event) => this.#hover(event), left: () => { viewer.tip.hidden = true; this.hovered = null; },
    });
  }
  #clicked([x, y]) {
    let best = 14, name = null;
    for (const one of this.motion.scene.movers) {
      const [px, py] = this.screen(this.motion.place(one.at)), away = Math.hypot(px - x, py - y);
      if (away < best) { best = away; name = one.n; }
    }
    if (!name) return;
    if (!this.viewer.on.paths) this.viewer.toggle("paths");
    this.viewer.trace(name);
  }
  #hover(event) {
    const { tip, stage } = this.viewer;
    this.hovered = event.composedPath().find((one) => one.dataset?.name)?.dataset.name ?? null;
    tip.hidden = !this.hovered;
    if (!this.hovered) return;
    this.#describe();
    const box = stage.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top, right = x > box.width - 230;
    tip.style.left = right ? "" : `${x + 14}px`;
    tip.style.right = right ? `${box.width - x + 10}px` : "";
    tip.style.top = `${Math.max(4, Math.min(y + 12, box.height - 130))}px`;
  }
  #describe() {
    const [kind, ...rest] = this.hovered.split(":"), name = rest.join(":"), { data, scene } = this.motion, { viewer } = this;
    const owner = (table) => (name in (table ?? {}) ? name : name.replace(/\.[^.]*$/, ""));
    const rows = [];
    const add = (of, keys) => { for (const key of keys) { const v = this.motion.value(`${of}.${key}`); if (Number.isFinite(v)) rows.push([key, viewer.inUnit(`${of}.${key}`, v), viewer.unitOf(`${of}.${key}`)]); } };
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
    viewer.tip.replaceChildren(el("b", {}, text), table);
  }
}
