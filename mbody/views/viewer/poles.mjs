// Instant centres with the centrodes that they leave, in a picture; and the polygons of velocities
// and accelerations below it. Both are histories of the recorded motion.

import { el, nice, shown, sv } from "./elements.mjs";
import { arrow } from "./drawing.mjs";
import { ARROW_WEIGHT, FreePlaces, alongside, around, write } from "./names.mjs";

/** Pixels of a polygon and of its edge; images nearer than this have one name; shorter parts are not seen, or have no letter. */
const POLYGON_WIDE = 380, POLYGON_TALL = 330, POLYGON_EDGE = 48, ONE_IMAGE = 3, SEEN = 2, NAMED = 12;
const full = (list) => Float64Array.from(list, (v) => v ?? NaN);
const filled = (all) => all.map((one) => (one.x ? { ...one, x: full(one.x), y: full(one.y) } : one));

/** The greatest extent of several histories and zero at an instant. */
function span(histories) {
  let most = 1e-300;
  for (let k = 0; k < (histories[0]?.length ?? 0); k++) {
    let low = 0, high = 0;
    for (const q of histories) { if (q[k] < low) low = q[k]; if (q[k] > high) high = q[k]; }
    if (high - low > most) most = high - low;
  }
  return most;
}
/** The instant centres of a picture. */
export class Poles {
  constructor(picture) {
    this.picture = picture;
    const { motion, layers } = picture, u = picture.viewer.main.scene.unit;
    this.curves = sv("g", { class: "centrodes" });
    layers.paths.before(this.curves);
    layers.names.before(this.marks = sv("g", { class: "poles" }));
    const line = (x, y) => {
      let text = "", on = false;
      for (let k = 0; k < x.length; k++) { const there = x[k] === x[k]; if (there) text += `${on ? "L" : "M"}${(x[k] / u).toFixed(2)} ${(y[k] / u).toFixed(2)}`; on = there; }
      return text;
    };
    this.all = motion.scene.poles.centres.map((one) => {
      const text = sv("text", { "dominant-baseline": "central", style: "fill: var(--drive)" }), wanders = one.kind === "instantaneous";
      const dot = sv("circle", { r: wanders ? 4 : 3, "data-name": `pole:${one.of.join(",")}`, style: `fill: var(--${wanders ? "paper" : "drive"}); stroke: var(--drive)`, "stroke-width": 1.5 });
      this.marks.append(dot, text);
      const own = { ...one, x: full(one.x), y: full(one.y), dot, text };
      if (one.on !== undefined) {
        const drawn = (d, dashes) => sv("path", { d, fill: "none", "stroke-width": 1.2, "stroke-dasharray": dashes, "vector-effect": "non-scaling-stroke", style: "stroke: var(--drive)" });
        own.moving = drawn(line(full(one.u), full(one.v)), "4 3");
        this.curves.append(drawn(line(own.x, own.y), "none"), own.moving);
      }
      return own;
    });
  }
  draw(matrix) {
    const { picture } = this, { viewer, motion, places } = picture, on = viewer.on.poles && motion.recordedNow, u = viewer.main.scene.unit;
    for (const one of [this.curves, this.marks]) one.style.display = on ? "" : "none";
    if (!on) return;
    this.curves.setAttribute("transform", matrix);
    const groups = [];
    for (const one of this.all) {
      const [x, y] = picture.screen([motion.value2(one.x), motion.value2(one.y)]), there = Number.isFinite(x + y);
      one.dot.style.display = there ? "" : "none";
      one.text.style.display = "none";
      if (one.moving) {
        const p = motion.pose, o = 5 * one.on;
        one.moving.style.display = there ? "" : "none";
        one.moving.setAttribute("transform", `matrix(${p[o + 3]} ${p[o + 4]} ${-p[o + 4]} ${p[o + 3]} ${p[o] / u} ${p[o + 1] / u})`);
      }
      if (!there) continue;
      one.dot.setAttribute("cx", x); one.dot.setAttribute("cy", y);
      const group = groups.find((other) => Math.hypot(other.x - x, other.y - y) < 1.5);
      if (group) group.all.push(one); else groups.push({ x, y, all: [one] });
    }
    if (!viewer.on.names) return;
    for (const { x, y, all } of groups) {
      const [first] = all, runs = all.flatMap((one, n) => (n ? [[", ", ""], ...one.t] : one.t));
      first.text.style.display = "";
      first.text.replaceChildren();
      write(first.text, runs);
      first.wide = runs.reduce((sum, [part, how]) => sum + (how ? 6 : 8) * part.length, 0);
      places.put(first, around(x, y, 0.7, 0.7, 7, 0.5 * first.wide + 2, 7));
    }
  }
}

