// A model that a live page solves again: while the reader drags a link, moves a number, or lets it
// run freely. What the reader sees of it is in live.mjs.

import { DEG, TURN, clamp } from "../views/viewer/elements.mjs";
import { Motion } from "../views/viewer/motion.mjs";
import { LiveMotion } from "./live_motion.mjs";
import { Shapes } from "./live_shapes.mjs";

/** Greatest step of a driver of an angle at once, and of any other in lengths of the model. */
const STEP = 0.15;
/** Steps towards the pointer in one frame. */
const STEPS = 12;
/** Part of a number by which it changes at once, so that loops keep their branch. */
const CHANGE = 0.05;
/** Milliseconds that a change may take while a slider moves, half a frame; where it takes longer, all but the shown instant follows when the slider rests for so long. */
const FRAME = 8, REST = 150;

/** A model that is solved again: its motion, its drivers, its numbers, its free motion. */
export class LiveModel {
  constructor(viewer, content, core, image) {
    Object.assign(this, { viewer, content, part: content.live, changed: false, grip: null, running: false });
    this.model = core.open(image);
    this.first = new Map(this.model.numbers.map((name) => [name, this.model.get(name)]));
    const { scene, data } = content, { model } = this;
    this.axisDriver = scene.axis.values && model.manifest.drivers.length === 1 ? model.manifest.drivers[0] : "";
    this.axisFactor = 1 / (scene.axis.size ?? 1);
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
    const ends = scene.turns[this.axisDriver] && scene.axis.values ? (scene.axis.values[n] - scene.axis.values[0]) * scene.axis.size : 0;
    if (this.axisDriver && Math.abs(Math.abs(ends) - TURN) < 2e-6) return { kind: "turn" };
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
  /** In which direction a rough joint slides at every instant: what has the sign of its friction; 0 at rest. */
  slipSigns(name) {
    const { pages, rows, t } = this.motion.found, from = this.part.rubs[name];
    return Array.from(t, (_, k) => Math.sign(pages[k * rows + from]));
  }
  /** By what a measured quantity is multiplied for the unit of the page's histories. */
  factor(name) {
    const { scene } = this.content, unit = this.model.unit(name), key = name.slice(name.lastIndexOf(".") + 1), owner = name.slice(0, -key.length - 1);
    const plotted = scene.plots.find((one) => one.name === name), size = plotted?.size ?? scene.measures[name]?.[2];
    return size !== undefined ? 1 / size : unit === "rad" && (key === "angle" || (key === "value" && scene.turns[owner])) ? 1 / DEG : 1;
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
    if (!this.drive) this.#takeDrives();
    const motion = this.model.step(there, pace ?? this.#pace(there));
    this.#stand(motion, there);
    return motion;
  }
  /** Go to values of drivers in steps that a path can follow; of a turn the shorter way. */
  walk(wanted) {
    const from = this.present();
    const drive = Object.fromEntries(Object.entries(wanted).map(([name, to]) => [name, this.way.kind === "turn" ? to + TURN * Math.round((from[name] - to) / TURN) : to])), count = clamp(Math.ceil(Math.max(...Object.entries(drive).map(([name, to]) => Math.abs(to - from[name]) / this.scaleOf(name))) / STEP), 1, 400);
    for (let k = 1; k <= count; k++) this.to(Object.fromEntries(Object.entries(drive).map(([name, to]) => [name, k === count ? to : from[name] + k / count * (to - from[name])])));
  }
  #takeDrives() {
    const now = this.present();
    this.viewer.pause();
    if (!Object.keys(this.model._drive).length) this.model.close({ drive: this.home });
    this.model.step(now);
    this.drive = now;
  }
  #stand(motion, drive) {
    this.drive = { ...drive };
    this.motion.stand(motion, this.#axis(drive, motion.t[0]));
    this.showDrives();
  }
  /** Be at the instants of the motion again. */
  leave() {
    if (this.running) this.pause();
    this.settle();
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
        const size = Math.max(...Object.entries(change).map(([name, by]) => Math.abs(by) / this.scaleOf(name)));
        if (size < 1e-7) break;
        const by = Math.min(1, STEP / size);
        this.to(Object.fromEntries(Object.entries(change).map(([name, own]) => [name, now[name] + by * own])));
      }
      this.say("");
    });
  }
  scaleOf(name) { return this.content.scene.turns[name] ? 1 : this.model.manifest.length; }
  /** Least squares: the change of the drivers that brings a place nearest. */
  #towards(place, to, now) {
    if (!this.drive) this.#takeDrives();
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
      const [x, y] = columns[n], size = x * x + y * y, low = 1e-6 * (this.model.manifest.length / this.scaleOf(name)) ** 2;
      const by = size > low ? (off[0] * x + off[1] * y) / size : 0;
      change[name] = by;
      off[0] -= by * x;
      off[1] -= by * y;
    });
    return change;
  }

  // -- changing numbers -----------------------------------------------------------------------

  /** Change numbers by dotted name; the page shows the motion of them all. */
  change(values, calm = null) {
    if (!calm) this.settle();
    const start = performance.now(), { model } = this, saved = calm?.saved ?? model.save(), keep = this.drive && { ...this.drive }, names = Object.keys(values);
    const fresh = calm ? calm.changed : this.changed;
    try {
      if (this.running) this.pause();
      this.started = false;
      if (model.can("step") && Object.keys(model._drive).length) model.step(this.home);
      this.#approach(values, model.can("close") && names.some((name) => this.moving.has(name)), this.home);
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
      if (calm) { this.leave(); this.shapes?.follow(model, this.motion); this.viewer.renew(); }
      throw error;
    }
    this.drive = null;
    this.shapes?.follow(model, this.motion);
    this.#signs();
    this.hideContacts();
    if (keep) this.guarded(() => this.to(keep));
    this.viewer.renew(this.#grown());
    if (!this.viewer.on.ghosts && !fresh) this.viewer.toggle("ghosts");
    else if (this.viewer.beside && !fresh) this.viewer.arranged();
    this.showPeaks();
    this.took = performance.now() - start;
  }
  /** Change a number while its slider moves: all instants where that is quick, else the shown one, and the others when the slider rests. */
  slide(one, value) {
    if (this.calm && this.calm.one !== one) this.settle();
    if (!(this.took > FRAME) || !this.drives.length) return this.enter(one, value);
    this.calm ??= { one, value: one.now, saved: this.model.save(), changed: this.changed, stood: Boolean(this.drive) };
    clearTimeout(this.rest);
    one.now = value;
    if (this.guarded(() => this.#glimpse(this.given(one)))) {
      this.viewer.plotBox.classList.add("stale");
      this.say("The picture is solved; diagrams, paths and peaks follow when the slider rests.");
      this.rest = setTimeout(() => this.settle(), REST);
    } else {
      one.now = this.calm.value;
      this.model.restore(this.calm.saved);
      this.changed = this.calm.changed;
      this.calm = null;
      this.leave();
      this.shapes?.follow(this.model, this.motion);
      this.viewer.renew();
    }
    one.show();
  }
  /** Give a number a value: the whole motion is solved again. */
  enter(one, value) {
    if (!Number.isFinite(value) || value === one.now) return one.show();
    const old = one.now;
    one.now = value;
    if (!this.guarded(() => this.change(this.given(one)))) one.now = old;
    one.show();
  }
  /** Solve the instants that a moving slider has left. */
  settle() {
    const { calm } = this;
    if (!calm) return;
    clearTimeout(this.rest);
    this.calm = null;
    this.viewer.plotBox.classList.remove("stale");
    if (!calm.stood) this.drive = null;
    if (!this.guarded(() => this.change(this.given(calm.one), calm))) calm.one.now = calm.value;
    calm.one.show();
  }
  /** The shown instant with other numbers. */
  #glimpse(values) {
    const { model } = this, names = Object.keys(values);
    if (!this.drive) this.#takeDrives();
    const now = this.present(), pace = this.#pace(now);
    this.#approach(values, names.some((name) => this.moving.has(name)), now);
    this.changed = true;
    this.#stand(model.step(now, pace), now);
    this.shapes?.follow(model, this.motion);
  }
  /** Set numbers, in steps that keep the loops on their branch where places move. */
  #approach(values, moves, drive) {
    const { model } = this, names = Object.keys(values), from = Object.fromEntries(names.map((name) => [name, model.get(name)]));
    const most = Math.max(0, ...names.map((name) => Math.abs(values[name] - from[name]) / (Math.max(Math.abs(from[name]), Math.abs(values[name])) || 1)));
    const count = moves ? clamp(Math.ceil(most / CHANGE), 1, 40) : 1;
    for (let k = 1; k <= count; k++) {
      model.set(Object.fromEntries(names.map((name) => [name, k === count ? values[name] : from[name] + k / count * (values[name] - from[name])])));
      if (model.can("close") && this.drives.length) model.close({ drive });
    }
  }
  /** Whether motion n is to be seen beside the first: the recorded one when it is another. */
  shows(n) { return this.changed || n < this.content.others.length; }
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
  hideContacts() {
    const lengths = this.part.numbers.some((one) => one.now !== one.value && Object.keys(one.factors).some((name) => this.moving.has(name)));
    let hidden = false;
    for (const one of this.viewer.picture.arrows) {
      if (!one.places) continue;
      one.own ??= one.x;
      one.x = lengths ? null : one.own;
      hidden ||= lengths;
    }
    if (hidden && !this.message.textContent) this.say("Where lengths have changed, forces of contacts have no arrows; diagrams have them.");
  }
  /** Arrows of drivers that turn the other way now are not shown. */
  #signs() {
    for (const drawn of this.viewer.picture.layers.world.querySelectorAll('[data-name^="driver:"]')) {
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
}
