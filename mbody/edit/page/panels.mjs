// The panel beside the paper: numbers of what is chosen and in a table, sliders, all elements as a
// list, results with diagrams, and the model file as text.

import { DEG, el, shown, sv } from "./viewer/elements.mjs";
import { bodyOf, place } from "./tools.mjs";
import { WORDS } from "./words.mjs";

/** Tables whose numbers are of the whole mechanism. */
const GENERAL = ["parameters", "inputs", "drivers", "loads", "gravity", "g"];
/** Of a slider: its ends as parts of the value, and steps. */
const SLIDE = [0.2, 2], STEPS = 400;
const DIAGRAMS = 6;
const SECTIONS = ["points", "bodies", "joints", "drivers", "loads"];

export const button = (text, title, act, more = {}) => {
  const made = el("button", { type: "button", title, ...more }, text);
  made.addEventListener("click", act);
  return made;
};
const headed = (names) => el("thead", {}, el("tr", {}, ...names.map((name) => el("th", { scope: "col" }, name))));
/** Which key of the file it is, and what that means. */
const origin = ({ path, field }) => `${path.join(".")}${field ? `: ${field}` : ""}`;
/** A number written as the text of a field is: with its unit. */
function written(row, value) {
  const parts = /^\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(.*)$/i.exec(row.text), by = parts && row.value ? Number(parts[1]) / row.value : 1;
  return `${+(value * by).toPrecision(4)}${parts?.[2] ? ` ${parts[2]}` : ""}`;
}

export class Panels {
  constructor(board) {
    Object.assign(this, { board, tab: "numbers", sliders: new Set(), diagrams: [], dirty: null });
    this.tabs = Object.entries(WORDS.tabs).map(([key, name]) => button(name, "", () => { this.tab = key; this.show(); },
      { "data-tab": key, "aria-pressed": "false" }));
    this.content = el("div", { class: "content" });
    this.root = el("aside", { class: "side", "aria-label": WORDS.numbers }, el("div", { class: "tabs", role: "group", "aria-label": WORDS.numbers },
      ...this.tabs), this.content);
  }
  show() {
    const { board } = this, focus = document.activeElement?.dataset?.path;
    if (!board.state) return;
    for (const tab of this.tabs) tab.setAttribute("aria-pressed", tab.dataset.tab === this.tab);
    board.root.classList.toggle("broad", ["table", "text"].includes(this.tab));
    this.diagrams = [];
    this.live = null;
    this.content.replaceChildren(...this[`${this.tab}Tab`]());
    if (focus) this.content.querySelector(`[data-path="${CSS.escape(focus)}"]`)?.focus();
  }
  /** Into the first field. */
  focus() { this.content.querySelector("input:not([type=range])")?.focus(); }
  /** Results while something is dragged. */
  follow(drag) {
    for (const one of this.diagrams) one.follow(drag.plots?.find((plot) => plot.name === one.name), drag.drivers, drag.results);
    this.live?.(drag);
  }

  // -- numbers ----------------------------------------------------------------------------------

