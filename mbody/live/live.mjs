// The live part of a view: the core for browsers solves the model again while the reader drags a
// link, moves a number, or lets it run freely. It takes part in the viewer (viewer.mjs) as its
// `solver`: a motion whose histories are those of the present numbers, and a panel.

import { DEG, TURN, el, shown } from "../views/viewer/elements.mjs";
import { LiveModel } from "./live_model.mjs";

const STYLE = `
.live { margin-top: 0.8rem; border: 1px solid var(--line); border-radius: 8px; padding: 0.6rem 0.8rem; }
.live h2 { font-size: 1rem; margin: 0 0 0.25rem; }
.live p { margin: 0.2rem 0 0.5rem; color: var(--soft); font-size: 0.92rem; }
.plots.stale { opacity: 0.55; }
.live .message { min-height: 1.4em; color: var(--text); font-weight: 500; }
.live .message.bad { color: var(--load); }
.live .groups { columns: 21rem; column-gap: 1.8rem; }
.live fieldset { border: 0; padding: 0; margin: 0 0 0.4rem; min-width: 0; }
.live .row, .live legend { break-inside: avoid; }
.live legend { color: var(--soft); font-size: 0.88rem; padding: 0; margin-top: 0.3rem; }
.live .row { display: grid; grid-template-columns: minmax(6rem, 1.4fr) minmax(4rem, 1fr) 6.2rem 3.4rem; gap: 0.45rem; align-items: center; margin: 0.12rem 0; font-size: 0.92rem; }
.live .row .unit { color: var(--soft); font-size: 0.85rem; overflow-wrap: anywhere; }
.live .row .name { overflow-wrap: break-word; line-height: 1.2; }
.live .row.changed .name { font-weight: 650; color: var(--strong); }
.live input[type="range"] { width: 100%; min-width: 0; accent-color: var(--strong); }
.live input[type="number"] { font: inherit; width: 100%; min-width: 0; color: var(--text); background: var(--panel); border: 1px solid var(--line); border-radius: 5px; padding: 0.1rem 0.3rem; }
.live .drives { display: grid; gap: 0.2rem; max-width: 44rem; }
.live .table h2 { margin-top: 0.6rem; }
.live .why { font-size: 0.88rem; color: var(--soft); margin: 0.2rem 0; padding-left: 1.1rem; }
.live td.num, .live th.num { text-align: right; }
.stage svg .can { cursor: pointer; }
.stage svg { user-select: none; -webkit-user-select: none; }
@media print { .live .bar, .live .drives, .live .groups { display: none; } }
`;

const button = (text, title, act) => {
  const made = el("button", { type: "button", title }, text);
  made.addEventListener("click", act);
  return made;
};