/** The polygon of velocities or of accelerations at the present instant, from its pole o. */
export class PolygonPanel {
  constructor(viewer) {
    this.viewer = viewer;
    const { polygons } = viewer.main.scene.poles;
    this.polygons = Object.fromEntries(Object.entries(polygons).map(([key, one]) => [key, { links: one.links, points: filled(one.points), parts: filled(one.parts), slides: filled(one.slides) }]));
    for (const one of Object.values(this.polygons)) one.room = ["x", "y"].map((axis) => span([...one.points, ...one.parts, ...one.slides].flatMap((p) => (p.x ? [p[axis]] : []))));
    this.figures = Object.keys(polygons).map((key) => [key, sv("svg", { role: "img", "aria-label": `${key} polygon`, viewBox: `0 0 ${POLYGON_WIDE} ${POLYGON_TALL}` })]);
    this.message = el("p", { role: "status" });
    this.root = el("section", { class: "free motionpolygons", "aria-label": "velocity and acceleration polygons", hidden: "" },
      el("div", { class: "head" }, el("h2", {}, "Velocity and acceleration polygons")), this.message,
      el("div", { class: "figures" }, ...this.figures.map(([, figure]) => figure)));
  }
  draw() {
    const { viewer } = this, motion = viewer.main, { units } = motion.scene;
    this.root.hidden = !viewer.on.polygons;
    if (this.root.hidden) return;
    this.message.textContent = motion.recordedNow ? "" : "There are no polygons here: this page has them for the recorded instants and numbers only.";
    for (const [key, figure] of this.figures) {
      figure.toggleAttribute("hidden", !motion.recordedNow);
      if (motion.recordedNow) this.#polygon(figure, motion, this.polygons[key], key === "velocity" ? [units.v, "speed"] : [units.a, "change"]);
    }
  }
  #polygon(figure, motion, { points, links, parts, slides, room }, [[unit, one], color]) {
    const now = (one) => [motion.value2(one.x), motion.value2(one.y)], at = points.map(now);
    if (at.some(([x, y]) => !Number.isFinite(x + y))) { figure.replaceChildren(); return; }
    const xs = at.map(([x]) => x), ys = at.map(([, y]) => y), middle = [xs, ys].map((all) => 0.5 * (Math.min(...all) + Math.max(...all)));
    const wide = Math.max(...xs) - Math.min(...xs), tall = Math.max(...ys) - Math.min(...ys);
    if (!(Math.max(wide, tall) > 0)) { figure.replaceChildren(); return; }
    // at one scale for the whole motion, so that the polygon grows and shrinks with it
    const by = Math.min((POLYGON_WIDE - 2 * POLYGON_EDGE) / room[0], (POLYGON_TALL - 2 * POLYGON_EDGE) / room[1]);
    const place = ([x, y]) => [0.5 * POLYGON_WIDE + by * (x - middle[0]), 0.46 * POLYGON_TALL - by * (y - middle[1])];
    const spots = at.map(place), [pole] = spots, over = [], letters = [], apart = ([a, b], [c, d]) => Math.hypot(a - c, b - d), places = new FreePlaces(POLYGON_WIDE, POLYGON_TALL - 24, true);
    for (const [body, corners] of Object.entries(links)) {
      const d = corners.map((n, k) => `${k ? "L" : "M"}${spots[n].map((v) => v.toFixed(1)).join(" ")}`).join("");
      over.push(sv("path", { d: corners.length > 2 ? `${d}Z` : d, "data-name": `image:${body}`, style: "fill: var(--plate); stroke: var(--ink); fill-opacity: 0.45", "stroke-width": 1.2 }));
    }
    // a side goes over its corner where that is seen: to the normal part and the tangential one, or Coriolis's
    for (const [sides, color, dashes, every] of [[parts, "drive", "2.5 2", true], [slides, "load", "6 3", false]]) for (const one of sides) {
      const [a, b] = one.of.map((n) => spots[n]), corner = one.x ? place(now(one)) : a, seen = apart(a, corner) > SEEN && (!every || apart(corner, b) > SEEN), line = seen ? [a, corner, b] : [a, b];
      if (every ? !seen : apart(a, b) <= SEEN) continue;
      over.push(sv("path", { d: `M${line.map((one) => one.join(" ")).join("L")}`, style: `stroke: var(--${color}); fill: none`, "stroke-width": 1.4, "stroke-dasharray": dashes }));
      if (seen) [...one.t].forEach((text, k) => { if (apart(line[k], line[k + 1]) > NAMED) letters.push([text, color, line[k], line[k + 1]]); });
    }
    const images = [];
    spots.forEach(([x, y], n) => {
      const same = images.find((one) => apart([one.x, one.y], [x, y]) < ONE_IMAGE), name = points[n].t;
      if (!same) images.push({ x, y, names: [name] });
      else if (same !== images[0]) same.names.push(name);
    });
    for (const { x, y } of images.slice(1)) {
      over.push(sv("path", { d: arrow(pole[0], pole[1], x - pole[0], y - pole[1]), style: `fill: var(--${color})` }));
      places.stroke(...pole, x, y, 1.5, ARROW_WEIGHT);
    }
    over.push(sv("circle", { cx: pole[0], cy: pole[1], r: 3, style: "fill: var(--paper); stroke: var(--ink)" }));
    const named = (runs, color, spots) => {
      const label = { wide: runs.reduce((sum, [part, how]) => sum + (how ? 5.5 : 7.5) * part.length, 0) };
      label.text = write(sv("text", { "text-anchor": "middle", "dominant-baseline": "central", style: `fill: var(--${color})` }), runs);
      places.put(label, spots(0.5 * label.wide + 2, 7));
      over.push(label.text);
    };
    for (const one of images) {
      const runs = one.names.flatMap((name, n) => (n ? [[", ", ""], ...name] : name));
      const away = one === images[0] ? [-0.7, 0.7] : [one.x - pole[0], one.y - pole[1]], long = Math.hypot(...away) || 1;
      named(runs, "ink", (w, h) => around(one.x, one.y, away[0] / long, away[1] / long, 7, w, h));
    }
    for (const [text, color, [x, y], to] of letters) {
      const u = (to[0] - x) / apart([x, y], to), v = (to[1] - y) / apart([x, y], to);
      named([[text, ""]], color, (w, h) => alongside(0.5 * (x + to[0]), 0.5 * (y + to[1]), v, -u, 2, w, h));
    }
    const value = nice(70 / by / one) * one, note = sv("text", { x: 20 + by * value, y: POLYGON_TALL - 10, style: "fill: var(--soft)", class: "upright" });
    note.textContent = `${shown(value / one)} ${unit}`;
    over.push(sv("path", { d: arrow(14, POLYGON_TALL - 14, by * value, 0), style: `fill: var(--${color})` }), note);
    figure.replaceChildren(...over);
  }
}