  /** The rows of an element; of all motors, loads and parameters where nothing is chosen. */
  #rows(chosen) {
    const { state } = this.board, on = (name, of) => state.sites?.[name]?.body === of;
    if (!chosen) return state.rows.filter((row) => GENERAL.includes(row.path[0]));
    const [section, name] = chosen, pin = section === "points" && this.board.pin(name);
    return state.rows.filter(({ path: [table, own, part, point] }) => {
      if (pin) return pin.places.some((one) => (table === "ground" ? bodyOf(one) === "ground" && `ground.${part}` === one
        : table === "bodies" && part === "points" && `${own}.${point}` === one)) || (table === "joints" && pin.joints.includes(own));
      if (section === "bodies") return (table === "bodies" && own === name) || (table === "drivers" && state.drivers[own]?.body === name) ||
        (table === "loads" && on(own, name));
      return table === section && own === name;
    });
  }
  numbersTab() {
    const { board } = this, { state, chosen } = board, [first] = chosen, pin = first?.[0] === "points" && board.pin(first[1]),
      grid = el("div", { class: "rows" });
    const title = chosen.length > 1 ? WORDS.chosen(chosen.length) : pin ? WORDS.pointTitle(pin) : first ? WORDS.ofKind(WORDS.kinds[first[0]], first[1])
      : WORDS.all;
    if (pin) for (const i of [0, 1]) grid.append(...this.#place(pin, i));
    for (const row of chosen.length > 1 ? [] : this.#rows(first)) grid.append(...this.#field(row));
    const acts = chosen.length ? board.menu.actionsOf(chosen).map(([name, act]) => button(name, "", act)) : [];
    return [el("h2", {}, title), grid, ...(grid.children.length || chosen.length ? [] : [el("p", { class: "hint" }, WORDS.noRows)]),
      ...(acts.length ? [el("div", { class: "bar" }, ...acts)] : []),
      ...(chosen.length ? [] : [el("p", { class: "hint" }, this.board.toolHint)]), ...this.#diagrams(state)];
  }
  /** A coordinate of a point on the paper: a plain number. */
  #place(pin, i) {
    const { board } = this, name = WORDS[i ? "sheetY" : "sheetX"];
    return this.#input({ id: `sheet.${i}`, name, text: String(+pin.xy[i].toPrecision(7)), unit: board.state.units.length }, (text) => {
      const xy = [...pin.xy];
      xy[i] = Number(text.replace(",", "."));
      if (!Number.isFinite(xy[i])) return board.refuse(WORDS.noPlace(text), pin.name, [name]);
      return board.edit({ do: "move", place: place(pin), xy, grain: board.grain / 1000, what: WORDS.did.move(pin.name) });
    });
  }
  #field(row) {
    const { board } = this, path = row.path.join("."), name = row.label, edit = (text) =>
      board.edit({ do: "set", path: row.path, text, what: WORDS.did.set(name, text) });
    const out = this.#input({ id: path, name, text: row.text, unit: row.unit, value: row.formula && Number.isFinite(row.value) ? `= ${shown(row.value, 5)} ${row.unit ?? ""}` : "",
      title: origin(row), choices: row.choices }, edit, row);
    if (this.sliders.has(path)) out.splice(-1, 0, this.#slider(row, path, edit));
    return out;
  }
  #slider(row, path, edit) {
    const { board } = this, ends = row.value ? SLIDE.map((part) => part * row.value).sort((a, b) => a - b) : [-1, 1];
    const made = el("input", { type: "range", min: ends[0], max: ends[1], step: (ends[1] - ends[0]) / STEPS, "aria-label": WORDS.slideTip(row.label),
      "data-path": `${path}:slide` });
    made.value = row.value;
    made.addEventListener("input", () => {
      board.drag({ do: "number", path: row.path, value: +made.value });
      this.content.querySelector(`[data-path="${CSS.escape(path)}"]`).value = written(row, +made.value);
    });
    made.addEventListener("change", () => edit(written(row, +made.value)));
    return made;
  }
  /** Label, field, unit with value and slider, and the sentence where it is refused. */
  #input({ id, name, text, unit, value = "", title = "", choices }, enter, row = null) {
    const { board } = this, key = `f-${id}`, why = el("p", { class: "sentence", id: `${key}-why`, hidden: "" }),
      input = el(choices ? "select" : "input", { id: key, "data-path": id, title, ...(choices ? {} : { autocomplete: "off", spellcheck: "false" }) });
    if (choices) input.append(...choices.map((one) => el("option", { value: one }, one)));
    input.value = text;
    const number = row && Number.isFinite(row.value) && !row.formula;
    const slide = number ? button("↔", WORDS.slideTip(name), () => { this.sliders[this.sliders.has(id) ? "delete" : "add"](id); this.show(); },
      { "aria-label": WORDS.slideTip(name), "aria-pressed": String(this.sliders.has(id)), class: "slide" }) : "";
    let sent = text;
    const send = async () => {
      if (input.value === sent) return;
      sent = input.value;
      if (await enter(input.value) !== false || !input.isConnected) return;
      this.#refused(input, board.fault?.sentence ?? board.badText.textContent); // what was typed stays
    };
    input.addEventListener("change", send);
    input.addEventListener("keydown", (event) => {
      if (event.key === "Enter") { send(); event.stopPropagation(); }
      if (event.key === "Escape") { event.stopPropagation(); board.fault = board.state.fault; input.value = sent = text; this.show(); board.tell();
      board.paper.svg.focus(); }
    });
    return [el("label", { for: key, title }, name), input, el("span", { class: "unit" }, value || unit || "", slide), why];
  }
  #refused(input, sentence) {
    const why = document.getElementById(`${input.id}-why`);
    input.setAttribute("aria-invalid", "true");
    input.setAttribute("aria-describedby", why.id);
    why.textContent = sentence;
    why.hidden = false;
  }
  /** The sentence of a fault beside its field, where that is shown. */
  fault(fault) {
    const input = fault?.path?.length && this.content.querySelector(`[data-path="${CSS.escape(fault.path.join("."))}"]`);
    if (input) this.#refused(input, fault.sentence);
  }
  tableTab() {
    const body = el("tbody");
    for (const row of this.board.state.rows) {
      const [, input, , why] = this.#field(row);
      input.setAttribute("aria-label", row.path.join("."));
      body.append(el("tr", {}, el("th", { scope: "row", title: origin(row) }, row.label), el("td", {}, input, why),
        el("td", {}, row.unit ?? ""), el("td", {}, Number.isFinite(row.value) ? shown(row.value, 5) : ""), el("td", {}, row.field)));
    }
    return [this.#table(el("table", { class: "all" }, headed(WORDS.columns), body))];
  }
  #table(table) { return el("div", { class: "table", tabindex: "0", role: "group", "aria-label": WORDS.tabs.table }, table); }

  // -- elements as a list -----------------------------------------------------------------------

  partsTab() {
    const { board } = this, { state } = board, names = { points: state.pins.map((pin) => [place(pin), `${pin.name} (${pin.places.map(bodyOf).join(", ")})`]) };
    for (const section of SECTIONS.slice(1)) names[section] = Object.entries(state[section]).map(([name, one]) =>
      [name, `${name}${one.kind ? ` (${one.kind})` : ""}`]);
    return SECTIONS.filter((section) => names[section].length).flatMap((section) => [el("h2", {}, WORDS.kinds[section]),
      el("div", { class: "bar" }, ...names[section].map(([name, text]) => button(text, "", (event) => board.choose([section, name], event.shiftKey),
      { "aria-pressed": String(board.chosen.some(([own, one]) => own === section && one === name)), "data-part": `${section}:${name}` })))]);
  }

  // -- results ----------------------------------------------------------------------------------

  resultsTab() {
    const { state } = this.board, table = el("tbody"), peaks = el("tbody");
    const fill = (results) => table.replaceChildren(...results.map((row) =>
      el("tr", {}, el("th", { scope: "row" }, row[0]), el("td", {}, shown(row[1], 6)), el("td", {}, row[2]))));
    const top = (rows) => peaks.replaceChildren(...rows.map((row) => el("tr", {}, el("th", { scope: "row" }, row[0]),
      ...row.slice(1).map((one) => el("td", {}, typeof one === "number" ? shown(one, 5) : one ?? "")))));
    fill(state.results ?? []);
    top(state.peaks ?? []);
    this.live = ({ results, peaks }) => { if (results) fill(results); if (peaks) top(peaks); };
    const messages = (state.messages ?? []).map((one) => el("li", {}, `${one.element ? `${one.element}: ` : ""}${one.text}`));
    return [el("h2", {}, WORDS.results), state.results?.length ? this.#table(el("table", {}, headed(WORDS.resultColumns), table)) : el("p", { class: "hint" }, WORDS.noRun),
      ...(state.peaks?.length ? [el("h2", {}, WORDS.peaks), this.#table(el("table", {}, headed([...WORDS.peakColumns, WORDS.at(state.plots[0])]), peaks))] : []), ...this.#diagrams(state),
      ...(messages.length ? [el("h2", {}, WORDS.messages), el("ul", { class: "hint" }, ...messages)] : []),
        ...(state.command ? [el("h2", {}, WORDS.commandTitle), el("p", {}, el("code", {}, state.command))] : [])];
  }
  #diagrams(state) {
    this.diagrams = (state.plots ?? []).slice(0, DIAGRAMS).map((plot) => new Diagram(this.board, plot));
    return this.diagrams.map((one) => one.root);
  }

  // -- the model file ---------------------------------------------------------------------------

  textTab() {
    const { board } = this, { state } = board, area = el("textarea", { spellcheck: "false", "aria-label": WORDS.textLabel, class: "file" }),
      problems = el("ul", { class: "problems" });
    area.value = this.dirty ?? state.text;
    area.addEventListener("input", () => { this.dirty = area.value; });
    const take = async () => {
      const good = area.value === state.text || await board.edit({ do: "text", text: area.value, what: WORDS.did.text });
      if (good) this.dirty = null;
      show(good ? [] : board.fault?.problems ?? [], good ? null : board.fault);
      if (good) this.show();
    };
    const show = (list, fault) => problems.replaceChildren(...(list.length ? list : fault ? [[0, "", fault.sentence]]
      : []).map(([line, key, text]) => el("li", {}, line ? button(WORDS.lineProblem(line, text), key, () => go(line)) : text)));
    const go = (line) => {
      const start = area.value.split("\n").slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0), end = area.value.indexOf("\n", start);
      area.focus();
      area.setSelectionRange(start, end < 0 ? area.value.length : end);
      area.scrollTop = (line - 4) * parseFloat(getComputedStyle(area).lineHeight);
    };
    show(state.fault?.problems ?? [], state.fault);
    area.addEventListener("keydown", (event) => { if (event.key === "Enter" && event.ctrlKey) take();
    if (event.key === "Escape") { this.dirty = null; this.show(); board.paper.svg.focus(); } });
    return [el("div", { role: "alert" }, problems), area, el("div", { class: "bar" }, button(WORDS.take, WORDS.takeTip, take, { class: "play" }))];
  }
}

