// One dialog for everything that has no tool: commands by name, files and gallery, exports, forms.

import { el, shown } from "./viewer/elements.mjs";
import { button } from "./panels.mjs";
import { TOOLS, bodyOf, place } from "./tools.mjs";
import { TOOL_WORDS, WORDS } from "./words.mjs";

const { did, commands } = WORDS;
const JOBS = ["report", "page", "drawing", "freebody", "film", "dxf", "fmu", "csv", "xlsx"];
const SHAPES = ["cycloidal", "3-4-5", "4-5-6-7", "harmonic"];
const SYSTEMS = ["SI", "mm-N-s", "in-lbf-s", "ft-lbf-s"];
const POLL = 250, FEW = 8; // ms between two looks at an export; entries that are not searched

export class Menu {
  constructor(board) {
    Object.assign(this, { board, corner: false });
    this.dialog = el("dialog", { class: "menu", "aria-labelledby": "menu-title" });
    this.dialog.addEventListener("keydown", (event) => { if (event.key === "Escape") this.dialog.close(); });
    this.dialog.addEventListener("close", () => { this.picks = null; if (board.paper.state) board.paper.showGhosts([]); board.paper.svg.focus({ preventScroll: true }); });
    this.dialog.addEventListener("click", (event) => { if (event.target === this.dialog) this.dialog.close(); });
  }
  /** A dialog, or a list in the corner of the paper that leaves the paper to the pointer. */
  #show(title, ...parts) {
    const form = parts.at(-1).tagName === "FORM" ? [el("button", { class: "play", form: parts.at(-1).id }, WORDS.ok)] : [];
    this.dialog.replaceChildren(el("h2", { id: "menu-title" }, title), ...parts, el("div", { class: "bar end" }, ...form,
      button(WORDS.cancel, "Esc", () => this.dialog.close())));
    this.dialog.className = this.corner ? "menu corner" : "menu";
    if (!this.dialog.open) this.dialog[this.corner ? "show" : "showModal"]();
  }
  /** Go on when the dialog has closed: another one may open. */
  #leave(act) {
    this.dialog.addEventListener("close", () => act(), { once: true });
    this.dialog.close();
  }
  /** Choose one of entries [{name, note, act}], by name. */
  pick(title, entries) {
    const field = el("input", { type: "search", "aria-label": WORDS.search, placeholder: WORDS.search, autocomplete: "off" }),
      list = el("div", { class: "list" }), none = el("p", { class: "hint", role: "status" });
    const made = entries.map(({ name, note = "", act }) => [`${name} ${note}`.toLowerCase(), button("", note, () => this.#leave(act))]);
    made.forEach(([, one], n) => one.append(el("span", {}, entries[n].name), ...(entries[n].note ? [el("small", {}, entries[n].note)] : [])));
    list.append(...made.map(([, one]) => one));
    const seen = () => made.map(([, one]) => one).filter((one) => !one.hidden);
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/);
      for (const [text, one] of made) one.hidden = !words.every((word) => text.includes(word));
      none.textContent = seen().length ? "" : WORDS.noMatch;
    });
    const go = (event) => {
      const all = seen(), at = all.indexOf(document.activeElement), next = { ArrowDown: at + 1, ArrowUp: at - 1 }[event.key];
      if (event.key === "Enter" && at < 0 && all.length) { event.preventDefault(); all[0].click(); }
      if (next === undefined) return;
      event.preventDefault();
      (all[next] ?? (next < 0 ? field : null))?.focus();
    };
    for (const one of [field, list]) one.addEventListener("keydown", go);
    const long = made.length > FEW;
    this.#show(title, ...(long ? [field] : []), list, none);
    (long ? field : made[0]?.[1])?.focus();
  }
  /** Ask for values of fields [[key, label, value, choices]]; null where it is cancelled. */
  form(title, fields, note = "") {
    return new Promise((done) => {
      const inputs = fields.map(([key, label, value, choices]) => {
        const made = el(choices ? "select" : "input", { id: `form-${key}`, name: key, autocomplete: "off" });
        if (choices) made.append(...choices.map((one) => el("option", { value: one }, one)));
        made.value = value ?? "";
        return [key, label, made];
      });
      const form = el("form", { id: "menu-form", method: "dialog", class: "rows" }, ...inputs.flatMap(([key, label, made]) =>
        [el("label", { for: `form-${key}` }, label), made]));
      let values = null;
      form.addEventListener("submit", () => { values = Object.fromEntries(inputs.map(([key, , made]) => [key, made.value.trim()])); });
      this.dialog.addEventListener("close", () => done(values), { once: true });
      this.#show(title, ...(note ? [el("p", { class: "hint" }, note)] : []), form);
      inputs[0]?.[2].focus();
      inputs[0]?.[2].select?.();
    });
  }

  // -- commands ---------------------------------------------------------------------------------

  open() {
    const tools = Object.entries(TOOLS).map(([name, tool]) =>
      ({ name: tool.name, note: `${tool.key.toUpperCase()} – ${tool.hint}`, act: () => this.board.take(name) }));
    this.pick(WORDS.menu, [...Object.entries(commands).map(([key, name]) => ({ name, act: () => this.run(key) })), ...tools]);
  }
  /** A command by its key. */
  run(key) {
    const { board } = this;
    if (JOBS.includes(key)) return this.#job(key);
    return { new: () => this.#new(), gallery: () => this.#files("gallery"), open: () => this.#files("open"), import: () => this.#files("import"),
      saveAs: () => this.#saveAs(),
      underlay: () => this.#underlay(), noUnderlay: () => board.go("underlay", { set: null }), units: () => this.#units(), element: () => this.#element(),
      rename: () => this.#rename(), remove: () => board.remove(), copy: () => board.copy(), paste: () => board.paste(),
        duplicate: () => board.paste(board.chosen.filter(([section]) => section !== "points")),
      mirror: () => this.#mirror(), mass: () => this.#mass(), nameNumber: () => this.#nameNumber(), modes: () => this.#modes(), play: () => board.play(),
        motions: () => { board.motions = !board.motions; return board.look(); },
        theme: () => board.theme(),
      keys: () => { board.singleKeys = !board.singleKeys; board.say(WORDS[board.singleKeys ? "keysOn" : "keysOff"]); } }[key]();
  }
  /** What can be done with what is chosen: [[words, act]]. */
  actionsOf(chosen) {
    const { board } = this, [[section, name]] = chosen, pin = section === "points" && chosen.length === 1 && board.pin(name), acts = [];
    if (pin) acts.push([WORDS[pin.ground ? "unpin" : "pinIt"], () => board.edit(pin.ground ? { do: "unground", place: place(pin), what: did.unground(pin.name) }
      : { do: "ground", place: place(pin), grain: board.grain, what: did.ground(pin.name) })]);
    if (section === "bodies" && chosen.length === 1 && !board.state.rows.some((row) => row.path[0] === "bodies" && row.path[1] === name &&
      /mass|weight/.test(row.path[2]))) acts.push([WORDS.mass, () => board.mass(name)]);
    if (chosen.length === 1) acts.push([WORDS.rename, () => this.#rename()]);
    if (chosen.some(([one]) => one !== "points")) acts.push([WORDS.copy, () => { board.copy(); board.paste(); }], [WORDS.mirror, () => this.#mirror()]);
    return [...acts, [WORDS.remove, () => board.remove()]];
  }
  /** The menu of an element, or of the paper. */
  element(name) {
    if (!name) return this.open();
    const { chosen } = this.board;
    return this.pick(WORDS.ofKind(WORDS.kinds[name[0]], name[1]), this.actionsOf(chosen).map(([text, act]) => ({ name: text, act })));
  }

  // -- files ------------------------------------------------------------------------------------

  /** Another document; edits that are not saved are asked about. */
  async #open(what) {
    const { board } = this;
    board.paper.state = null; // the view is fitted anew
    const good = await board.go("open", what);
    if (!good && !what.force && board.fault) {
      board.paper.state ??= board.state;
      return this.pick(WORDS.unsavedEdits, [{ name: WORDS.discard, act: () => this.#open({ ...what, force: true }) },
        { name: WORDS.save, act: () => board.save().then((saved) => saved && this.#open(what)) }]);
    }
    if (good) { board.choose(null); board.take(Object.keys(board.state.bodies).length ? "select" : "link"); await board.look(); }
    return good;
  }
  async #files(kind) {
    const { gallery, models, imports } = await this.board.ask({ act: "files" }), plain = (list, key) =>
      (list ?? []).map((one) => ({ name: one, act: () => this.#open({ [key]: one }) }));
    if (kind === "gallery") return this.pick(commands.gallery, gallery.map(({ name, title }) =>
      ({ name: title || name, note: name, act: () => this.#open({ gallery: name }) })));
    return this.pick(commands[kind], kind === "open" ? plain(models, "file") : plain(imports, "import"));
  }
  async #new() {
    const kinds = (await this.board.ask({ act: "files" })).new ?? [];
    return this.pick(commands.new, [{ name: WORDS.title, act: () => this.#open({ new: "" }) },
      ...kinds.map((one) => ({ name: one.name ?? one, note: one.title, act: () => this.#open({ new: one.name ?? one }) }))]);
  }
  async #saveAs() {
    const made = await this.form(commands.saveAs, [["file", WORDS.file, this.board.state.file || `${this.board.state.name.replace(/\W+/g, "_").slice(0, 40)}.toml`]]);
    return made?.file ? this.board.save({ file: made.file }) : null;
  }
  /** The file has changed on disk since it was read. */
  conflict(more) {
    const { board } = this;
    this.pick(WORDS.conflict, [{ name: WORDS.overwrite, act: () => board.save({ ...more, force: true }) },
      { name: WORDS.reload, act: () => this.#open({ file: board.state.file, force: true }) }, { name: commands.saveAs, act: () => this.#saveAs() }]);
  }
  /** An export: begun, followed, and its file or fault said. */
  async #job(kind) {
    const { board } = this, begun = await board.ask({ act: "job", do: kind });
    if (begun.fault) { board.fault = begun.fault; return board.tell(); }
    for (;;) {
      const { done, file, fault, command } = await board.ask({ act: "job", id: begun.job });
      if (fault) return board.say(fault.sentence ?? fault, true);
      if (file) return board.say(`${WORDS.written(file)}${command ? ` – ${command}` : ""}`);
      board.say(WORDS.working(commands[kind], Math.round(100 * (done ?? 0))));
      await new Promise((next) => setTimeout(next, POLL));
    }
  }

  // -- forms ------------------------------------------------------------------------------------

  async #units() {
    const made = await this.form(commands.units, [["units", WORDS.units, this.board.state.units.system ?? "mm-N-s", SYSTEMS]]);
    return made && this.board.edit({ do: "units", units: made.units, convert: true, what: did.units(made.units) });
  }
  async #rename() {
    const { board } = this, [one] = board.chosen;
    if (!one) return board.say(WORDS.chooseFirst);
    const [section, name] = one, cut = name.indexOf("."), old = section === "points" ? name.slice(cut + 1) : name,
      made = await this.form(WORDS.rename, [["to", WORDS.name, old]]);
    if (!made?.to || made.to === old) return null;
    const body = name.slice(0, cut), path = section !== "points" ? [section, name] : body === "ground" ? ["ground", "points", old]
      : ["bodies", body, "points", old];
    return board.edit({ do: "rename", path, to: made.to, what: did.rename(old, made.to) });
  }
  async #mirror() {
    const { board } = this, names = board.chosen.filter(([section]) => section !== "points");
    if (!names.length) return board.say(WORDS.chooseFirst);
    const made = await this.form(commands.mirror, Object.entries(WORDS.mirrorLine).map(([key, label]) => [key, label, { x1: 0, y1: 0, x2: 0, y2: 1 }[key]]));
    return made && board.edit({ do: "mirror", names, line: [[+made.x1, +made.y1], [+made.x2, +made.y2]], grain: board.grain, what: did.mirror });
  }
  #mass() {
    const one = this.board.chosen.find(([section]) => section === "bodies");
    return one ? this.board.mass(one[1]) : this.board.say(WORDS.chooseFirst);
  }
  async #nameNumber() {
    const { board } = this, rows = board.state.rows.filter((row) => !row.formula && Number.isFinite(row.value) && row.path[0] !== "parameters");
    const made = await this.form(commands.nameNumber, [["row", WORDS.value, rows[0]?.path.join("."), rows.map((row) => row.path.join("."))],
      ["name", WORDS.name, ""]]);
    const row = made && rows.find((one) => one.path.join(".") === made.row);
    return row && made.name ? board.edit({ do: "parameter", path: row.path, name: made.name, what: did.parameter(made.name) }) : null;
  }
  async #underlay() {
    const { board } = this, { pictures = [] } = await board.ask({ act: "files" }), own = board.state.views?.underlay ?? {};
    const first = { file: pictures[0] ?? "", x: 0, y: 0, width: 100, angle: 0, opacity: 0.5, ...own };
    const fields = Object.entries(WORDS.underlay).map(([key, label]) => [key, label, first[key], key === "file" && pictures.length ? pictures : undefined]);
    const made = await this.form(commands.underlay, fields);
    return made && board.go("underlay", { set: Object.fromEntries(Object.entries(made).map(([key, text]) => [key, key === "file" ? text : Number(text)])) });
  }
  /** Any entry of the file that has a name, by the forms of its schema; places are clicked on the paper. */
  async #element() {
    const { board } = this, { forms } = await board.ask({ act: "forms" }), name = el("input", { id: "form-name", autocomplete: "off" });
    const kinds = Object.fromEntries(Object.entries(forms).map(([key, { entry, about }]) => [key, { about, ...entry }]));
    const made = this.#inputs({ kinds }, WORDS.kind), why = el("p", { class: "sentence", role: "alert" });
    const form = el("form", { id: "menu-form", class: "rows" }, el("label", { for: "form-name" }, WORDS.name), name, ...made.parts, why);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const text = made.value(), key = name.value.trim(), section = made.kind();
      const good = text !== undefined && await board.edit({ do: "add", path: [section], key, text, grain: board.grain, what: did.add(key || section) });
      if (good) this.dialog.close(); else why.textContent = board.fault?.sentence ?? WORDS.elementFields;
    });
    this.corner = true;
    this.#show(commands.element, el("p", { class: "hint" }, WORDS.elementFields), form);
    this.corner = false;
    this.dialog.classList.add("long");
    made.parts[1].focus();
  }
  /** Inputs for a form (see places.py): their parts, and the value that stands in them, if one does. */
  #inputs(node, label, needed = node.needed) {
    const id = `form-${this.count = (this.count ?? 0) + 1}`, title = node.about ?? "", named = el("label", { for: id, title }, `${label}${needed ? " *" : ""}`);
    const words = (key) => key.replaceAll("_", " "), options = (list, none) => list.map((one) => el("option", { value: one }, words(one) || none));
    if (node.kinds) {
      const select = el("select", { id, title }, ...options(Object.keys(node.kinds), WORDS.plain)), box = el("div", { class: "rows nested" });
      let own = null;
      const renew = () => {
        const of = node.kinds[select.value];
        own = this.#inputs(of, words(select.value) || WORDS.value, false);
        box.replaceChildren(...(of.about ? [el("p", { class: "hint" }, of.about)] : []), ...own.parts);
      };
      select.addEventListener("change", renew);
      renew();
      const value = () => { const found = own.value(); return node.named && select.value && found !== undefined ? { [select.value]: found } : found; };
      return { parts: [named, select, box], value, kind: () => select.value };
    }
    if (node.fields || node.items) {
      const every = node.fields?.map((one) => [one.key, this.#inputs(one, words(one.key))]) ??
        node.items.map((one, n) => [n, this.#inputs(one, `${label} ${n + 1}`, needed)]);
      const value = () => {
        const found = every.map(([key, one]) => [key, one.value()]).filter(([, one]) => one !== undefined);
        return !found.length ? undefined : node.fields ? Object.fromEntries(found) : found.map(([, one]) => one);
      };
      return { parts: every.flatMap(([, one]) => one.parts), value };
    }
    const placeholder = node.unit || (node.picks ? WORDS.picks[node.picks] : ""), input = node.choices
      ? el("select", { id, title }, ...options(["", ...node.choices], "")) : el("input", { id, title, placeholder, autocomplete: "off" });
    input.addEventListener("focus", () => { this.picks = node.picks ? (hit) => this.#picked(input, node.picks, hit) : null; });
    input.addEventListener("input", () => { input.place = null; });
    return { parts: [named, input], value: () => input.place ?? (input.value.trim() || undefined) };
  }
  /** What was clicked on the paper goes into the field that has the focus, and the next has it. */
  #picked(input, what, { pin, body, xy }) {
    const name = pin ? place(pin) : "";
    input.place = what === "place" && !pin ? { body: body ?? "ground", xy } : null;
    input.value = what === "body" ? (pin ? bodyOf(name) : body ?? "ground") : name || `${body ?? "ground"}: ${xy.map((v) => shown(v)).join(", ")}`;
    const fields = [...this.dialog.querySelectorAll("input, select")];
    fields[fields.indexOf(input) + 1]?.focus();
  }
  /** A cam between two centres: its rise, dwell and return. */
  async cam(centre, follower, long) {
    const { board } = this, f = (value) => board.figure(value), given = { base_radius: f(0.75 * long), roller: f(0.25 * long), lift: f(0.4 * long),
      rise: "120 deg", dwell: "60 deg", back: "120 deg", shape: SHAPES[0] };
    const made = await this.form(TOOL_WORDS.cam[0], Object.entries(WORDS.camFields).map(([key, label]) =>
      [key, label, given[key], key === "shape" ? SHAPES : undefined]));
    if (!made) return null;
    const number = (text) => (text !== "" && Number.isFinite(+text) ? +text : text), { shape } = made,
      rise = (height, duration) => ({ rise: { shape, height, start: 0, duration } });
    const lift = number(made.lift), back = typeof lift === "number" ? -lift : `-(${lift})`,
      rest = `360 deg - (${made.rise}) - (${made.dwell}) - (${made.back})`;
    const segments = [rise(lift, made.rise), { dwell: made.dwell }, rise(back, made.back), { dwell: rest }];
    return board.add("joint", "cam_follower", { cam_follower: [centre, follower], base_radius: number(made.base_radius), roller: number(made.roller),
      profile: { cam: { period: "360 deg", segments } } }, did.cam);
  }
  takeMode(index) { this.dialog.close(); return this.board.edit({ do: "mode", index, what: did.mode }); }
  async #modes() {
    const { board } = this, { modes, complete, fault } = await board.ask({ act: "modes" });
    if (fault) { board.fault = fault; return board.tell(); }
    const others = modes.map((mode, index) => ({ ...mode, index })).filter((mode) => !mode.current);
    if (!others.length) return board.say(WORDS.oneMode);
    board.say(complete === false ? `${WORDS.ghostsHere} …` : WORDS.ghostsHere);
    board.paper.showGhosts(others);
    this.corner = true;
    this.pick(WORDS.modes, others.map((mode) => ({ name: mode.name || WORDS.mode(mode.index + 1), act: () => this.takeMode(mode.index) })));
    this.corner = false;
    return null;
  }
}
