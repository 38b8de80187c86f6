// A diagram that follows the picture, and leads it where it is clicked.

import { clamp, el, shown, sv, ticks } from "./elements.mjs";

/** One diagram: any quantity of the motion over its axis. */
export class Plot {
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
  /** Take the size that the page has for the diagram. */
  measure() {
    this.size = [this.svg.clientWidth || 420, this.svg.clientHeight || 132];
    this.drawn = "";
  }
  /** Show a quantity. */
  show(name) {
    this.name = name;
    this.select.value = name;
    this.measure();
    this.renew();
  }
  /** Draw the present histories; where they still fill the range that is shown, it stays. */
  renew() {
    const { name, viewer } = this, curves = viewer.motions.map((one, n) => [one, one.history(name)?.map((v) => viewer.inUnit(name, v)), n]).filter(([, q]) => q);
    let least = Infinity, most = -Infinity, low = Infinity, high = -Infinity;
    for (const [one, q] of curves) {
      for (const v of q) { if (v < least && v > -Infinity) least = v; if (v > most && v < Infinity) most = v; }
      low = Math.min(low, one.x[0], one.x[one.count - 1]);
      high = Math.max(high, one.x[0], one.x[one.count - 1]);
    }
    if (!(most >= least)) { least = -1; most = 1; }
    const said = `from ${shown(least + 0)} to ${shown(most + 0)}`, peak = Math.max(Math.abs(least), Math.abs(most));
    if (most - least <= 1e-9 * peak || peak === 0) { const room = peak ? 0.1 * peak : 1; least -= room; most += room; }
    if (!(high > low)) high = low + 1;
    const fills = least >= this.least && most <= this.most && most - least > 0.75 * (this.most - this.least);
    if (!this.drawn || !fills || Math.abs(low - this.low) + Math.abs(high - this.high) > 1e-9 * (high - low)) {
      const room = 0.06 * (most - least);
      Object.assign(this, { least: least - room, most: most + room, low, high, drawn: name });
      this.#frame(curves);
    }
    for (const [one, q, n] of curves) if (!n || !this.curves.get(n).hasAttribute("d")) this.curves.get(n).setAttribute("d", this.#curve(one, q));
    const label = `${name}${this.unit ? ` in ${this.unit}` : ""} over ${viewer.main.scene.axis.label}: ${said}`;
    if (label !== this.label) this.svg.setAttribute("aria-label", this.label = label);
  }
  #curve(motion, q) {
    let text = "", pen = false;
    for (let k = 0; k < q.length; k++) {
      if (!Number.isFinite(q[k])) { pen = false; continue; }
      text += `${pen ? "L" : "M"}${this.x(motion.x[k]).toFixed(1)} ${this.y(q[k]).toFixed(1)}`;
      pen = true;
    }
    return text;
  }
  /** The grid with its numbers, events, and lines for the curves, which are drawn later. */
  #frame(curves) {
    const { viewer, svg } = this, [width, height] = this.size, { axis } = viewer.main.scene, parts = [];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.left = 56; this.wide = Math.max(40, width - this.left - 12); this.top = 8; this.tall = height - 30;
    const note = (x, y, anchor, words) => { const made = sv("text", { x, y, "text-anchor": anchor }); made.textContent = words; parts.push(made); };
    const line = (kind, x1, x2, y1, y2) => parts.push(sv("line", { class: kind, x1, x2, y1, y2 }));
    for (const y of ticks(this.least, this.most, 4)) {
      const at = this.y(y), zero = Math.abs(y) < 1e-9 * (this.most - this.least);
      line(zero ? "zero" : "grid", this.left, this.left + this.wide, at, at);
      note(this.left - 6, at + 4, "end", zero ? "0" : shown(y, 4));
    }
    const one = axis.label === "t" ? viewer.main.scene.units.time[1] : 1;
    let steps = ticks(this.low / one, this.high / one, clamp(Math.floor(this.wide / 60), 2, 9)).map((v) => v * one);
    if (axis.unit === "deg") {
      const step = [5, 10, 15, 30, 45, 60, 90, 180, 360, 720].find((s) => (this.high - this.low) / s <= this.wide / 48);
      if (step) { steps = []; for (let v = Math.ceil(this.low / step - 1e-6) * step; v <= this.high + 1e-6 * step; v += step) steps.push(v); }
    }
    for (const x of steps) {
      const at = this.x(x);
      line("grid", at, at, this.top, this.top + this.tall);
      note(at, this.top + this.tall + 15, "middle", axis.unit === "deg" ? `${shown(x, 4)}°` : shown(x / one, 4));
    }
    let before = -Infinity;
    for (const one of axis.values ? [] : viewer.main.data.events ?? []) {
      const at = this.x(one.t);
      if (at < before + 4) continue; // events without number, as of a ball that comes to rest
      before = at;
      line("event", at, at, this.top, this.top + this.tall);
    }
    this.curves = new Map(curves.map(([, , n]) => [n, sv("path", { class: n ? "curve other" : "curve", style: `stroke: var(--c${n % 6})` })]));
    this.cursor = sv("line", { class: "cursor", y1: this.top, y2: this.top + this.tall });
    this.dot = sv("circle", { r: 3.4, style: "fill: var(--text)" });
    svg.replaceChildren(...parts, ...[...this.curves.values()].reverse(), this.cursor, this.dot);
    this.unit = viewer.unitOf(this.name);
  }
  x(value) { return this.left + (value - this.low) / (this.high - this.low) * this.wide; }
  y(value) { return this.top + (this.most - value) / (this.most - this.least) * this.tall; }
  move() {
    const motion = this.viewer.main, value = this.viewer.inUnit(this.name, motion.value(this.name)), x = this.x(motion.value2(motion.x));
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const there = Number.isFinite(value);
    this.dot.style.display = there ? "" : "none";
    if (there) { this.dot.setAttribute("cx", x); this.dot.setAttribute("cy", this.y(value)); }
    this.output.textContent = `${shown(value)}${this.unit ? ` ${this.unit}` : ""}`;
  }
}
