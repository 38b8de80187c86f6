// The viewer of mbody: one element, <mbody-viewer>, that plays a recorded motion.
//
// Its document is {"data", "scene", "others", "made"}: `data` as `run.data()` has it, `scene` the
// shapes in the axes of what carries them. A page holds them in two scripts, a lecturer's page
// names a file: <mbody-viewer src="pump.json"></mbody-viewer>. Nothing else is ever requested.

import { MINUS, clamp, el, shown } from "./elements.mjs";
import { Motion, locate } from "./motion.mjs";
import { Picture, longest } from "./picture.mjs";
import { Plot } from "./plot.mjs";
import { ModeBars } from "./modes.mjs";
import { FreeBodyPanel } from "./free_body.mjs";
import { PolygonPanel } from "./poles.mjs";

const CSS = /*css*/"";

const SWITCHES = [
  ["names", "Names", "n", true], ["forces", "Forces", "f", false], ["velocities", "Velocities", "v", false],
  ["accelerations", "Accelerations", "a", false], ["paths", "Paths", "p", true], ["centres", "Mass centres", "c", true],
  ["ghosts", "Other designs", "g", true], ["free", "Free body", "b", false],
  ["poles", "Instant centres", "i", false], ["polygons", "Polygons", "y", false],
];
/** How several designs are shown. */
const ARRANGEMENTS = ["ghosted", "side by side"];
/** Pixels beside the motion in a picture, and between pictures. */
const EDGE = 34, NARROW = 20, BETWEEN = 1;

export class Viewer extends HTMLElement {
  /** Makes what solves the model of a document again; set by the module of live pages. */
  static solver = null;
  /** What solves the model again while the user drags; null where the motion is recorded. */
  live = null;

  /** Attach what solves the model again; the page no longer says that it shows a recorded motion. */
  attach(live) {
    this.live = live;
    if (this.recorded) this.recorded.hidden = Boolean(live);
  }

  async connectedCallback() {
    if (this.shadowRoot) return;
    this.attachShadow({ mode: "open" });
    if (CSS) this.shadowRoot.append(el("style", {}, CSS));
    else for (const name of ["palette", "viewer"]) this.shadowRoot.append(el("link", { rel: "stylesheet", href: new URL(`${name}.css`, import.meta.url) }));
    this.root = el("div", { class: "mbody", tabindex: "-1" });
    this.shadowRoot.append(this.root);
    try {
      const content = await this.#document();
      if (content.live && Viewer.solver) this.attach(await Viewer.solver(this, content));
      this.show(content);
    } catch (error) {
      this.root.replaceChildren(el("p", { role: "alert" }, `This motion cannot be shown: ${error.message}`));
      throw error;
    }
  }
  disconnectedCallback() { this.pause(); this.watch?.disconnect(); }

