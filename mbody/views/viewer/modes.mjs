// Bars of modes below the diagrams: what is open, sticks, slides or rolls, and when that changes.

import { el, sv } from "./elements.mjs";

/** Words of the modes, in the order of the key; the hatching tells them apart without colours. */
const MODE_WORDS = { open: "open", stick: "sticks", roll: "rolls", "slip+": "slides +", "slip-": "slides −" };
/** The same as parts of names in the page. */
const SHORT = { open: "open", stick: "stick", roll: "roll", "slip+": "plus", "slip-": "minus" };
/** Pixels: from bar to bar, the height of a bar, the width of the hatching. */
const PITCH = 20, BAR = 14, HATCH = 6;
/** Marks of impacts nearer than this are one. */
const IMPACTS_APART = 4;
let bars = 0;

/** From where to where signs last, half way from instant to instant; what is no number has no mode. */
function spans(x, signs) {
  const found = [], word = (sign) => (sign > 0 ? "slip+" : sign < 0 ? "slip-" : sign === 0 ? "stick" : "");
  for (let k = 0, low = x[0]; k < signs.length; k++) {
    const last = k === signs.length - 1, mode = word(signs[k]);
    if (!last && word(signs[k + 1]) === mode) continue;
    const high = last ? x[k] : 0.5 * (x[k] + x[k + 1]);
    if (mode) found.push([low, high, mode]);
    low = high;
  }
  return found;
}

/** A bar for every contact and rough joint, over the axis of the diagrams; it leads the picture where it is clicked. */
export class ModeBars {
  constructor(viewer) {
    this.viewer = viewer;
    this.id = `mode${++bars}`;
    this.svg = sv("svg", { role: "img", tabindex: "0" });
    this.output = el("output");
    this.key = el("p", { class: "key" });
    this.#take();
    this.root = el("div", { class: "plot modes" }, el("div", { class: "head" }, el("b", {}, "Modes"), this.output), this.svg, this.key);
    const go = (event) => {
      const box = this.svg.getBoundingClientRect();
      viewer.pause();
      viewer.goTo(viewer.main.find(this.low + (event.clientX - box.left - this.left) / this.wide * (this.high - this.low)));
    };
    this.svg.addEventListener("pointerdown", (event) => { this.svg.setPointerCapture(event.pointerId); go(event); });
    this.svg.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
    this.measure();
  }
  /** Take the modes of the motion, of a live page those of its present numbers, with their key. */
  #take() {
    const { main, live } = this.viewer, recorded = main.scene.modes ?? [], { x, count } = main;
    this.rows = recorded.filter((row) => row.spans);
    if (live) this.rows = this.rows.filter((row) => row.name in live.part.rubs).map((row) => ({ name: row.name, spans: spans(x, live.slipSigns(row.name)), impacts: [] }));
    this.low = Math.min(x[0], x[count - 1]);
    this.high = Math.max(x[0], x[count - 1]);
    const there = Object.keys(MODE_WORDS).filter((mode) => this.rows.some((row) => row.spans.some((span) => span[2] === mode)));
    this.key.replaceChildren(...there.map((mode) => el("span", {}, this.#swatch(mode), MODE_WORDS[mode])));
    if (this.rows.some((row) => row.impacts.length)) this.key.append(el("span", {}, "▾ impact"));
    const more = recorded.find((row) => row.left_out)?.left_out ?? 0;
    if (more) this.key.append(el("span", {}, `and ${more} more, which change less often`));
  }
  /** The motion of a live page is another. */
  renew() {
    this.#take();
    this.measure();
    this.move();
  }
  #swatch(mode) {
    const svg = sv("svg", { width: 26, height: BAR, viewBox: `0 0 26 ${BAR}`, "aria-hidden": "true" });
    const id = `${this.id}-key`;
    svg.append(...this.#patterns(id, [mode]), this.#bar(0.5, 25, 1, mode, id, BAR - 2));
    return svg;
  }
  /** The hatching of some modes. */
  #patterns(id, modes) {
    const lines = { "slip+": `M0 ${HATCH}L${HATCH} 0`, "slip-": `M0 0L${HATCH} ${HATCH}` };
    return modes.filter((mode) => lines[mode] || mode === "roll").map((mode) => {
      const pattern = sv("pattern", { id: `${id}-${SHORT[mode]}`, width: HATCH, height: HATCH, patternUnits: "userSpaceOnUse" });
      pattern.append(sv("rect", { width: HATCH, height: HATCH, class: `m-${SHORT[mode]}` }));
      pattern.append(mode === "roll" ? sv("circle", { cx: HATCH / 2, cy: HATCH / 2, r: 1.5, class: "m-dot" }) : sv("path", { d: lines[mode], class: "m-line" }));
      return sv("defs", {}, pattern);
    });
  }
  #bar(x, wide, y, mode, id, tall = BAR) {
    const fill = { open: "none", stick: "var(--soft)" }[mode] ?? `url(#${id}-${SHORT[mode]})`;
    const drawn = sv("rect", { x: x.toFixed(1), width: Math.max(wide, 1).toFixed(1), y, height: tall, class: "m-bar", style: `fill: ${fill}` });
    if (mode === "open") drawn.setAttribute("stroke-dasharray", "3 2");
    return drawn;
  }
  /** Draw the bars in the width that the page has. */
  measure() {
    const width = this.svg.clientWidth || 420, height = PITCH * this.rows.length + 4;
    this.left = 56;
    this.wide = Math.max(40, width - this.left - 12);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.svg.style.height = `${height}px`;
    const parts = this.#patterns(this.id, Object.keys(MODE_WORDS));
    this.rows.forEach((row, n) => {
      const y = PITCH * n + 4, name = sv("text", { x: this.left - 6, y: y + 11, "text-anchor": "end" });
      name.textContent = row.name.length > 9 ? `${row.name.slice(0, 8)}…` : row.name;
      parts.push(name);
      for (const [low, high, mode] of row.spans) {
        const ends = [this.x(low), this.x(high)].sort((a, b) => a - b), drawn = this.#bar(ends[0], ends[1] - ends[0], y, mode, this.id);
        drawn.dataset.mode = mode;
        drawn.append(sv("title", {}, `${row.name} ${MODE_WORDS[mode]}`));
        parts.push(drawn);
      }
      let before = -Infinity;
      for (const t of row.impacts) {
        const at = this.x(t);
        if (at < before + IMPACTS_APART) continue;
        before = at;
        parts.push(sv("path", { class: "m-impact", d: `M${at - 3.5} ${y - 4}h7l-3.5 6z` }));
      }
    });
    this.cursor = sv("line", { class: "cursor", y1: 0, y2: height });
    this.svg.replaceChildren(...parts, this.cursor);
    const said = this.rows.map((row) => `${row.name} ${row.spans.map((span) => MODE_WORDS[span[2]]).slice(0, 12).join(", ")}`).join("; ");
    this.svg.setAttribute("aria-label", `Modes over ${this.viewer.main.scene.axis.label}: ${said}`);
  }
  x(value) { return this.left + (value - this.low) / (this.high - this.low) * this.wide; }
  move() {
    const motion = this.viewer.main, now = motion.value2(motion.x), x = this.x(now);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const words = this.rows.map((row) => [row.name, row.spans.find(([low, high]) => now >= Math.min(low, high) && now <= Math.max(low, high))?.[2]]);
    this.output.textContent = words.slice(0, 3).map(([name, mode]) => `${name} ${MODE_WORDS[mode] ?? ""}`).join(", ");
  }
}
