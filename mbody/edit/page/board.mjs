// The drawing board: what is shown and chosen, the requests, pointer and keys. The document and all
// that is computed are in Python; the page has one request under way at a time, edits in their order
// and of what is dragged only the newest.

import { DEG, clamp, el, shown, sv } from "./viewer/elements.mjs";
import { Paper } from "./paper.mjs";
import { Panels, button } from "./panels.mjs";
import { Menu } from "./menu.mjs";
import { TOOLS, bodyOf, place } from "./tools.mjs";
import { away, snapped } from "./snapping.mjs";
import { TOOL_WORDS, WORDS } from "./words.mjs";

/** Pixels within which a point is meant, by mouse and by finger; that a press may move; ms of a long one. */
const NEAR = 13, NEAR_FINGER = 24, STILL = 4, LONG = 550;
/** Seconds of one turn while it plays; ms until signs are drawn anew after a zoom. */
const TURN = 4, LATER = 200;
const ARROWS = { arrowleft: [-1, 0], arrowright: [1, 0], arrowup: [0, 1], arrowdown: [0, -1] };

class Board {
  constructor(root) {
    Object.assign(this, { root, state: null, chosen: [], tool: "select", fault: null, waiting: Promise.resolve(), newest: null, dragging: false, away: false,
      reached: null, singleKeys: true, motions: false, copied: [] });
    this.paper = new Paper(WORDS.paper);
    this.panels = new Panels(this);
    this.menu = new Menu(this);
    this.#build();
    this.#listen();
    this.take("link");
    const size = () => this.paper.size(this.sheet.clientWidth, this.sheet.clientHeight);
    new ResizeObserver(() => { size(); if (this.state && this.paper.fitted) this.fit(); else this.paper.draw(); }).observe(this.sheet);
    size();
    const dark = matchMedia("(prefers-color-scheme: dark)");
    this.theme(dark.matches);
    dark.addEventListener("change", (event) => this.theme(event.matches));
  }
  #build() {
    const keyed = (name, keys, act, more = {}) =>
      (this[`${name}Button`] = button(WORDS[name], WORDS[`${name}Tip`], act, { "aria-keyshortcuts": keys, ...more }));
    this.title = el("h1", {}, WORDS.title);
    this.savedText = el("span", { class: "saved" });
    const top = el("header", { class: "top" }, this.title, this.savedText,
      keyed("menu", "/", () => this.menu.open()), keyed("save", "Control+S", () => this.save()),
      keyed("undo", "Control+Z", () => this.go("undo")), keyed("redo", "Control+Y", () => this.go("redo")), keyed("home", "Home", () => this.goHome()),
      keyed("fit", "0", () => this.fit()), keyed("play", "Space", () => this.play()), keyed("modes", "", () => this.menu.run("modes")),
      button("◐", WORDS.theme, () => this.theme(), { "aria-label": WORDS.theme }));
    const bar = el("div", { class: "tools", role: "toolbar", "aria-label": WORDS.tools });
    this.toolButtons = Object.entries(TOOLS).map(([name, tool]) => {
      const key = tool.key.toUpperCase(), made = button("", `${tool.name} (${key}): ${tool.hint}`, () => this.take(name),
        { "aria-pressed": "false", "aria-keyshortcuts": key, "data-tool": name });
      made.append(sv("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, sv("path", { d: tool.icon })), el("span", {}, tool.name), el("kbd", {}, key));
      bar.append(made);
      return made;
    });
    this.typed = ["length", "angle"].map((name) =>
      el("input", { "aria-label": WORDS[name], placeholder: WORDS[name], autocomplete: "off", spellcheck: "false" }));
    this.typedBox = el("div", { class: "typed", hidden: "" }, ...this.typed);
    this.hint = el("p", { id: "paper-hint", hidden: "" });
    this.sheet = el("div", { class: "sheet" }, this.paper.svg, this.hint, this.typedBox);
    [this.freeText, this.howText] = ["can", "how"].map((name) => el("span", { class: name }));
    this.badText = el("span", { class: "bad", role: "alert" });
    const words = el("div", { class: "words", tabindex: "0", role: "group", "aria-label": WORDS.status },
      el("span", { role: "status" }, this.freeText, " ", this.howText), this.badText);
    this.said = el("div", { class: "said", "aria-live": "polite" });
    this.root.append(top, bar, this.sheet, words, this.panels.root, this.said, this.menu.dialog);
  }
  theme(dark = !this.root.classList.contains("dark")) {
    this.root.classList.toggle("dark", dark);
    this.root.classList.toggle("light", !dark);
  }
  async begin() {
    const first = await this.ask({ act: "look" });
    if (!first.scene) return this.say(first.fault?.sentence ?? WORDS.lost, true);
    this.show(first);
    await this.look();
    if (Object.keys(this.state.bodies).length) this.take("select");
    if (this.state.journal) this.say(WORDS.journal);
    this.#door();
    return this.#watch();
  }
  /** What scripts on the page use. */
  #door() {
    const inWindow = ([x, y]) => { const box = this.paper.svg.getBoundingClientRect(); return [x + box.left, y + box.top]; };
    window.mbody = { board: {
      text: () => this.state.text, run: () => this.state.run, undo: () => this.go("undo"), redo: () => this.go("redo"), idle: () => this.idle(),
        messages: () => this.messages(),
      screen: (x, y) => inWindow(this.paper.screen([x, y])), world: (px, py) => { const [x, y] = inWindow([0, 0]); return this.paper.world([px - x, py - y]); },
    } };
  }
  messages() {
    const { fault } = this, own = fault ? [{ element: fault.element ?? "", key: String(fault.path?.at(-1) ?? ""), text: fault.sentence }] : [];
    return [...own, ...(this.state.messages ?? []).map(({ element, key, text }) => ({ element, key, text })).filter((one) => one.text !== fault?.sentence)];
  }
  get toolHint() { return TOOL_WORDS[this.tool][1]; }
  get grain() { return this.paper.grain; }
  /** A length as it is written in a file, to a pixel; and for people. */
  figure(value) { const grain = 0.1 * this.grain; return +(Math.round(value / grain) * grain).toPrecision(12); }
  number(value) { return `${shown(this.figure(value))} ${this.state.units.length}`; }