/** A curve over the turn or the range, with the place that is shown; a press leads there. */
class Diagram {
  constructor(board, plot) {
    Object.assign(this, { board, name: plot.name });
    this.svg = sv("svg", { class: "strip", viewBox: "0 0 300 104", preserveAspectRatio: "none", role: "img" });
    this.output = el("output");
    this.root = el("section", { class: "diagram", "aria-label": plot.name }, el("h2", {}, `${plot.name}${plot.unit ? ` [${plot.unit}]` : ""}`), this.svg,
      el("p", { class: "hint" }, this.range = el("span"), " ", this.output));
    this.now = sv("line", { class: "now", y1: 2, y2: 102 });
    this.zero = sv("line", { class: "zero", x1: 0, x2: 300 });
    this.curve = sv("path");
    this.svg.append(this.zero, this.curve, this.now);
    const go = (event) => {
      const box = this.svg.getBoundingClientRect(), { x } = this.plot, at = x[0] + (event.clientX - box.left) / box.width * (x.at(-1) - x[0]);
      if (this.driver) this.board.drag({ act: "drive", values: { [this.driver]: at / this.scale } });
    };
    this.svg.addEventListener("pointerdown", (event) => { this.svg.setPointerCapture(event.pointerId); go(event); });
    this.svg.addEventListener("pointermove", (event) => { if (event.buttons) go(event); });
    this.follow(plot, Object.fromEntries(Object.entries(board.state.drivers).map(([name, one]) => [name, one.value])), board.state.results);
  }
  follow(plot, drivers, results) {
    if (plot) this.#draw(plot);
    const { x } = this.plot, span = x.at(-1) - x[0], at = drivers?.[this.driver] * this.scale;
    if (!span || !Number.isFinite(at)) return;
    let part = (at - x[0]) / span;
    if (this.turns) part -= Math.floor(part + 1e-9);
    const own = results?.find(([name]) => name === this.name);
    for (const end of ["x1", "x2"]) this.now.setAttribute(end, (300 * part).toFixed(1));
    this.output.textContent = own ? `${WORDS.here} ${shown(own[1], 4)}` : "";
  }
  #draw(plot) {
    const { drivers } = this.board.state, { x, y } = this.plot = plot;
    // over the driver's own value, in degrees where it turns; over time nothing can be led
    const own = Object.keys(drivers).find((name) => plot.xname?.includes(name)) ?? Object.keys(drivers)[0];
    this.scale = plot.xunit === "rad" ? DEG : 1;
    this.driver = own && (plot.xunit === drivers[own].unit || plot.xunit === "rad") ? own : null;
    this.turns = drivers[own]?.turns && Math.abs(Math.abs(x.at(-1) - x[0]) - 360 * this.scale) < 1e-3 * this.scale;
    const good = y.filter(Number.isFinite), low = Math.min(0, ...good), high = Math.max(0, ...good), tall = high - low || 1,
      up = (v) => (98 - 92 * (v - low) / tall).toFixed(1);
    let d = "";
    for (let k = 0; k < x.length; k++) d += Number.isFinite(y[k])
      ? `${k && Number.isFinite(y[k - 1]) ? "L" : "M"}${(300 * (x[k] - x[0]) / (x.at(-1) - x[0] || 1)).toFixed(1)} ${up(y[k])}` : "";
    this.curve.setAttribute("d", d);
    for (const end of ["y1", "y2"]) this.zero.setAttribute(end, up(0));
    const said = WORDS.from(shown(Math.min(...good), 4), shown(Math.max(...good), 4), plot.unit ?? "");
    this.range.textContent = `${said}, ${WORDS.over(plot.xname ?? "", plot.xunit ?? "")};`;
    this.svg.setAttribute("aria-label", `${plot.name}, ${said}`);
  }
}
