// The free-body diagram of one link at the present instant: the link alone, to scale, with all that
// acts on it in the notation of books, and the closing force polygon. Nothing is recorded for it
// but by which histories of the page the forces go.

import { clamp, el, nice, shown, sv } from "./elements.mjs";
import { Drawing } from "./drawing.mjs";
import { ARROW_WEIGHT, FreePlaces, alongside, around, atArrow, write } from "./names.mjs";

/** Pixels: size of the diagram and of the polygon, how far the link reaches, the longest arrow, the longest side. */
const WIDE = 460, SIDE = 300, TALL = 380, REACH = 108, ARROW = 80, LONG_SIDE = 130;
/** How much larger than in the picture a short link is drawn at most. */
const LARGER = 2.6;
/** Pixels: a polygon that is narrower has its sides beside each other, so far apart. */
const FLAT = 6, APART = 8;
const COLORS = { joint: "force", contact: "force", coupling: "force", driver: "drive", load: "load", inertia: "ink" };
/** Shapes that are signs of loads, drivers and supports, or pins, which the diagram draws itself. */
const SIGNS = /^(contact|rope|cone|friction|sticks|driver|torque|force|support|load|gravity|spring|damper|path|pin|motor|rail|hatch)/;
const SCALES = ["of the whole motion", "of this instant"];

/** Everything that acts on a body: cause, kind, place in the world, force and torque about the place. */
export function wrenches(motion, body, take = (name) => motion.value(name), own = (q) => motion.value2(q)) {
  const { free, forces } = motion.scene, [mass, inertia] = motion.masses(body);
  const value = (one, cause, key) => {
    if (typeof one === "number") return one * motion.grown(cause, key);
    if (one.own) return (one.by ?? 1) * (motion.recordedNow ? own(free.histories[one.own]) : NaN);
    const by = one.mass ? mass : one.inertia ? inertia : 1;
    return one.by * by * (one.of ? take(one.of) : motion.grown(cause, key));
  };
  return free.bodies[body].map((one) => {
    const joint = one.f === undefined ? null : forces[one.f];
    const [x, y] = joint?.places ? [own(joint.places.x), own(joint.places.y)] : motion.place(joint?.at ?? one.at);
    return { ...one, x, y, fx: value(one.fx, one.c, "x"), fy: value(one.fy, one.c, "y"), torque: value(one.m, one.c, "value") };
  });
}
/** What is left of the forces, and of their moments about the mass centre, with the greatest of each. */
export function closing(acting, [x, y]) {
  let fx = 0, fy = 0, moment = 0, force = 0, greatest = 0;
  for (const one of acting) {
    fx += one.fx; fy += one.fy;
    moment += one.torque + (one.x - x) * one.fy - (one.y - y) * one.fx;
    const size = Math.hypot(one.fx, one.fy);
    force = Math.max(force, size);
    // a force through the mass centre has no moment: its distance says how large rounding may be
    greatest = Math.max(greatest, Math.abs(one.torque) + Math.hypot(one.x - x, one.y - y) * size);
  }
  return { gap: Math.hypot(fx, fy), force, moment: Math.abs(moment), greatest };
}
/** By direction, counter-clockwise from the first: then the polygon is convex. */
function ordered(forces) {
  const turn = (one) => Math.atan2(one.fy, one.fx), first = forces.length ? turn(forces[0]) : 0, round = 2 * Math.PI;
  const after = (one) => (Math.round(1e9 * ((turn(one) - first + 2 * round) % round)) % Math.round(1e9 * round));
  return [...forces].sort((a, b) => after(a) - after(b));
}
const sizeOf = (one) => Math.hypot(one.fx, one.fy);
/** A text with what stands in its brackets. */
const inWords = (text, values) => text.replace(/\{(\w*)\}/g, (_, key) => values[key]);
/** A point of the line on which a force alone has its torque. */
const lineOf = ({ x, y, fx, fy, torque }) => [x + torque * fy / (fx * fx + fy * fy), y - torque * fx / (fx * fx + fy * fy)];
/** The kind of a member by the forces on it, those below `least` being none: the rules and words of `member_forces`. */
function member(acting, least, { free, units }) {
  const forces = acting.filter((one) => sizeOf(one) > least), couples = acting.filter((one) => sizeOf(one) <= least && Math.abs(one.torque) > least * free.length);
  const all = [...forces, ...couples], [a, b] = forces, say = (kind, more = {}) => inWords(free.member[kind], { forces: all.map((one) => `'${one.c}'`).join(", "), ...more });
  const print = (value, [unit, one]) => `${shown(value / one)} ${unit}`;
  if (!all.length) return say("unloaded");
  if (forces.length === 2 && couples.length) return say("couple");
  if (couples.length || forces.length < 2 || forces.length > 3) return "";
  if (forces.length === 2) {
    const pins = a.k === "joint" && b.k === "joint", [[ax, ay], [bx, by]] = forces.map((one) => (pins ? [one.x, one.y] : lineOf(one)));
    const along = b.fx * (bx - ax) + b.fy * (by - ay);
    return say(along > 0 ? "pulled" : along < 0 ? "pressed" : "one place", { size: print(sizeOf(a), units.force) });
  }
  const sine = ([p, q]) => (p.fx * q.fy - p.fy * q.fx) / (sizeOf(p) * sizeOf(q));
  const [p, q] = [[1, 0], [2, 0], [2, 1]].map((pair) => pair.map((n) => forces[n])).reduce((best, pair) => (Math.abs(sine(pair)) > Math.abs(sine(best)) ? pair : best));
  if (Math.abs(sine([p, q])) < free.none.sine) return say("parallel");
  const [px, py] = lineOf(p), [qx, qy] = lineOf(q), s = ((qx - px) * q.fy - (qy - py) * q.fx) / (p.fx * q.fy - p.fy * q.fx);
  return say("meet", { x: print(px + s * p.fx, units.length), y: print(py + s * p.fy, units.length) });
}
const words = (runs) => runs.map(([part]) => part).join("");
const html = (runs) => runs.map(([part, how]) => (how ? el("sub", {}, part) : el("i", {}, part)));

