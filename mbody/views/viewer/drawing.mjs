// The shapes of a motion as SVG, and arrows.

import { sv } from "./elements.mjs";

/** The shapes of one motion as SVG, in points of the paper; moved by transforms. */
export class Drawing {
  /** In a layer of points, each so many lengths; of all shapes or of some, with or without names. */
  constructor(motion, layer, unit, { named = true, shapes = motion.scene.shapes } = {}) {
    Object.assign(this, { motion, unit, groups: [], stretched: [], strokes: [], fixed: [], sensed: [] });
    let last = null;
    for (const shape of shapes) {
      const carrier = motion.scene.carriers[shape.c];
      const drawn = sv(shape.k === "c" ? "circle" : "path", { class: `s-${shape.k}` });
      drawn.style.fill = shape.k === "l" || shape.f === "none" ? "none" : `var(--${shape.f})`;
      drawn.style.stroke = shape.e === "none" ? "none" : `var(--${shape.e})`;
      drawn.setAttribute("stroke-linecap", "round");
      drawn.setAttribute("stroke-linejoin", "round");
      drawn.setAttribute("vector-effect", "non-scaling-stroke");
      if (shape.n && named) drawn.dataset.name = shape.n;
      this.strokes.push([drawn, shape.w, shape.d]);
      if (shape.s) this.sensed.push([drawn, ...shape.s]);
      if (carrier.x) {
        layer.append(drawn);
        this.stretched.push([drawn, shape]);
        last = null;
        continue;
      }
      this.#outline(drawn, shape);
      this.fixed.push([drawn, shape]);
      if (last?.c !== shape.c) {
        last = { c: shape.c, g: sv("g") };
        layer.append(last.g);
        this.groups.push(last);
      }
      last.g.append(drawn);
    }
  }
  #outline(drawn, shape) {
    if (shape.k === "c") {
      drawn.setAttribute("cx", shape.p[0] / this.unit);
      drawn.setAttribute("cy", shape.p[1] / this.unit);
      drawn.setAttribute("r", shape.r / this.unit);
    } else drawn.setAttribute("d", path(shape, (k) => [shape.p[k], shape.p[k + 1]], 2, this.unit));
  }
  /** Draw shapes again that have other points. */
  renew() { for (const [drawn, shape] of this.fixed) this.#outline(drawn, shape); }
  /** Widths in pixels for so many of them a point. */
  width(px) {
    for (const [drawn, width, dashes] of this.strokes) {
      drawn.setAttribute("stroke-width", (width * px).toFixed(2));
      if (dashes.length) drawn.setAttribute("stroke-dasharray", dashes.map((d) => (d * width * px).toFixed(1)).join(" "));
    }
  }
  /** With forces beside it the arrow of a drive is its effort, where it has one, else its rate. */
  #sense(quantity, forces) {
    if (!quantity.startsWith("drive:")) return this.motion.value(quantity);
    const name = quantity.slice(6);
    return (forces && this.motion.value(`${name}.effort`)) || this.motion.value(`${name}.rate`);
  }
  move(forces = false) {
    const { frames } = this.motion, u = this.unit;
    for (const { c, g } of this.groups) {
      const o = 5 * c, a = frames[o + 2], b = frames[o + 3];
      g.setAttribute("transform", `matrix(${a} ${b} ${-b} ${a} ${frames[o] / u} ${frames[o + 1] / u})`);
    }
    for (const [drawn, quantity, sign] of this.sensed) drawn.style.display = sign * this.#sense(quantity, forces) > 0 ? "" : "none";
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
export function arrow(x, y, dx, dy) {
  const length = Math.hypot(dx, dy), u = dx / length, v = dy / length;
  const head = Math.min(11, 0.6 * length), w = 1.15, s = 0.4 * head, l = length - head;
  const at = (a, b) => `${(x + a * u - b * v).toFixed(1)} ${(y + a * v + b * u).toFixed(1)}`;
  return `M${at(0, w)}L${at(l, w)}L${at(l, s)}L${at(length, 0)}L${at(l, -s)}L${at(l, -w)}L${at(0, -w)}Z`;
}