/** The bytes of packed text. */
async function unpacked(text) {
  const packed = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** What solves the model of a page again, with its panel. */
class Solver extends LiveModel {
  // -- the panel ------------------------------------------------------------------------------

  begin() {
    const { viewer, part, content } = this;
    viewer.shadowRoot.append(el("style", {}, STYLE));
    if (content.others.length === 1) { // the recorded motion alone, which is the same as yet
      viewer.on.ghosts = false;
      viewer.switches.ghosts.setAttribute("aria-pressed", "false");
      viewer.switches.ghosts.textContent = "Recorded";
    }
    this.message = el("p", { class: "message", role: "status", "aria-live": "polite" });
    const panel = el("section", { class: "live", "aria-label": "live" }, el("h2", {}, "Change it"));
    const can = this.drives.length ? "Drag a link or a pin in the picture, or use the sliders: position and forces are solved again as you go."
      : "This motion is free: it is solved again from numbers that you change, and runs in real time.";
    panel.append(el("p", {}, can));
    if (content.others.length > 1) panel.append(el("p", {}, `Of the ${content.others.length} designs only the first, ${content.scene.design}, is solved again; the others are recorded.`));
    panel.append(this.message);
    if (this.drives.length) panel.append(this.#driveRows());
    const bar = el("div", { class: "bar" });
    if (this.free) {
      this.runButton = button("Run freely", "solve on in real time", () => this.run());
      bar.append(this.runButton, button("From the start", "begin the free motion again", () => this.restart()));
    }
    bar.append(button("As recorded", "all numbers as in the model", () => this.reset()));
    if (part.text.length && part.numbers.length) bar.append(button("Save changed model", `save ${this.#fileName()}`, () => this.save()));
    panel.append(bar, this.#numbers());
    this.table = el("table");
    this.peakBox = el("div", { class: "table", hidden: "" }, el("h2", {}, "Peaks, recorded and now"), this.table);
    panel.append(this.peakBox);
    viewer.body.after(panel);
    for (const drawn of this.drives.length ? viewer.picture.layers.world.querySelectorAll('[data-name^="link:"], [data-name^="pin:"], [data-name^="block:"]') : []) drawn.classList.add("can");
    this.showDrives();
  }
  #driveRows() {
    const box = el("div", { class: "drives" });
    this.driveInputs = this.drives.map((name) => {
      const turns = this.content.scene.turns[name], { angle, length } = this.content.scene.units, [unit, size] = turns ? angle : length, by = (turns ? 1 / DEG : 1) / size;
      const value = this.column(this.motion.found, `${name}.value`), low = Math.min(...value) * by, high = Math.max(...value) * by;
      const range = el("input", { type: "range", min: low, max: high, step: turns && unit === "deg" ? 0.5 : (high - low) / 400 || 1, "aria-label": `${name} in ${unit}` });
      const number = el("input", { type: "number", step: "any", "aria-label": `${name}, value in ${unit}` });
      const go = (input) => { if (input.value !== "" && this.guarded(() => this.walk({ [name]: input.value / by }))) this.say(""); };
      range.addEventListener("input", () => go(range));
      number.addEventListener("change", () => go(number));
      box.append(el("div", { class: "row" }, el("span", { class: "name" }, name), range, number, el("span", { class: "unit" }, unit)));
      return { name, range, number, by };
    });
    return box;
  }
  showDrives() {
    const now = this.driveInputs?.length ? this.present() : {};
    for (const { name, range, number, by } of this.driveInputs ?? []) {
      if (this.way.kind === "turn" && name === this.axisDriver) { const first = this.home[name]; now[name] -= Math.floor((now[name] - first) / TURN + 1e-9) * TURN; }
      range.value = now[name] * by;
      if (this.viewer.shadowRoot.activeElement !== number) number.value = Math.abs(now[name]) < 1e-12 * this.scaleOf(name) ? 0 : +(now[name] * by).toPrecision(8);
    }
  }
  #numbers() {
    const groups = new Map(), zeros = [], fixed = new Map(Object.entries(this.part.fixed));
    this.inputs = [];
    this.moving = new Set();
    for (const one of this.part.numbers) {
      one.now = one.value;
      const names = Object.keys(one.factors);
      if (one.why) { for (const name of names) fixed.set(name, one.why); continue; }
      if (one.moves) names.forEach((name) => this.moving.add(name));
      const row = this.#row(one, names.join(", "));
      if (one.value === 0 && one.group !== "loads") zeros.push(row);
      else groups.set(one.group, [...(groups.get(one.group) ?? []), row]);
    }
    const box = el("details", { open: "" }, el("summary", {}, "Numbers of the model"));
    const order = ["parameters", "drivers", "loads", "masses", "lengths and places"].filter((name) => groups.has(name));
    const all = el("div", { class: "groups" });
    for (const name of order) all.append(el("fieldset", {}, el("legend", {}, name), ...groups.get(name)));
    box.append(all);
    if (zeros.length) box.append(el("details", {}, el("summary", {}, `${zeros.length} numbers that are zero`), el("div", { class: "groups" }, el("fieldset", {}, ...zeros))));
    if (fixed.size || this.part.why) {
      const why = el("ul", { class: "why" });
      if (this.part.why) why.append(el("li", {}, this.part.why));
      const reasons = new Map();
      for (const [name, text] of fixed) reasons.set(text, [...(reasons.get(text) ?? []), name]);
      for (const [text, names] of reasons) why.append(el("li", {}, `${names.join(", ")}: ${text}`));
      box.append(el("details", {}, el("summary", {}, "Numbers that cannot be changed here"), why));
    }
    return box;
  }
  #row(one, names) {
    const size = Math.abs(one.value), length = this.model.manifest.length;
    let low = 0, high = 2 * one.value;
    if (one.value < 0) [low, high] = [2 * one.value, 0];
    if (one.unit === "deg" || one.unit === "rad") { const by = one.unit === "deg" ? 45 : 45 * DEG; [low, high] = [one.value - by, one.value + by]; }
    if (one.sign === "positive") low = 0.05 * size;
    if (!one.value) [low, high] = one.group === "lengths and places" && one.unit !== "deg" ? [-0.25 * length, 0.25 * length] : one.unit === "deg" ? [-45, 45] : [one.sign ? 0 : -1, 1];
    const step = (high - low) / 400;
    const range = el("input", { type: "range", min: low, max: high, step, "aria-label": `${names} in ${one.unit || "1"}` });
    const number = el("input", { type: "number", step: "any", "aria-label": `${names}, value in ${one.unit || "1"}` });
    const text = el("span", { class: "name" });
    for (const part of names.split(/(?<=[._])/)) text.append(part, el("wbr"));
    const row = el("div", { class: "row" }, text, range, number, el("span", { class: "unit" }, one.unit.replaceAll("*", "·").replaceAll("^2", "²").replaceAll("^3", "³")));
    const show = () => { range.value = one.now; number.value = one.now; row.classList.toggle("changed", one.now !== one.value); };
    one.show = show;
    let wanted = null;
    range.addEventListener("input", () => {
      const own = Math.abs(+range.value - one.value) < 0.5 * step ? one.value : +(+range.value).toPrecision(6);
      if (wanted === null) requestAnimationFrame(() => { const value = wanted; wanted = null; if (value !== one.now) this.slide(one, value); });
      wanted = own;
    });
    range.addEventListener("change", () => requestAnimationFrame(() => this.settle()));
    number.addEventListener("change", () => this.enter(one, number.value === "" ? NaN : +number.value));
    show();
    return row;
  }
  given(one) {
    return Object.fromEntries(Object.entries(one.factors).map(([name, factor]) => [name, one.now * factor]));
  }
  /** Set numbers of the file by a name that they give, in the unit of the file. */
  set(values) {
    this.settle();
    const given = {}, touched = [];
    for (const [name, value] of Object.entries(values)) {
      const one = this.part.numbers.find((own) => name in own.factors);
      if (!one || one.why) throw new this.api.MbodyError(`'${name}' cannot be changed on this page${one ? `: ${one.why}` : ""}`);
      touched.push([one, one.now]);
      one.now = value;
      Object.assign(given, this.given(one));
    }
    const good = this.guarded(() => this.change(given));
    for (const [one, old] of touched) { if (!good) one.now = old; one.show?.(); }
    return good;
  }
  /** All numbers as in the model. */
  reset() {
    this.settle();
    if (this.running) this.pause();
    const given = {};
    for (const one of this.part.numbers) if (one.now !== one.value) { one.now = one.value; Object.assign(given, this.given(one)); one.show?.(); }
    if (Object.keys(given).length && !this.guarded(() => this.change(given))) return;
    this.started = false;
    this.changed = false;
    if (Object.keys(given).length) { this.motion.fill(this.motion.found); this.viewer.renew(); }
    if (this.viewer.on.ghosts && this.content.others.length === 1) this.viewer.toggle("ghosts");
    this.hideContacts();
    this.peakBox.hidden = true;
    if (this.viewer.beside) this.viewer.arranged();
    this.viewer.goTo(0);
    this.showDrives();
    this.say("");
  }
  showPeaks() {
    const names = [...new Set([...this.viewer.plots.map((plot) => plot.name), ...this.drives.map((name) => `${name}.effort`), ...this.content.scene.forces.filter((one) => !one.load).map((one) => `${one.of}.force`)])];
    const peak = (q) => { let most = 0; for (const v of q ?? []) if (Math.abs(v) > Math.abs(most)) most = v; return most; };
    const body = el("tbody");
    for (const name of names.slice(0, 12)) {
      const now = this.motion.history(name), old = this.motion.recorded.history(name);
      if (!now || !old || !now.some(Number.isFinite)) continue;
      const [a, b] = [peak(old), peak(now)], ratio = Math.abs(a) > 1e-9 * Math.abs(b) && a ? 100 * (b / a - 1) : NaN;
      const [then, present] = [a, b].map((v) => shown(this.viewer.inUnit(name, v)));
      body.append(el("tr", {}, el("th", { scope: "row" }, name), el("td", { class: "num" }, then), el("td", { class: "num" }, present), el("td", {}, this.viewer.unitOf(name)), el("td", { class: "num" }, Number.isFinite(ratio) ? `${ratio >= 0 ? "+" : ""}${shown(Math.round(10 * ratio) / 10, 4)} %` : "")));
    }
    this.table.replaceChildren(el("thead", {}, el("tr", {}, ...["quantity", "recorded", "now", "unit", "change"].map((text, n) => el("th", { scope: "col", ...(n === 1 || n === 2 || n === 4 ? { class: "num" } : {}) }, text)))), body);
    this.peakBox.hidden = false;
  }

  // -- the file -------------------------------------------------------------------------------

  /** The model file with the present numbers. */
  file() {
    const { text, numbers } = this.part;
    return text.map((part, n) => part + (n < numbers.length ? String(numbers[n].now) : "")).join("");
  }
  #fileName() { return (this.content.made.name ?? "model.toml").replace(/\.toml$/, this.changed ? "-changed.toml" : ".toml"); }
  save() {
    const link = el("a", { href: URL.createObjectURL(new Blob([this.file()], { type: "application/toml" })), download: this.#fileName() });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
}

/** Take part in the viewer. */
export function begin(viewers, api) {
  Solver.prototype.api = api;
  viewers.solver = async (viewer, content) => {
    try {
      const core = await api.Core.load(await unpacked(content.live.core));
      return new Solver(viewer, content, core, await unpacked(content.live.image));
    } catch (error) {
      content.recorded = `This page shows the recorded motion; it cannot solve the model again: ${error.message}.`;
      return null;
    }
  };
}
