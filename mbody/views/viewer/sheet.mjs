// A sheet with a camera: layers of an SVG, places and pixels, arrows and names that keep clear of
// each other, and the pointer that moves the view. Pictures of a motion are sheets.

import { sv } from "./elements.mjs";
import { arrow } from "./drawing.mjs";
import { ARROW_WEIGHT, FreePlaces, write } from "./names.mjs";

/** Pixels of the shortest arrow that is drawn. */
const LEAST = 2.5;

/** Of its class are `camera` {s, x, y}: pixels a unit and of the origin; `unit`: its length; `wide` and `tall` in pixels. */
export class Sheet {
  constructor(layers, attributes) {
    this.svg = sv("svg", attributes);
    this.layers = {};
    for (const layer of layers) this.svg.append(this.layers[layer] = sv("g", { class: layer }));
  }

  // -- pixels and places ------------------------------------------------------------------------

  screen([x, y]) {
    const { s, x: x0, y: y0 } = this.camera, u = this.unit;
    return [x0 + s * x / u, y0 - s * y / u];
  }
  world([x, y]) {
    const { s, x: x0, y: y0 } = this.camera, u = this.unit;
    return [(x - x0) * u / s, (y0 - y) * u / s];
  }
  /** Pixels of an event on the sheet. */
  here(event) {
    const box = this.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }
  /** Places of the layers in units, by the camera. */
  get matrix() { return `matrix(${this.camera.s} 0 0 ${-this.camera.s} ${this.camera.x} ${this.camera.y})`; }

  // -- arrows and names -------------------------------------------------------------------------

  /** Begin to place arrows and names. */
  clear() { this.places = new FreePlaces(this.wide, this.tall); }
  /** An arrow {path, text, label} of so many pixels at a pixel; too short a one is hidden. */
  putArrow(one, [x, y], dx, dy) {
    const long = Math.hypot(dx, dy), seen = long > LEAST;
    if (one.seen !== seen) for (const drawn of [one.path, one.text]) if (drawn) drawn.style.display = seen ? "" : "none";
    one.seen = seen;
    if (!seen) return;
    one.path.setAttribute("d", arrow(x, y, dx, dy));
    if (one.text) {
      if (!one.text.firstChild) write(one.text, one.label);
      Object.assign(one, { x0: x, y0: y, dx, dy, long });
    }
    this.places.stroke(x, y, x + dx, y + dy, 1.5, ARROW_WEIGHT);
  }
  /** A name at the best of the places of half its size. */
  putName(label, spots) {
    if (!label.wide) { const box = label.text.getBBox?.(); label.wide = box?.width || 8 * (label.t ?? label.label).length; }
    this.places.put(label, spots(0.5 * label.wide + 2, 7));
  }

  // -- the pointer ------------------------------------------------------------------------------

  /** Wheel and two fingers zoom, one pointer moves the view where `grab` does not want it.
      `on`: grab(event) → whether it does, drag(event) → whether it did, drop(event), second(event) →
      whether a second finger ends what was grabbed; zoom(factor, pixel), moved(), hover(event), clicked(pixel), left(). */
  listen(on) {
    const { svg } = this, fingers = new Map();
    let held = null;
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      on.zoom(Math.exp(-0.0016 * event.deltaY), this.here(event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      this.moved = 0;
      if ((held || fingers.size) && on.second?.(event)) { if (held) fingers.set(...held); }
      else if (!fingers.size && on.grab(event)) { held = [event.pointerId, this.here(event)]; return; }
      held = null;
      fingers.set(event.pointerId, this.here(event));
    });
    svg.addEventListener("pointermove", (event) => {
      const here = this.here(event), before = fingers.get(event.pointerId);
      if (held?.[0] === event.pointerId) held[1] = here;
      if (on.drag(event)) { this.moved += 4; return; }
      if (!before) return on.hover(event);
      const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      if (others.length) {
        const [o] = others, old = Math.hypot(before[0] - o[0], before[1] - o[1]), now = Math.hypot(here[0] - o[0], here[1] - o[1]);
        if (old > 0) on.zoom(now / old, o);
      } else {
        this.camera.x += here[0] - before[0];
        this.camera.y += here[1] - before[1];
        this.moved += Math.abs(here[0] - before[0]) + Math.abs(here[1] - before[1]);
        on.moved();
      }
      fingers.set(event.pointerId, here);
    });
    const up = (event) => { // also beside the sheet, should the capture be lost
      if (held?.[0] !== event.pointerId && !fingers.has(event.pointerId)) return;
      if (held?.[0] === event.pointerId) held = null;
      on.drop(event);
      fingers.delete(event.pointerId);
      if (this.moved < 4 && event.type === "pointerup") on.clicked(this.here(event));
    };
    addEventListener("pointerup", up);
    addEventListener("pointercancel", up);
    svg.addEventListener("pointerleave", () => on.left());
  }
}