  async #document() {
    const src = this.getAttribute("src");
    if (src) {
      const answer = await fetch(src);
      if (!answer.ok) throw new Error(`'${src}' was not found (${answer.status})`);
      return answer.json();
    }
    const inside = this.querySelector('script[type="application/json"]');
    if (inside) return JSON.parse(inside.textContent);
    const read = (key) => JSON.parse(document.getElementById(this.getAttribute(key)).textContent);
    return { data: read("data"), ...read("scene") };
  }

  /** Show a document: {data, scene, others, made}. */
  show(content) {
    this.content = content;
    const { data, scene, others = [], made = {} } = content;
    this.main = this.live?.motion ?? new Motion(data, scene);
    this.motions = [this.main, ...others.map((one) => new Motion(one.data, one.scene))];
    this.made = made;
    this.at = 0;
    this.beside = false;
    this.most = longest(this.motions);
    this.on = Object.fromEntries(SWITCHES.map(([key, , , first]) => [key, scene.on?.includes(key) ?? first]));
    this.quantities = this.#quantities();
    this.#build();
    this.#fit();
    this.live?.begin();
    this.draw();
    this.#say();
    if (this.hasAttribute("whole")) window.mbody = this.#door();
    this.dispatchEvent(new CustomEvent("ready"));
  }

  #quantities() {
    const { data, scene } = this.main, found = [];
    const add = (group, names) => { if (names.length) found.push([group, names]); };
    const fields = (table, keys) => Object.entries(table ?? {}).flatMap(([name, own]) =>
      keys.filter((key) => Array.isArray(own[key]) || (key === "force" && own.fx)).map((key) => `${name}.${key}`));
    add("measures", [...new Set([...scene.plots.map((one) => one.name).filter((n) => !n.includes(".") || data.measures[n] || scene.plots.find((p) => p.name === n).values),
      ...Object.keys(data.measures).filter((name) => data.measures[name])])]);
    add("drivers", [...Object.keys(data.efforts).map((name) => `${name}.effort`), ...fields(scene.driven, ["value", "rate", "acceleration"])]);
    add("joints", fields(data.reactions, ["force", "fx", "fy", "torque"]));
    add("friction", [...Object.keys(data.contacts ?? {}).map((name) => `${name}.contact`), ...Object.keys(data.losses ?? {}).map((name) => `${name}.loss`)]);
    add("loads", fields(data.loads, ["force", "fx", "fy", "torque", "length", "angle", "rate"]));
    const bodies = this.main.count * Object.keys(data.bodies).length > 2e5 ? {} : data.bodies;
    add("bodies", fields(bodies, ["angle", "omega", "alpha", "x", "y", "vx", "vy", "ax", "ay"]));
    add("points", fields(data.points, ["x", "y", "vx", "vy", "ax", "ay"]));
    return found;
  }
  unitOf(name) { return this.#unit(name)[0]; }
  /** A value of the data in the unit that is shown. */
  inUnit(name, value) { return value / this.#unit(name)[1]; }
  /** The unit of a quantity, and how many of the data's units one of it is. */
  #unit(name) {
    const { scene, data } = this.main, units = scene.units;
    const plotted = scene.plots.find((one) => one.name === name);
    if (plotted) return [plotted.unit, 1];
    if (name in (scene.measures ?? {})) return scene.measures[name];
    const cut = name.lastIndexOf("."), owner = name.slice(0, cut), key = name.slice(cut + 1);
    const turns = scene.turns[owner];
    if (key === "effort") return turns ? units.torque : units.force;
    if (key === "contact") return units.force;
    if (key === "loss") return units.power;
    if (key === "value") return turns ? units.angle : units.length;
    if (key === "rate" || key === "acceleration") {
      const angular = turns ?? Boolean(data.loads[owner]?.angle);
      return key === "rate" ? (angular ? units.omega : units.v) : (angular ? units.alpha : units.a);
    }
    return { x: units.length, y: units.length, length: units.length, angle: units.angle, vx: units.v, vy: units.v, omega: units.omega,
      ax: units.a, ay: units.a, alpha: units.alpha, fx: units.force, fy: units.force, force: units.force, torque: units.torque }[key] ?? ["", 1];
  }

  // -- building -------------------------------------------------------------------------------

  #build() {
    const { data, scene } = this.main, root = this.root;
    root.replaceChildren();
    const button = (text, attributes, act) => {
      const made = el("button", { type: "button", ...attributes }, text);
      made.addEventListener("click", act);
      return made;
    };
    const title = el("h1", {}, data.model);
    const head = el("header", {}, title, button("Dark / light", { title: "change between dark and light" }, () => this.#theme(!root.classList.contains("dark"))));
    if (this.made.file) head.append(button("Model file", { title: `save ${this.made.name}` }, () => this.#save()));
    this.where = el("p", { class: "where" });
    this.stage = el("div", { class: "stage" });
    this.tip = el("div", { class: "tip", hidden: "" });
    this.stage.append(el("div", { class: "zoom" },
      button("+", { title: "zoom in (+)", "aria-label": "zoom in" }, () => this.zoom(1.3)),
      button(MINUS, { title: "zoom out (−)", "aria-label": "zoom out" }, () => this.zoom(1 / 1.3)),
      button("Fit", { title: "show the whole motion (0)" }, () => { this.#fit(); this.draw(); })), this.tip);
    this.size = el("input", { class: "size", type: "range", min: -2, max: 2, step: 0.1, value: 0, "aria-label": "length of the arrows" });
    this.size.addEventListener("input", () => this.draw());
    this.pictures = [new Picture(this, 0)];
    this.stage.prepend(this.picture.root);
    this.picture.describe(false);

    this.playing = false;
    this.playButton = button("Play", { class: "play", "aria-keyshortcuts": "Space" }, () => (this.playing ? this.pause() : this.play()));
    this.scrub = el("input", { class: "scrub", type: "range", min: 0, max: this.main.count - 1, step: 1, value: 0, "aria-label": "instant" });
    this.scrub.addEventListener("input", () => { this.pause(); this.goTo(+this.scrub.value); });
    this.speed = el("select", { "aria-label": "speed" });
    for (const factor of [0.1, 0.25, 0.5, 1, 2, 4]) this.speed.append(el("option", { value: factor }, `${factor} ×`));
    this.speed.value = "1";
    this.speed.addEventListener("change", () => this.draw());
    const bar = el("div", { class: "bar" }, this.playButton,
      button("◂", { title: "one instant back (←)", "aria-label": "one instant back" }, () => this.step(-1)),
      button("▸", { title: "one instant on (→)", "aria-label": "one instant on" }, () => this.step(1)),
      this.scrub, el("label", {}, "Speed ", this.speed));
    const toggles = el("div", { class: "bar", role: "group", "aria-label": "what is shown" });
    this.switches = {};
    for (const [key, text, shortcut] of SWITCHES) {
      if (!this.#has(key)) continue;
      const made = button(text, { "aria-pressed": this.on[key], title: `${text.toLowerCase()} on and off (${shortcut})`, "aria-keyshortcuts": shortcut }, () => this.toggle(key));
      toggles.append(this.switches[key] = made);
    }
    toggles.append(el("label", {}, "Arrows ", this.size));
    if (this.motions.length > 1) {
      this.arrangement = el("select", { "aria-label": "several designs", "aria-keyshortcuts": "d", title: "several designs (d)" });
      for (const text of ARRANGEMENTS) this.arrangement.append(el("option", { value: text }, text));
      this.arrangement.addEventListener("change", () => this.arrange(this.arrangement.value));
      toggles.append(this.arrangement);
    }

    this.free = scene.free ? new FreeBodyPanel(this) : null;
    this.polygons = scene.poles ? new PolygonPanel(this) : null;
    const left = el("div", {}, this.stage, bar, toggles, ...[this.free, this.polygons].filter(Boolean).map((one) => one.root));
    this.plotBox = el("div", { class: "plots" });
    this.body = el("div", { class: "body" }, left, this.plotBox);
    this.said = el("div", { class: "said", "aria-live": "polite" });
    root.append(head, this.where, this.body, this.said);
    if (this.motions.length > 1) {
      const legend = el("div", { class: "legend" });
      this.motions.forEach((one, n) => legend.append(el("span", {}, el("i", { style: `border-color: var(--c${n % 6})` }), one.scene.design || data.model)));
      this.where.after(legend);
    }
    root.append(this.#values(), this.#about());
    this.plots = [];
    const over = `over ${scene.axis.label}${scene.axis.unit && scene.axis.unit !== "deg" ? ` [${scene.axis.unit}]` : ""}`;
    for (const one of scene.plots.slice(0, 3)) {
      const plot = new Plot(this, one.name);
      this.plotBox.append(plot.root);
      this.plots.push(plot);
    }
    this.modes = scene.modes?.length ? new ModeBars(this) : null;
    if (this.modes) this.plotBox.append(this.modes.root);
    if (this.plots.length || this.modes) this.plotBox.append(el("p", { class: "over" }, over));
    this.#theme(null);
    this.#listen();
  }
  #has(key) {
    const { scene } = this.main;
    return { names: scene.labels.length, forces: scene.forces.length, velocities: scene.movers.length, accelerations: scene.movers.length && scene.rates,
      paths: scene.movers.length, centres: scene.shapes.some((s) => s.n.startsWith("cg:")), ghosts: this.motions.length > 1, free: scene.free, poles: scene.poles?.centres.length, polygons: scene.poles }[key];
  }
  /** The first picture: of the motion that the page is about. */
  get picture() { return this.pictures[0]; }
  /** The pictures that are shown. */
  get seen() { return this.beside && this.on.ghosts ? this.pictures.filter(({ n }) => !n || this.live?.shows(n) !== false) : [this.picture]; }
  /** Show several designs "ghosted" in one picture, or "side by side" in pictures at one scale. */
  arrange(how) {
    this.beside = how === ARRANGEMENTS[1] && this.motions.length > 1;
    if (this.arrangement) this.arrangement.value = ARRANGEMENTS[+this.beside];
    if (this.beside && !this.on.ghosts) this.#switch("ghosts", true);
    if (this.beside && this.pictures.length === 1) {
      this.pictures.push(...this.motions.slice(1).map((_, n) => new Picture(this, n + 1)));
      this.picture.root.after(...this.pictures.slice(1).map((one) => one.root));
    }
    this.arranged();
    this.said.textContent = `designs ${how}`;
  }
  /** Place the pictures that are to be seen. */
  arranged() {
    const { seen } = this;
    for (const one of this.pictures) {
      one.root.hidden = !seen.includes(one);
      one.describe(seen.length > 1);
      one.showTracks();
    }
    this.#fit();
    this.draw();
  }
  /** Show the path of a point, or hide it. */
  trace(name, on) { for (const one of this.pictures) one.trace(name, on); }
  /** Show histories and shapes that have changed, and the whole motion where it needs more room. */
  renew(grown = false) {
    if (grown) this.#fit();
    this.picture.renew();
    this.free?.renew();
    for (const plot of this.plots) plot.renew();
    if (this.live) this.modes?.renew();
    this.#tabulate();
    this.draw();
  }
  #values() {
    this.table = el("table");
    this.tableBox = el("details", {}, el("summary", {}, "All values at this instant"), el("div", { class: "table", tabindex: "0" }, this.table));
    this.tableBox.addEventListener("toggle", () => this.#tabulate());
    return this.tableBox;
  }
  #tabulate() {
    if (!this.tableBox.open || this.playing) return;
    const rows = [el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "quantity"), el("th", { scope: "col" }, "value"), el("th", { scope: "col" }, "unit")))];
    const body = el("tbody");
    for (const [, names] of this.quantities) for (const name of names.slice(0, 400)) {
      body.append(el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, shown(this.inUnit(name, this.main.value(name)), 7)), el("td", {}, this.unitOf(name))));
    }
    this.table.replaceChildren(...rows, body);
  }
  #about() {
    const { data, scene } = this.main, made = this.made, lines = [];
    const notes = el("ul", { class: "notes" });
    const doubts = (data.doubts ?? []).map((one) => one.message ?? one), more = [...(data.notes ?? []), ...(scene.notes ?? [])];
    for (const text of [...doubts.map((one) => `In doubt: ${one}`), ...more.filter((one) => !doubts.includes(one))]) notes.append(el("li", {}, text));
    this.recorded = el("li", {}, this.content.recorded ?? `This page shows the recorded motion, ${this.main.count} instants; it does not solve the model again.`);
    this.recorded.hidden = Boolean(this.live);
    notes.append(this.recorded);
    lines.push(`${data.analysis} by mbody ${data.mbody}: ${data.status}.`);
    if (made.command) lines.push("Made by: ", el("code", {}, made.command));
    const about = el("details", {}, el("summary", {}, "How this was made"), el("p", {}, ...lines.flatMap((l) => [l, " "])));
    if (data.digest) about.append(el("p", {}, "SHA-256 of the model file: ", el("code", {}, data.digest)));
    if (made.why) about.append(el("p", {}, made.why));
    about.append(el("p", {}, "Keys: Space plays, ← and → step (with Shift by ten), Home and End, + and − zoom, 0 fits, n f v a p c g b i y switch what is shown, d puts several designs side by side. Drag moves the picture, a click on a pin or point shows its path."));
    return el("div", {}, notes, about);
  }
  #theme(dark) {
    const system = matchMedia("(prefers-color-scheme: dark)");
    if (dark === null && !this.themed) { this.themed = true; system.addEventListener("change", (event) => this.#theme(event.matches)); }
    const own = this.getAttribute("theme");
    const is = dark ?? (own ? own === "dark" : system.matches);
    this.root.classList.toggle("dark", is);
    this.root.classList.toggle("light", !is);
    if (this.hasAttribute("whole")) document.documentElement.style.background = is ? "#151b21" : "#ffffff";
  }
  #save() {
    const link = el("a", { href: URL.createObjectURL(new Blob([this.made.file], { type: "application/toml" })), download: this.made.name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // -- the user -------------------------------------------------------------------------------

  #listen() {
    if (!this.keyed) {
      this.keyed = true;
      this.root.addEventListener("keydown", (event) => this.#key(event));
      if (this.hasAttribute("whole")) document.addEventListener("keydown", (event) => { if (event.target === document.body) this.#key(event); });
      this.watch = new ResizeObserver(() => this.#resized());
      this.watch.observe(this);
    }
  }
  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.composedPath()[0], tag = target.tagName;
    if (tag === "SELECT" || (tag === "INPUT" && event.key !== " ")) return;
    if ((tag === "BUTTON" || tag === "SUMMARY") && (event.key === " " || event.key === "Enter")) return;
    const by = event.shiftKey ? 10 : 1, own = SWITCHES.find(([, , key]) => key === event.key.toLowerCase());
    const acts = { " ": () => (this.playing ? this.pause() : this.play()), ArrowLeft: () => this.step(-by), ArrowRight: () => this.step(by),
      Home: () => { this.pause(); this.goTo(0); }, End: () => { this.pause(); this.goTo(this.main.count - 1); },
      d: () => this.motions.length > 1 && this.arrange(ARRANGEMENTS[+!this.beside]), "+": () => this.zoom(1.3), "-": () => this.zoom(1 / 1.3), 0: () => { this.#fit(); this.draw(); } };
    const act = acts[event.key] ?? (own && this.switches[own[0]] ? () => this.toggle(own[0]) : null);
    if (act) { event.preventDefault(); act(); }
  }
  #resized() {
    const before = this.wide;
    this.#sized();
    if (before === this.wide) return;
    this.#fit();
    for (const plot of this.plots) plot.show(plot.name);
    this.modes?.measure();
    this.draw();
  }
  toggle(key) {
    this.#switch(key, !this.on[key]);
    if (key === "free") this.free.renew();
    if (key === "ghosts" && this.beside) this.arranged();
    else this.draw();
    this.said.textContent = `${SWITCHES.find(([k]) => k === key)[1]} ${this.on[key] ? "on" : "off"}`;
  }

  #switch(key, on) {
    this.on[key] = on;
    this.switches[key]?.setAttribute("aria-pressed", on);
  }

  // -- the camera -----------------------------------------------------------------------------

  /** The rectangle that all motions need. */
  #box() {
    const boxes = this.motions.map((one) => one.scene.box);
    return { low: [0, 1].map((i) => Math.min(...boxes.map((b) => b.low[i]))), high: [0, 1].map((i) => Math.max(...boxes.map((b) => b.high[i]))) };
  }
  /** Width and height of a picture: as many beside each other as make it largest. */
  #sized() {
    const { low, high } = this.#box(), count = this.seen.length;
    this.body.classList.toggle("wide", this.root.clientWidth > 880 && this.plots.length > 0);
    const all = this.stage.clientWidth || 800, w = Math.max(high[0] - low[0], 1e-300), h = high[1] - low[1];
    const edge = count > 1 ? NARROW : EDGE, most = Math.max(300, (count > 1 ? 0.85 : 0.72) * (window.innerHeight || 800)), least = count > 1 ? 180 : this.body.classList.contains("wide") ? 360 : 240;
    let best = { scale: -1 };
    for (let columns = 1; columns <= count; columns++) {
      const wide = Math.floor((all - BETWEEN * (columns - 1)) / columns), rows = Math.ceil(count / columns);
      const tall = Math.round(clamp(wide * clamp(h / w, 0.35, 0.9) + 50, least, Math.max(least, most / rows)));
      const scale = Math.min((wide - 2 * edge) / w, h ? (tall - 16 - 2 * edge) / h : Infinity);
      if (scale > best.scale) best = { scale, columns, wide, tall };
    }
    Object.assign(this, { wide: best.wide, tall: best.tall });
    this.stage.style.gridTemplateColumns = `repeat(${best.columns}, minmax(0, 1fr))`;
    this.stage.style.setProperty("--tall", `${this.tall}px`);
    for (const one of this.pictures) one.svg.setAttribute("viewBox", `0 0 ${this.wide} ${this.tall}`); // paper may be narrower
  }
  #fit() {
    this.#sized();
    const edges = Array(4).fill(this.seen.length > 1 ? NARROW : EDGE);
    this.#frame(edges);
    // once more, with room for the arrows that are shown
    for (const one of this.seen) one.beyond(edges, this.tall - 16);
    this.#frame(edges);
  }
  /** The camera that shows the whole motion, with so many pixels left, right, above and below. */
  #frame([left, right, above, below]) {
    const { low, high } = this.#box(), unit = this.main.scene.unit, wide = this.wide - left - right, tall = this.tall - 16 - above - below;
    const s = Math.max(Math.min(wide / ((high[0] - low[0]) / unit), tall / ((high[1] - low[1]) / unit), 4), 1e-3);
    this.camera = { s, x: left + 0.5 * wide - s * 0.5 * (low[0] + high[0]) / unit, y: above + 0.5 * tall + s * 0.5 * (low[1] + high[1]) / unit };
    this.fitted = s;
  }
  /** Zoom by a factor about a place of the picture, in pixels. */
  zoom(factor, [x, y] = [0.5 * this.wide, 0.5 * this.tall]) {
    const c = this.camera, by = clamp(c.s * factor, this.fitted / 20, this.fitted * 200) / c.s;
    Object.assign(c, { s: c.s * by, x: x + by * (c.x - x), y: y + by * (c.y - y) });
    this.draw();
  }
  // -- time -----------------------------------------------------------------------------------

  /** Seconds that the whole motion takes on the screen. */
  get lasts() {
    const span = this.main.t[this.main.count - 1] - this.main.t[0];
    const own = span * this.main.scene.second;
    return own >= 2 && own <= 20 ? own : Math.min(8, Math.max(4, this.main.count / 60));
  }
  play() {
    if (this.playing) return;
    this.live?.leave();
    if (this.at >= this.main.count - 1) this.at = 0;
    this.playing = true;
    this.playButton.textContent = "Pause";
    let last = null;
    const frame = (now) => {
      if (!this.playing) return;
      if (last !== null) this.#advance((now - last) / 1000);
      last = now;
      this.draw();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  #advance(seconds) {
    const m = this.main, part = seconds * this.speed.value / this.lasts, end = m.count - 1;
    if (m.t[end] > m.t[0]) {
      let t = this.time() + part * (m.t[end] - m.t[0]);
      if (t >= m.t[end]) t = m.t[0] + (t - m.t[end]) % (m.t[end] - m.t[0]);
      this.at = locate(m.t, t);
    } else this.at = (this.at + part * end) % (end || 1);
  }
  time() {
    if (this.main.here) return this.main.here.t;
    const t = this.main.t, k = Math.floor(this.at), f = this.at - k;
    return f && k + 1 < t.length ? t[k] + f * (t[k + 1] - t[k]) : t[k];
  }
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.playButton.textContent = "Play";
    this.goTo(Math.round(this.at));
  }
  step(by) { this.pause(); this.goTo(clamp(Math.round(this.at) + by, 0, this.main.count - 1)); }
  /** Go to an instant, by its number; parts lie between instants. */
  goTo(at) {
    this.live?.leave();
    this.at = this.playing ? at : Math.round(at);
    this.draw();
    this.#say();
    this.#tabulate();
  }
  /** Go to a time, or with {instant: n} to an instant. */
  seek(to) {
    const m = this.main;
    if (typeof to === "object") return this.goTo(clamp(to.instant, 0, m.count - 1));
    return this.goTo(m.t[m.count - 1] > m.t[0] ? locate(m.t, to) : clamp(to, 0, m.count - 1));
  }
  /** What scripts on the page use; `state` is a function, and has its entries as properties too. */
  #door() {
    const state = () => this.state();
    for (const key of Object.keys(this.state())) Object.defineProperty(state, key, { get: () => this.state()[key] });
    return { viewer: this, state, play: () => this.play(), pause: () => this.pause(), seek: (to) => this.seek(to) };
  }
  state() {
    return { instant: Math.round(this.at), instants: this.main.count, t: this.time(), x: this.main.value2(this.main.x), playing: this.playing, shown: { ...this.on }, designs: ARRANGEMENTS[+this.beside] };
  }
  #position() {
    const { scene } = this.main, x = this.main.value2(this.main.x), unit = scene.axis.unit === "deg" ? "°" : scene.axis.unit ? ` ${scene.axis.unit}` : "";
    const parts = [`${scene.axis.label}${scene.axis.unit === "deg" || scene.axis.label === "instant" ? "" : " ="} ${scene.axis.unit === "deg" ? x.toFixed(1).replace("-", MINUS) : shown(x, 4)}${unit}`];
    if (scene.axis.values && this.main.t[this.main.count - 1] > this.main.t[0]) parts.push(`t = ${shown(this.time() / scene.units.time[1], 4)} ${scene.units.time[0]}`);
    return parts.join(", ");
  }
  #say() {
    if (this.playing || this.main.here) return;
    const values = this.plots.map((plot) => `${plot.name} ${plot.output.textContent}`);
    this.said.textContent = [`instant ${Math.round(this.at) + 1} of ${this.main.count}`, this.#position(), ...values].join(", ");
  }

  // -- a frame --------------------------------------------------------------------------------

  draw() {
    const m = this.main;
    m.set(this.at);
    if (this.on.ghosts) for (const one of this.motions.slice(1)) one.set(one.find(m.value2(m.x)));
    for (const one of this.seen) one.draw();
    if (this.on.free) this.free.draw();
    this.polygons?.draw();
    for (const plot of this.plots) plot.move();
    this.modes?.move();
    this.scrub.value = Math.round(this.at);
    const text = this.#position();
    if (this.where.textContent !== text) this.where.textContent = text;
    this.scrub.setAttribute("aria-valuetext", text);
  }
}

if (!customElements.get("mbody-viewer")) customElements.define("mbody-viewer", Viewer);