  // -- requests ---------------------------------------------------------------------------------

  async ask(what) {
    let answer;
    try {
      answer = await fetch("act", { method: "POST", headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ unit: this.paper.point, motions: this.motions, rev: this.state?.rev ?? 0, ...what }) });
    } catch { this.say(WORDS.lost, true); throw new Error(WORDS.lost); }
    if (answer.status === 409) return { ...await answer.json(), newer: true };
    if (answer.status === 400) { const made = await answer.json().catch(() => ({})); if (made.fault) return made; }
    if (!answer.ok) { const why = `${WORDS.lost} (${answer.status})`; this.say(why, true); throw new Error(why); }
    return answer.json();
  }
  #queue(act) {
    this.waiting = this.waiting.then(act).catch((error) => { console.error(error); return false; });
    return this.waiting;
  }
  /** An edit, or a function that says which when its turn has come; whether it was good. */
  edit(edit) {
    return this.#queue(async () => {
      const made = typeof edit === "function" ? edit() : edit;
      if (!made) { this.drop(); return false; }
      return this.#answered(await this.ask({ act: "edit", edit: made }));
    });
  }
  go(act, more = {}) { return this.#queue(async () => this.#answered(await this.ask({ act, ...more }))); }
  #answered(answer) {
    if (answer.fault && !answer.scene) {
      this.fault = answer.fault;
      this.conflict = Boolean(answer.conflict);
      if (this.paper.state) { this.paper.home(); this.away = false; this.paper.draw(); }
      this.tell();
      return false;
    }
    this.show(answer);
    if (answer.newer) { this.say(WORDS.newer, true); return false; }
    return true;
  }
  look() { clearTimeout(this.later); this.later = 0; return this.go("look"); }
  save(more = {}) {
    if (!this.state.file && !more.file) return this.menu.run("saveAs");
    return this.go("save", more).then((good) => {
      if (!good && this.conflict) return this.menu.conflict(more);
      if (good) this.said.textContent = WORDS.saved;
      return good;
    });
  }
  /** Other places while something is dragged: {do, …}, or a request of its own {act, …}. */
  drag(what) {
    this.newest = what.act ? what : { act: "drag", drag: what };
    if (this.dragging) return;
    this.dragging = true;
    this.#queue(async () => {
      const one = this.newest;
      this.newest = null;
      this.dragging = false; // what comes meanwhile is asked after the edits that wait
      if (one) this.#dragged(await this.ask(one));
    });
  }
  #dragged(answer) {
    if (answer.fault) { this.fault = answer.fault; return this.tell(); }
    if (answer.newer) { this.show(answer); return this.say(WORDS.newer, true); }
    const { drag } = answer;
    this.away = !drag.home;
    this.reached = drag.stopped && !drag.reached ? this.reached : drag.reached;
    this.paper.follow(drag);
    this.paper.tell(drag.reached, drag.words);
    this.homeButton.disabled = !this.away;
    this.say(drag.stopped ?? "", Boolean(drag.stopped));
    this.panels.follow(drag);
    this.paper.draw();
  }
  /** Forget what was dragged. */
  drop() { this.newest = null; this.reached = null; this.#restore(); return this.#queue(() => this.ask({ act: "drop" })); }
  goHome() { this.stop(); this.newest = null; this.#restore(); return this.#queue(async () => this.#dragged(await this.ask({ act: "home" }))); }
  #restore() { this.away = false; this.homeButton.disabled = true; this.paper.tell(null); this.paper.home(); this.paper.draw(); }
  /** Nothing is under way but playing, and the picture is drawn. */
  async idle() {
    for (let last = null; (last !== this.waiting && !(last && this.playing)) || this.frame;) {
      if (this.later) this.look();
      last = this.waiting;
      await last;
      await new Promise((done) => requestAnimationFrame(done));
    }
    return true;
  }
  /** Changes of the file or by another page. */
  async #watch() {
    for (;;) {
      const { rev, changed } = await this.ask({ act: "wait" }).catch(() => ({}));
      if (rev === undefined) return;
      if (changed && rev !== this.state.rev) await this.#queue(async () => {
        const state = await this.ask({ act: "look" }), other = state.rev !== this.state.rev;
        this.show(state);
        if (other) this.say(WORDS.changed);
      });
    }
  }

  // -- what is shown ----------------------------------------------------------------------------

  show(state) {
    const before = this.state;
    this.state = state;
    this.fault = state.fault;
    this.away = false;
    this.reached = null;
    this.paper.show(state);
    this.chosen = this.chosen.filter((one) => this.#exists(one));
    this.title.textContent = state.name && state.name !== "mechanism" ? state.name : WORDS.title;
    this.savedText.textContent = state.saved ? WORDS.saved : WORDS.unsaved;
    for (const name of ["undo", "redo"]) {
      const made = this[`${name}Button`], what = state[name];
      made.disabled = !what;
      made.replaceChildren(WORDS[name], ...(what ? [el("small", {}, ` ${what}`)] : []));
      made.title = what ? WORDS.undoTip(what, made.getAttribute("aria-keyshortcuts")) : WORDS.nothing(name);
    }
    this.root.classList.toggle("stale", Boolean(state.fault)); // the picture is of the last text without mistakes
    this.homeButton.disabled = true;
    this.playButton.disabled = !Object.keys(state.drivers).length;
    this.modesButton.hidden = state.modes !== null && state.modes !== undefined && state.modes < 2;
    this.modesButton.textContent = state.modes ? `${state.modes} ${WORDS.modes}` : WORDS.modes;
    this.stop();
    if (!before || before.text !== state.text || before.rev !== state.rev) this.panels.show();
    this.tell();
    this.paper.draw();
  }
  say(text, bad = false) {
    if (this.badText.textContent !== text) this.badText.textContent = text;
    this.badText.classList.toggle("bad", bad);
  }
  /** What the page itself cannot send on. */
  refuse(sentence, element = "", path = []) { this.fault = { sentence, element, path }; this.tell(); return false; }
  /** The state in words, and rings about what is chosen or at fault. */
  tell() {
    const { free, messages = [] } = this.state, motions = free.count ? free.motions : [], more = motions.length - 3;
    this.freeText.textContent = free.say;
    this.howText.textContent = [...motions.slice(0, 3), more > 0 ? `+ ${more}` : "", ...messages.filter((one) => one.kind !== "fault").map((one) =>
      one.text)].filter(Boolean).join(" · ");
    this.say(this.fault?.sentence ?? "", Boolean(this.fault));
    this.panels.fault(this.fault);
    this.mark();
  }
  /** Rings: chosen, at fault, redundant, and where a drop would join. */
  mark(onto = null) {
    const { paper, state } = this, rings = [], picked = new Map();
    const about = (name, kind) => {
      for (const pin of state.pins) if (pin.joints.includes(name) || pin.places.some((one) => one === name ||
        (name && bodyOf(one) === name && kind === "fault"))) rings.push([paper.where(pin), kind]);
      const site = state.loads[name] && paper.sites[name];
      if (site) rings.push([paper.site(site), kind]);
      const body = state.bodies[name] ? name : state.drivers[name]?.body;
      if (body) picked.set(body, kind === "fault" ? "faulty" : "picked");
    };
    for (const joint of Object.keys(state.free.redundant ?? {})) about(joint, "redundant");
    for (const [section, name] of this.chosen) {
      if (section === "points") { const pin = this.pin(name); if (pin) rings.push([paper.where(pin), "chosen"]); } else about(name, "chosen");
    }
    if (this.fault?.element) about(this.fault.element, "fault");
    if (onto) rings.push([paper.where(onto), "join"]);
    Object.assign(paper, { rings, picked });
    paper.mark();
  }
  /** A band through places of the world with its length and angle. */
  rubber(band) {
    this.paper.band = band;
    this.paper.tell(band?.at(-1) ?? null, band ? this.paper.measured(band) : "");
    this.paper.mark();
  }
  fit() { this.paper.fit(); this.paper.draw(); return this.look(); }
  #later() { clearTimeout(this.later); this.later = setTimeout(() => { this.look(); this.#keepView(); }, LATER); }
  #keepView() { if (this.state.file) this.#queue(() => this.ask({ act: "camera", set: this.paper.view })); }

  // -- what is chosen ---------------------------------------------------------------------------

  pin(name) { return this.state.pins.find((one) => one.places.includes(name)); }
  /** The last point of the link that was drawn last. */
  get lastPin() { const body = Object.keys(this.state.bodies).at(-1), point = body && Object.keys(this.state.bodies[body].points).at(-1);
  return point && this.pin(`${body}.${point}`); }
  #exists([section, name]) { return section === "points" ? Boolean(this.pin(name)) : section === "parameters" || name in (this.state[section] ?? {}); }
  get many() { return this.chosen.length > 1; }
  arm(body, xy) { return this.paper.arm(body, xy); }
  choose(name, more = false) {
    const same = ([section, own]) => name && section === name[0] && own === name[1];
    if (more && name) this.chosen = this.chosen.some(same) ? this.chosen.filter((one) => !same(one)) : [...this.chosen, name];
    else if (!(this.many && this.chosen.some(same))) this.chosen = name ? [name] : [];
    this.panels.show();
    this.mark();
  }
  chooseWithin([x0, y0], [x1, y1]) {
    const inside = ([x, y]) => (x - x0) * (x - x1) <= 0 && (y - y0) * (y - y1) <= 0, { state, paper } = this;
    const bodies = Object.entries(state.bodies).filter(([body, { points }]) => Object.values(points).length &&
      Object.keys(points).every((one) => inside(paper.placeOf(`${body}.${one}`))));
    const points = state.pins.filter((pin) => inside(paper.where(pin)) && !pin.places.some((one) => bodies.some(([body]) => body === bodyOf(one))));
    this.chosen = [...bodies.map(([body]) => ["bodies", body]), ...points.map((pin) => ["points", place(pin)])];
    this.panels.show();
    this.mark();
  }
  /** Move all chosen points, and those of chosen links. */
  moveChosen([dx, dy]) {
    const names = this.chosen.flatMap(([section, name]) =>
      (section === "points" ? [name] : section === "bodies" ? Object.keys(this.state.bodies[name].points).map((one) => `${name}.${one}`) : []));
    const pins = new Set(names.map((name) => this.pin(name)).filter(Boolean));
    const steps = [...pins].map((pin) => ({ do: "move", place: place(pin), xy: [pin.xy[0] + dx, pin.xy[1] + dy], grain: this.grain }));
    return steps.length ? this.edit({ do: "all", steps, what: WORDS.did.move(WORDS.chosen(steps.length)) }) : null;
  }
  /** The joint of a link along which a motor would push: a slider that is pressed or on its point. */
  slides(hit, body) {
    const on = hit.pin?.joints ?? (hit.element?.[0] === "joints" ? [hit.element[1]] : []);
    return on.find((name) => /prismatic|slot/i.test(this.state.joints[name]?.kind ?? "") && this.state.joints[name].bodies.includes(body)) ?? null;
  }
  /** An element of any kind. */
  add(section, kind, fields, what) { return this.edit({ do: section, kind, fields, grain: this.grain, what }); }
  /** A link slides as a block along a line of the ground. */
  block(body, xy, angle) {
    const [u, v] = this.arm(body, xy), { pose, cg } = this.state.bodies[body], own = (value) => +value.toPrecision(9);
    const on = { body, point: [own(u + cg[0]), own(v + cg[1])], angle: own(angle - pose[2] / DEG) };
    return this.add("joint", "prismatic", { prismatic: [{ body: "ground", point: xy.map((value) => this.figure(value)), angle }, on] }, WORDS.did.slider(body));
  }
  /** The direction of a link's first two points, in degrees. */
  lineAngle(body) {
    const [a, b] = Object.keys(this.state.bodies[body].points).map((one) => this.paper.placeOf(`${body}.${one}`));
    return b ? Math.atan2(b[1] - a[1], b[0] - a[0]) / DEG : 0;
  }
  mass(body) {
    return this.edit({ do: "mass", body, mass: "1 kg", what: WORDS.did.mass(body) });
  }
  remove() {
    if (!this.chosen.length) return this.say(WORDS.chooseFirst);
    const names = this.chosen.map(([section, name]) => [section, name]);
    return this.edit({ do: "delete", names, what: WORDS.did.remove(names.length > 1 ? WORDS.chosen(names.length) : names[0][1]) });
  }
  copy() { this.copied = this.chosen.filter(([section]) => section !== "points"); return this.copied.length || this.say(WORDS.chooseFirst); }
  paste(names = this.copied) {
    if (!names.length) return this.say(WORDS.chooseFirst);
    return this.edit({ do: "copy", names, by: [2 * this.paper.grid, -2 * this.paper.grid], grain: this.grain, what: WORDS.did.copy });
  }

  // -- moving by itself -------------------------------------------------------------------------

  play() {
    if (this.playing) return this.stop();
    const [name, driver] = Object.entries(this.state.drivers)[0] ?? [];
    if (!name) return this.say(WORDS.notDriven);
    const began = performance.now(), { range } = driver;
    this.playing = true;
    this.playButton.textContent = WORDS.pause;
    const frame = (now) => {
      if (!this.playing) return;
      const part = (now - began) / 1000 / TURN;
      // through its range to and fro, or round and round
      const value = range ? range[0] + (range[1] - range[0]) * 0.5 * (1 - Math.cos(Math.acos(clamp(1 - 2 * (driver.value - range[0]) / (range[1] - range[0] ||
        1), -1, 1)) + Math.PI * part)) : driver.value + 360 * part;
      this.drag({ act: "drive", values: { [name]: value } });
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    return null;
  }
  stop() { this.playing = false; this.playButton.textContent = WORDS.play; }

  // -- pointer ----------------------------------------------------------------------------------

  /** What lies at a place of the window, and where it snaps. */
  hit(event) {
    const { paper } = this, tool = TOOLS[this.tool], raw = paper.world(paper.here(event)), near = (event.pointerType === "touch" ? NEAR_FINGER
      : NEAR) / paper.camera.s;
    const names = document.elementsFromPoint(event.clientX, event.clientY).map((one) => one.dataset?.name ?? (one.dataset?.force
      ? `force:${one.dataset.force}` : "")).filter(Boolean);
    const link = names.find((one) => one.startsWith("link:"))?.slice(5), first = this.press &&
      Math.hypot(event.clientX - this.press[0], event.clientY - this.press[1]) > STILL * (event.pointerType === "touch" ? 2 : 1);
    this.moved ||= Boolean(first);
    return this.#hit({ raw, near, link, names, tool, shift: event.shiftKey, alt: event.altKey, more: event.ctrlKey || event.metaKey });
  }
  #hit({ raw, near, link = null, names = [], tool, shift = false, alt = false, more = false }) {
    const { paper, state } = this, points = paper.points(tool.held?.pin ?? null).filter(([pin]) => !tool.held?.pin ||
      !pin.places.some((one) => tool.held.pin.places.includes(one)));
    const from = tool.from ? tool.from.pin?.xy ?? tool.from.xy : tool.held?.pin?.xy ?? null;
    const found = snapped(raw, { points, lines: tool.draws ? paper.lines() : [], from, near, grid: paper.step, angles: shift && Boolean(from),
      free: alt && !tool.held });
    const owner = names.filter((one) => !/^(link|pin|cg|ground):/.test(one)).map((one) => one.slice(one.indexOf(":") + 1)).map((name) =>
      ["loads", "drivers", "joints"].map((section) => [section, name]).find(([section]) => name in state[section])).find(Boolean);
    const body = found.pin ? null : found.line ?? (link && state.bodies[link] ? link : null);
    return { ...found, raw, body, element: found.pin ? null : owner ?? null, moved: this.moved, shift, alt, more };
  }
  #listen() {
    const { paper } = this;
    let last = null;
    const flush = () => {
      this.frame = 0;
      if (!last || !this.state) return;
      const hit = this.hit(last), tool = TOOLS[this.tool];
      last = null;
      paper.guides = tool.draws || this.press ? hit.guides : [];
      tool.move(this, hit, Boolean(this.press));
      const joins = hit.pin && (tool.draws || (this.press && tool.held?.on));
      this.mark(joins ? hit.pin : null);
      if (!this.press && !tool.from && !paper.band) paper.tell(tool.draws ? hit.xy : null);
      paper.svg.style.cursor = hit.pin || hit.body || hit.element ? "pointer" : "";
    };
    const follow = (event) => { last = event; this.frame ||= requestAnimationFrame(flush); };
    paper.listen({
      grab: (event) => {
        if (event.button !== 0 || !this.state) return false;
        const ghost = document.elementsFromPoint(event.clientX, event.clientY).map((one) => one.closest?.("[data-mode]")).find(Boolean);
        if (ghost) { this.menu.takeMode(+ghost.dataset.mode); return true; }
        if (this.menu.picks) { event.preventDefault(); this.moved = false; this.menu.picks(this.hit(event)); return true; }
        paper.svg.focus({ preventScroll: true });
        paper.cross = null;
        this.#closeTyped();
        Object.assign(this, { press: [event.clientX, event.clientY], moved: false });
        const tool = TOOLS[this.tool];
        if (this.away && !["select", "move"].includes(this.tool)) this.goHome();
        this.stop();
        const paperMoves = tool.down(this, this.hit(event));
        if (event.pointerType === "touch") this.long = setTimeout(() => this.#longPress(event), LONG);
        if (paperMoves) this.press = null;
        return !paperMoves;
      },
      drag: (event) => { if (this.press) follow(event); return Boolean(this.press); },
      drop: (event) => {
        clearTimeout(this.long);
        if (!this.press) return;
        if (event.type === "pointercancel") { this.press = null; TOOLS[this.tool].stop(this); return; }
        if (this.frame) { cancelAnimationFrame(this.frame); flush(); }
        const hit = this.hit(event);
        this.press = null;
        TOOLS[this.tool].up(this, hit);
        paper.guides = [];
      },
      second: () => { clearTimeout(this.long); this.press = null; TOOLS[this.tool].stop(this); return true; },
      zoom: (by, at) => { paper.zoom(by, at); paper.draw(); this.#later(); },
      moved: () => { clearTimeout(this.long); paper.fitted = false; paper.draw(); },
      hover: (event) => { if (!this.menu.dialog.open) follow(event); },
      clicked: () => {}, left: () => { if (!TOOLS[this.tool].from) paper.tell(null); },
    });
    paper.svg.addEventListener("contextmenu", (event) => { event.preventDefault(); this.#longPress(event); });
    document.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("beforeunload", (event) => { if (this.state && !this.state.saved) event.preventDefault(); });
    for (const field of this.typed) field.addEventListener("keydown", (event) => this.#typedKey(event));
  }
  /** The menu of the element under the finger. */
  #longPress(event) {
    if (this.moved && this.press) return;
    this.press = null;
    TOOLS[this.tool].stop(this);
    const hit = this.hit(event), name = hit.pin ? ["points", place(hit.pin)] : hit.element ?? (hit.body && ["bodies", hit.body]);
    if (name && !this.chosen.some(([section, own]) => section === name[0] && own === name[1])) this.choose(name);
    this.menu.element(name);
  }

  // -- keys -------------------------------------------------------------------------------------

  take(name) {
    TOOLS[this.tool].stop(this);
    this.tool = name;
    this.sheet.dataset.tool = name;
    for (const made of this.toolButtons) made.setAttribute("aria-pressed", made.dataset.tool === name);
    this.hint.textContent = `${TOOL_WORDS[name][1]} ${WORDS.paperKeys}`;
    this.paper.guides = [];
    if (this.state) { this.panels.show(); this.mark(); }
  }
  escape() {
    this.#closeTyped();
    if (!TOOLS[this.tool].stop(this)) { this.choose(null); this.take("select"); this.paper.cross = null; }
    this.press = null;
    this.paper.showGhosts([]);
    this.fault = this.state.fault;
    this.tell();
  }
  #key(event) {
    const tag = event.target.tagName, control = event.ctrlKey || event.metaKey, key = event.key.toLowerCase(), typing = /INPUT|TEXTAREA|SELECT/.test(tag);
    if (!this.state || this.menu.dialog.open) return;
    const act = control ? this.#controlled(key, event.shiftKey, typing) : typing || event.altKey && !ARROWS[key] ? null : this.#plain(key, event);
    if (act) { event.preventDefault(); act(); }
  }
  #controlled(key, shift, typing) {
    if (key === "s") return () => this.save();
    if (typing) return null;
    return { z: () => this.go(shift ? "redo" : "undo"), y: () => this.go("redo"), c: () => this.copy(), v: () => this.paste(),
      d: () => this.paste(this.chosen.filter(([section]) => section !== "points")) }[key] ?? null;
  }
  #plain(key, event) {
    const onPaper = event.target === this.paper.svg, onButton = /BUTTON|SUMMARY|A/.test(event.target.tagName), tool = TOOLS[this.tool];
    if (tool.typed && tool.from && /^[-\d.=(]$/.test(key)) return () => this.#openTyped(key === "=" ? "" : key);
    if (ARROWS[key] && (onPaper || event.target === document.body)) return () => this.#step(ARROWS[key], event.shiftKey ? 10 : event.altKey ? 0.1 : 1);
    if (onPaper && key === "tab") return this.#next(event.shiftKey);
    if (key === "enter" && onPaper) return () => this.#enter(event.shiftKey);
    const found = this.singleKeys && Object.keys(TOOLS).find((name) => TOOLS[name].key === key);
    if (found) return () => this.take(found);
    const acts = { escape: () => this.escape(), delete: () => this.remove(), backspace: () => this.remove(), home: () => this.goHome(), 0: () => this.fit(),
      "/": () => this.menu.open(),
      f2: () => this.menu.run("rename"), "+": () => this.#zoomed(1.3), "=": () => this.#zoomed(1.3), "-": () => this.#zoomed(1 / 1.3),
        " ": onButton ? null : () => this.play() };
    return acts[key] ?? null;
  }
  #zoomed(by) { this.paper.zoom(by); this.paper.draw(); this.#later(); }
  /** An arrow key: the chosen points go by a step of the grid; with a tool the cross does. */
  #step([x, y], by) {
    const { paper } = this, step = paper.grid * by;
    if (this.tool === "select" && this.chosen.length) return this.moveChosen([x * step, y * step]);
    const at = paper.cross ?? paper.world([0.5 * paper.wide, 0.5 * paper.tall]).map((v) => Math.round(v / paper.grid) * paper.grid);
    return this.#crossAt([at[0] + x * step, at[1] + y * step]);
  }
  #crossAt(at) {
    const { paper } = this, tool = TOOLS[this.tool];
    paper.cross = at.map((v) => +v.toPrecision(12));
    const hit = this.#crossed();
    tool.move(this, hit, false);
    this.mark(tool.draws ? hit.pin : null);
    if (!tool.from) paper.tell(paper.cross);
    this.said.textContent = hit.pin ? this.#pointSaid(hit.pin) : paper.cross.map((v) => shown(v)).join(", ");
  }
  #crossed(shift = false) {
    const { paper } = this, at = paper.cross, near = 3 / paper.camera.s;
    const [x, y] = paper.screen(at), box = paper.svg.getBoundingClientRect(), names = document.elementsFromPoint(x + box.left,
      y + box.top).map((one) => one.dataset?.name ?? "").filter(Boolean);
    this.moved = false;
    return { ...this.#hit({ raw: at, near, link: names.find((one) => one.startsWith("link:"))?.slice(5), names, tool: TOOLS[this.tool] }), shift, more: shift };
  }
  #pointSaid(pin) { return WORDS.pointSaid(pin, pin.xy.map((v) => shown(v, 5)), this.state.units.length); }
  /** Tab on the paper: to the next point, and out of it after the last. */
  #next(back) {
    const { pins } = this.state, { paper } = this, tool = this.tool !== "select";
    const now = tool ? pins.findIndex((pin) => paper.cross && away(paper.where(pin), paper.cross) < 1e-9 * (1 + Math.abs(pin.xy[0])))
      : pins.findIndex((pin) => this.chosen[0]?.[0] === "points" && pin.places.includes(this.chosen[0][1]));
    const next = pins[now < 0 ? (back ? -1 : 0) : now + (back ? -1 : 1)];
    if (!next) return null;
    return () => { if (tool) this.#crossAt(paper.where(next)); else { this.choose(["points", place(next)]); this.said.textContent = this.#pointSaid(next); } };
  }
  /** Enter on the paper: a click at the cross, or into the first field of what is chosen. */
  #enter(shift) {
    const { paper } = this, tool = TOOLS[this.tool];
    if (!paper.cross) return this.panels.focus();
    if (this.away && !["select", "move"].includes(this.tool)) this.goHome();
    const hit = this.#crossed(shift);
    tool.down(this, hit);
    return tool.up(this, hit);
  }

  // -- numbers typed while drawing ----------------------------------------------------------------

  #openTyped(first) {
    const { from, more = [] } = TOOLS[this.tool], at = (more.at(-1) ?? from), [x, y] = this.paper.screen(at.pin?.xy ?? at.xy);
    Object.assign(this.typedBox.style, { left: `${clamp(x + 14, 4, this.paper.wide - 200)}px`, top: `${clamp(y + 14, 4, this.paper.tall - 44)}px` });
    this.typedBox.hidden = false;
    this.typed[0].value = first;
    this.typed[1].value = "";
    this.typed[0].focus();
  }
  #closeTyped() { if (this.typedBox.hidden) return; this.typedBox.hidden = true; this.paper.svg.focus({ preventScroll: true }); }
  #typedKey(event) {
    if (event.key === "Escape") { event.stopPropagation(); this.escape(); }
    if (event.key !== "Enter") return;
    event.preventDefault();
    event.stopPropagation();
    const tool = TOOLS[this.tool], { from, more = [] } = tool, start = more.at(-1) ?? from, a = start.pin?.xy ?? start.xy,
      band = this.paper.band ?? [a, [a[0] + 1, a[1]]], b = band.at(-1);
    const [long, angle] = this.typed.map((field) => field.value.trim()), polar = [long || String(away(a, b)),
      angle || `${Math.atan2(b[1] - a[1], b[0] - a[0]) * 180 / Math.PI} deg`];
    const [length, turn] = [parseFloat(polar[0]) || 1, parseFloat(polar[1]) * DEG || 0];
    this.#closeTyped();
    tool.fresh = false;
    tool.up(this, { pin: null, body: null, element: null, xy: [a[0] + length * Math.cos(turn), a[1] + length * Math.sin(turn)], raw: b, polar, moved: true });
  }
}

new Board(document.getElementById("board")).begin();