export class FreeBodyPanel {
  constructor(viewer) {
    this.viewer = viewer;
    const { free } = viewer.main.scene, bodies = Object.keys(free.bodies);
    this.select = el("select", { "aria-label": "link of the free-body diagram" });
    for (const name of bodies) this.select.append(el("option", { value: name }, name));
    this.scale = el("select", { "aria-label": "scale of the forces" });
    for (const name of SCALES) this.scale.append(el("option", { value: name }, name));
    for (const one of [this.select, this.scale]) one.addEventListener("change", () => { this.renew(); viewer.draw(); });
    this.diagram = sv("svg", { role: "img", class: "diagram", "aria-label": "the link alone with its forces", viewBox: `0 0 ${WIDE} ${TALL}` });
    this.polygon = sv("svg", { role: "img", class: "polygon", "aria-label": "force polygon", viewBox: `0 0 ${SIDE} ${TALL}` });
    this.message = el("p", { role: "status" });
    this.kind = el("p", { class: "kind" });
    this.table = el("table");
    this.closes = el("p", { class: "closes" });
    this.root = el("section", { class: "free", "aria-label": "free-body diagram", hidden: "" },
      el("div", { class: "head" }, el("h2", {}, "Free body of "), this.select, el("label", {}, "Forces to the scale ", this.scale)),
      this.message, this.kind, el("div", { class: "figures" }, this.diagram, this.polygon), el("div", { class: "table", tabindex: "0" }, this.table), this.closes);
  }
  get body() { return this.select.value; }
  /** Show a link. */
  show(body) { this.select.value = body; this.renew(); this.viewer.draw(); }
  /** The forces of a link now, with how they close. */
  forces(body = this.body) {
    const motion = this.viewer.main, acting = wrenches(motion, body), b = 5 * motion.scene.bodies.indexOf(body);
    return { acting, ...closing(acting, [motion.pose[b], motion.pose[b + 1]]) };
  }
  /** Another link, or other histories: its outline, the room that it needs, its greatest force. */
  renew() {
    const { viewer } = this, on = viewer.on.free;
    this.root.hidden = !on;
    if (!on) return;
    const motion = viewer.main, { scene } = motion, b = scene.bodies.indexOf(this.body), at = viewer.at;
    const shapes = scene.shapes.filter((one) => {
      const { s, t, e, x } = scene.carriers[one.c];
      return !e && !x && s[0] === b && (one.n ? !SIGNS.test(one.n) : t === b);
    });
    this.world = sv("g");
    this.drawing = new Drawing(motion, this.world, scene.unit, { named: false, shapes });
    this.drawn = shapes.length > 0;
    this.placed = new Map();
    let most = 0, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    const reach = (x, y) => { low = [Math.min(low[0], x), Math.min(low[1], y)]; high = [Math.max(high[0], x), Math.max(high[1], y)]; };
    reach(0, 0);
    for (let n = 0; n <= 24; n++) {
      const k = Math.round(n / 24 * (motion.count - 1));
      motion.set(k);
      const [x, y, , c, s] = motion.pose.subarray(5 * b, 5 * b + 5), inside = (px, py) => reach(c * (px - x) + s * (py - y), c * (py - y) - s * (px - x));
      for (const one of wrenches(motion, this.body)) if (one.k !== "driver" || one.fx || one.fy) inside(one.x, one.y);
      if (!n) for (const one of shapes) for (let p = 0; p < one.p.length; p += 2) if (one.p[p] !== null) { const [px, py] = motion.carried(one.c, one.p, p, 2), r = one.r ?? 0; inside(px - r, py - r); inside(px + r, py + r); }
    }
    for (let k = 0; k < motion.count; k++) {
      for (const one of wrenches(motion, this.body, (name) => motion.history(name)?.[k] ?? NaN, (q) => q[k])) { const size = Math.hypot(one.fx, one.fy); if (size > most) most = size; }
    }
    motion.set(at);
    this.middle = [b, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    this.zoom = Math.min(REACH * scene.unit / Math.max(0.5 * Math.hypot(high[0] - low[0], high[1] - low[1]), 1e-300), LARGER);
    this.most = most;
    this.outlines = shapes.filter((one) => one.k === "p" && one.n.startsWith("link:")).map((one) => [one.c, one.p]);
    this.signs = shapes.filter((one) => one.k === "c" && one.n.startsWith("cg:"));
  }

  // -- a frame ----------------------------------------------------------------------------------

  draw() {
    const { viewer } = this, motion = viewer.main, { scene } = motion, { floors, units } = scene;
    const { acting, gap, force, moment, greatest } = this.forces();
    const open = [...new Set(acting.filter((one) => !Number.isFinite(one.fx + one.fy + one.torque)).map((one) => (one.k === "inertia" ? "inertia" : one.c)))];
    const hidden = open.length > 0;
    this.message.textContent = hidden ? `There is no diagram here: ${open.join(", ")} ${open.length > 1 ? "have" : "has"} no value${motion.recordedNow ? " at this instant" : ", which this page has for the recorded instants and numbers only"}.` : "";
    for (const one of [this.diagram, this.polygon, this.table, this.closes, this.kind]) one.toggleAttribute("hidden", hidden);
    if (hidden) return;
    const floor = floors.force ?? 0, turns = (one) => Math.abs(one.torque) > Math.max(floors.torque ?? 0, 0);
    const forces = acting.filter((one) => Math.hypot(one.fx, one.fy) > floor), torques = acting.filter(turns);
    const { free } = scene, most = Math.max(...Object.keys(free.bodies).map((body) => this.forces(body).force));
    this.kind.textContent = member(acting, free.none.force * most, scene);
    const peak = this.scale.value === SCALES[0] ? Math.max(this.most, force) : force;
    this.#diagram(motion, forces, torques, peak > 0 ? ARROW / peak : 0);
    this.#polygon(forces, peak > 0 ? LONG_SIDE / peak : 0, units.force);
    this.#numbers(forces, torques, units);
    const part = (a, b) => (b ? shown(a / b, 2) : "0");
    const through = greatest <= free.none.moment * force * free.length;
    this.closes.textContent = force ? `Rounding of the numbers of this page: ${inWords(free.closing.force, { "": part(gap, force) })}; ${inWords(free.closing[through ? "through" : "moment"], { "": part(moment, greatest) })}.` : acting.some(turns) ? "" : "Nothing acts on this link.";
    const said = forces.map((one) => `${words(one.t)} ${shown(Math.hypot(one.fx, one.fy) / units.force[1], 4)} ${units.force[0]}`).join(", ");
    this.diagram.setAttribute("aria-label", `${this.body} alone with its forces: ${said || "none"}`);
    this.polygon.setAttribute("aria-label", `Force polygon of ${this.body}: ${forces.length} forces, tip to tail`);
  }
  #diagram(motion, forces, torques, by) {
    const { scene } = motion, z = this.zoom, [mx, my] = motion.place(this.middle);
    const at = (x, y) => [0.5 * WIDE + z * (x - mx) / scene.unit, 0.48 * TALL - z * (y - my) / scene.unit];
    const [cx, cy] = [0.5 * WIDE - z * mx / scene.unit, 0.48 * TALL + z * my / scene.unit];
    this.world.setAttribute("transform", `matrix(${z} 0 0 ${-z} ${cx} ${cy})`);
    this.drawing.width(clamp(z, 0.8, 1.5));
    this.drawing.move(true);
    const over = [this.world], names = [], places = new FreePlaces(WIDE, TALL - 24, true);
    if (!this.drawn) { const [x, y] = at(...motion.place([this.middle[0], 0, 0])); over.push(sv("rect", { x: x - 16, y: y - 12, width: 32, height: 24, style: "fill: var(--link); stroke: var(--ink)" })); }
    const pins = new Map();
    for (const one of motion.scene.free.bodies[this.body]) if (one.k === "joint" && !scene.forces[one.f].places) {
      const [x, y] = at(...motion.place(scene.forces[one.f].at)), key = `${x.toFixed(1)} ${y.toFixed(1)}`;
      pins.set(key, { x, y, names: [...(pins.get(key)?.names ?? []), one.c] });
    }
    for (const { x, y } of pins.values()) over.push(sv("circle", { cx: x, cy: y, r: 5, style: "fill: var(--paper); stroke: var(--ink)", "stroke-width": 1.3 }));
    for (const [c, points] of this.outlines) places.outline(points.flatMap((_, k) => (k % 2 ? [] : at(...motion.carried(c, points, k, 2)))));
    for (const [x, y, r] of [...[...pins.values()].map((pin) => [pin.x, pin.y, 5]), ...this.signs.map((one) => [...at(...motion.carried(one.c, one.p)), one.r * z / scene.unit])]) places.stroke(x, y, x, y, r, ARROW_WEIGHT);
    forces.forEach((one, n) => {
      const [x, y] = at(one.x, one.y), dx = by * one.fx, dy = -by * one.fy, long = Math.hypot(dx, dy);
      if (long < 2.5) return;
      const u = dx / long, v = dy / long, clear = one.k === "joint" ? 7 : 2;
      // away from the link, or to it from outside: where less is drawn
      const away = u * (x - 0.5 * WIDE) + v * (y - 0.48 * TALL) >= -1e-6 * long;
      const [tx, ty] = away ? [x + clear * u, y + clear * v] : [x - (clear + long) * u, y - (clear + long) * v];
      over.push(...straight(tx, ty, dx, dy, one));
      places.stroke(tx, ty, tx + dx, ty + dy, 1.5, ARROW_WEIGHT);
      const outward = away ? { x0: tx, y0: ty, dx, dy, long } : { x0: tx + dx, y0: ty + dy, dx: -dx, dy: -dy, long };
      names.push([`force ${n}`, one.t, one.k, (w, h) => [...atArrow(outward, w, h), ...around(outward.x0, outward.y0, outward.dx / long, outward.dy / long, 27, w, h).map(([a, b, cost]) => [a, b, cost + 0.6])]]);
    });
    torques.forEach((one, n) => {
      const [px, py] = one.o ? motion.place(one.o) : [one.x, one.y], [x, y] = at(px, py), turning = -Math.sign(one.torque), r = one.k === "inertia" ? 25 : 18;
      const outward = widest([...pins.values()].filter((pin) => Math.hypot(pin.x - x, pin.y - y) > 4).map((pin) => Math.atan2(pin.y - y, pin.x - x))), from = outward - 1.3 * turning, to = outward + 1.3 * turning;
      over.push(...curved(x, y, r, from, to, turning, one));
      const on = (turn) => [x + r * Math.cos(outward + turn), y + r * Math.sin(outward + turn)];
      for (let turn = -1.3; turn < 1.2; turn += 0.325) places.stroke(...on(turn), ...on(turn + 0.325), 1.5, ARROW_WEIGHT);
      names.push([`torque ${n}`, one.T, one.k, (w, h) => around(x, y, Math.cos(outward), Math.sin(outward), r + 6, w, h)]);
      for (const pin of pins.values()) if (Math.hypot(pin.x - x, pin.y - y) < r) pin.clear = r + 4;
    });
    const outside = (x, y) => { const [u, v] = [x - 0.5 * WIDE, y - 0.48 * TALL], r = Math.hypot(u, v); return r > 1 ? [u / r, v / r] : [0.6, 0.8]; };
    for (const { x, y, names: at, clear = clamp(9 * z, 7, 18) } of pins.values()) names.push([`pin ${at[0]}`, [[at.join(", "), ""]], "pin", (w, h) => around(x, y, ...outside(x, y), clear, w, h)]);
    this.diagram.replaceChildren(...over, ...names.map((one) => this.#name(places, ...one)), ...this.#key(14, TALL - 14, [[80 * scene.unit / z, z / scene.unit, scene.units.length, false], by ? [60 / by, by, scene.units.force, true] : null]));
  }
  /** A name at the one of its places where it covers least, and where it was before if that is as good. */
  #name(places, key, runs, kind, spots) {
    const label = this.placed.get(key) ?? {};
    this.placed.set(key, label);
    label.wide = runs.reduce((sum, [part, how]) => sum + (how ? 5.5 : 7.5) * part.length, 0);
    label.text = write(sv("text", { "text-anchor": "middle", "dominant-baseline": "central", style: `fill: var(--${COLORS[kind] ?? "soft"})` }), runs);
    places.put(label, spots(0.5 * label.wide + 2, 7));
    return label.text;
  }
  #polygon(forces, by, unit) {
    const sides = ordered(forces), corners = [[0, 0]];
    for (const one of sides) { const [x, y] = corners[corners.length - 1]; corners.push([x + one.fx, y + one.fy]); }
    const low = [0, 1].map((i) => Math.min(...corners.map((p) => p[i]))), high = [0, 1].map((i) => Math.max(...corners.map((p) => p[i])));
    by = Math.min(by, (SIDE - 96) / Math.max(high[0] - low[0], 1e-300), (TALL - 100) / Math.max(high[1] - low[1], 1e-300));
    const at = ([x, y]) => [0.5 * SIDE + by * (x - 0.5 * (low[0] + high[0])), 0.47 * TALL - by * (y - 0.5 * (low[1] + high[1]))];
    const far = corners.reduce((a, b) => (Math.hypot(...b) > Math.hypot(...a) ? b : a)), length = Math.hypot(...far) || 1, across = [far[1] / length, far[0] / length];
    const off = corners.map(([x, y]) => by * (far[0] * y - far[1] * x) / length), flat = Math.max(...off) - Math.min(...off) < FLAT;
    const seen = sides.filter((one) => by * Math.hypot(one.fx, one.fy) >= 2), over = [], names = [], places = new FreePlaces(SIDE, TALL - 24, true);
    const middle = at([0, 1].map((i) => corners.reduce((sum, p) => sum + p[i], 0) / corners.length));
    sides.forEach((one, n) => {
      const rank = seen.indexOf(one), shift = flat && rank >= 0 ? APART * (rank - 0.5 * (seen.length - 1)) : 0;
      if (rank < 0) return;
      const [x, y] = at(corners[n]), dx = by * one.fx, dy = -by * one.fy, long = Math.hypot(dx, dy), tx = x + shift * across[0], ty = y + shift * across[1];
      over.push(...straight(tx, ty, dx, dy, one));
      let out = [dy / long, -dx / long];
      const half = [tx + 0.5 * dx, ty + 0.5 * dy], side = flat ? shift * (across[0] * out[0] + across[1] * out[1]) : (half[0] - middle[0]) * out[0] + (half[1] - middle[1]) * out[1];
      if (side < 0) out = [-out[0], -out[1]];
      places.stroke(tx, ty, tx + dx, ty + dy, 1.5, ARROW_WEIGHT);
      names.push([`side ${n}`, one.t, one.k, (w, h) => alongside(...half, ...out, 4, w, h)]);
    });
    this.polygon.replaceChildren(...over, ...names.map((one) => this.#name(places, ...one)), ...this.#key(14, TALL - 14, [by && seen.length ? [60 / by, by, unit, true] : null]));
  }
  /** Scales below a figure: of lengths a bar, of forces an arrow. */
  #key(x, y, scales) {
    const made = [];
    for (const one of scales) {
      if (!one) continue;
      const [most, by, [symbol, size], is] = one, value = nice(most / size) * size, wide = by * value, note = sv("text", { x: x + wide + 6, y: y + 4, style: "fill: var(--soft)", class: "upright" });
      note.textContent = `${shown(value / size)} ${symbol}`;
      if (is) made.push(...straight(x, y, wide, 0, { k: "key" }), note);
      else made.push(sv("path", { d: `M${x} ${y - 4}V${y + 4}M${x} ${y}H${x + wide}M${x + wide} ${y - 4}V${y + 4}`, style: "stroke: var(--soft); fill: none", "stroke-width": 1.3 }), note);
      x += wide + 26 + 7.6 * note.textContent.length;
    }
    return made;
  }
  #numbers(forces, torques, units) {
    const body = el("tbody"), row = (runs, ...cells) => body.append(el("tr", {}, el("th", { scope: "row" }, ...html(runs)), ...cells.map((one) => el("td", {}, one))));
    for (const one of forces) row(one.t, `${shown(Math.hypot(one.fx, one.fy) / units.force[1], 6)} ${units.force[0]}`, `${(((Math.atan2(one.fy, one.fx) * 180 / Math.PI) % 360 + 360) % 360).toFixed(2)}°`, one.w);
    for (const one of torques) row(one.T, `${shown(one.torque / units.torque[1], 6)} ${units.torque[0]}`, "", one.w);
    this.table.replaceChildren(el("thead", {}, el("tr", {}, ...["name", "size", "direction", "place"].map((name) => el("th", { scope: "col" }, name)))), body);
  }
}
/** The middle of the widest gap between directions. */
function widest(directions) {
  if (!directions.length) return -0.9;
  const all = [...directions].sort((a, b) => a - b), gaps = all.map((a, n) => (n + 1 < all.length ? all[n + 1] : all[0] + 2 * Math.PI) - a);
  const n = gaps.reduce((best, gap, k) => (gap > gaps[best] + 1e-6 ? k : best), 0);
  return all[n] + 0.5 * gaps[n];
}
/** A straight arrow, dashed of d'Alembert's forces. */
function straight(x, y, dx, dy, { k }) {
  const long = Math.hypot(dx, dy), u = dx / long, v = dy / long, head = Math.min(10, 0.6 * long), color = `var(--${COLORS[k] ?? "soft"})`;
  const [bx, by, tx, ty] = [x + dx - head * u, y + dy - head * v, x + dx, y + dy], w = 0.38 * head;
  const line = sv("path", { d: `M${x.toFixed(1)} ${y.toFixed(1)}L${(bx + 1.5 * u).toFixed(1)} ${(by + 1.5 * v).toFixed(1)}`, style: `stroke: ${color}; fill: none`, "stroke-width": k === "key" ? 1.4 : 2 });
  if (k === "inertia") line.setAttribute("stroke-dasharray", "6 4");
  return [line, sv("path", { d: `M${tx.toFixed(1)} ${ty.toFixed(1)}L${(bx - w * v).toFixed(1)} ${(by + w * u).toFixed(1)}L${(bx + w * v).toFixed(1)} ${(by - w * u).toFixed(1)}Z`, style: `fill: ${color}; stroke: none` })];
}
/** The arc of a torque. */
function curved(x, y, r, from, to, turning, { k }) {
  const color = `var(--${COLORS[k]})`, end = to - 0.3 * turning, at = (angle, by = r) => `${(x + by * Math.cos(angle)).toFixed(1)} ${(y + by * Math.sin(angle)).toFixed(1)}`;
  const line = sv("path", { d: `M${at(from)}A${r} ${r} 0 0 ${turning > 0 ? 1 : 0} ${at(end)}`, style: `stroke: ${color}; fill: none`, "stroke-width": 2 });
  if (k === "inertia") line.setAttribute("stroke-dasharray", "5 3.5");
  return [line, sv("path", { d: `M${at(to)}L${at(end, r - 4)}L${at(end, r + 4)}Z`, style: `fill: ${color}; stroke: none` })];
}
