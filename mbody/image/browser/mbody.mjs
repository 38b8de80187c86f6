// mbody in a browser, or in Node: the compiled core and the image of a model, without Python.
//
//   import { Core } from "./mbody.mjs";
//   const core = await Core.load(await (await fetch("mbody.wasm")).arrayBuffer());
//   const model = core.open(await (await fetch("fourbar.img")).arrayBuffer());
//   model.set({ "crank.mass": 2.5 });
//   const turn = model.turn();                       // kinetostatics over a turn
//   console.log(turn.t.length, Math.max(...turn.measure("motor.effort")));
//
// Numbers are in the units of the manifest, angles in radians. What cannot be done is an MbodyError
// with a sentence; the model is then as it was before. The bytes of an image: docs/images.md.

const MAGIC = 0x676d6979646f626dn; // "mbodyimg"
const FORMAT = 1n;
const ALIGNMENT = 64;
const PAGE = 65536;
const KINDS = ["", "number", "input", "measure", "call", "array", "state"];

// Slots of the state of a free motion, and codes of its steps: mbody/kernels/step_state.py
export const SLOTS = {
  TIME: 0, NEXT: 1, STEPS: 2, REJECTED: 3, EVALUATIONS: 5, DELIVERED: 6, LAST_STEP_ALLOWED: 18,
  ARTIFICIAL_ENERGY: 24, ARTIFICIAL_LIMIT: 25,
};
export const CODES = {
  DONE: 0, MORE: 1, STEP_VANISHED: 2, NOT_FINITE: 3, STIFF: 4, LAST_STEP: 5, SINGULAR_AHEAD: 6,
  BRANCH_UNCERTAIN: 7,
};
// Of motions in which something may open, stick or strike what comes next, and what has happened:
// mbody/kernels/advance.py
const [STARTING, JUMPED] = [5n, 6n];
export const HAPPENED = {
  NOT_QUIET: 9, ZERO: 10, IMPACT: 11, COLLISION: 12, DECIDED: 13, BEGUN: 14, NO_IMPACT: 15, NO_MODES: 16,
  NO_COLLISION: 17, LOST: 18, POLE: 19, IMPACTS_WITHOUT_END: 20, CHANGES_WITHOUT_END: 21, MEMORY: 22,
  UNBROKEN: 23,
};
// What the path of the drivers is followed by: mbody/kernels/continuation.py
export const BY_DRIVER = 1;
// Part of the model length from which on wheels do not fit
const MISFIT = 1e-6;
// Steps of one call. Loads that jump to and fro keep steps short for ever: where the mean of so many
// is below a tenth of the longest such mean, and more than PATIENT lie ahead, a motion ends.
const AT_ONCE = 10000;
const PATIENT = 300000;

const STOPPED = {
  [CODES.STEP_VANISHED]: "the steps vanish: the loads jump there, grow without bound, or are too stiff",
  [CODES.NOT_FINITE]: "a load or a law has no finite value there",
  [CODES.STIFF]: "the loads are too stiff for explicit steps: simulate with the method 'radau5' in mbody",
  [CODES.SINGULAR_AHEAD]: "a singular position lies ahead: how the motion goes on needs mbody itself",
  [CODES.BRANCH_UNCERTAIN]: "a singular position is near: on which branch the motion goes on needs mbody itself",
  [HAPPENED.NOT_QUIET]: "steps do not show what they meet: this needs mbody itself",
  [HAPPENED.NO_IMPACT]: "an impact has no solution: friction wedges what would rebound, or drivers lead it from two sides",
  [HAPPENED.NO_MODES]: "no accelerations are consistent with the friction",
  [HAPPENED.NO_COLLISION]: "no accelerations and no impact are consistent with the friction",
  [HAPPENED.LOST]: "masses touch that differ by more than numbers carry",
  [HAPPENED.POLE]: "the forces of what slides grow without bound (Painlevé's paradox)",
  [HAPPENED.IMPACTS_WITHOUT_END]: "impacts do not end",
  [HAPPENED.CHANGES_WITHOUT_END]: "contacts and friction change their modes without end",
  [HAPPENED.MEMORY]: "more touches than the image has memory for",
};
const BEGINNINGS = [
  "",
  "the loops do not close near the start: give another start",
  "a load or a law has no finite value at the start: begin elsewhere",
  "a body has so little mass that the image cannot integrate it: export the model with that mass",
];

/** What mbody cannot do, in a sentence. */
export class MbodyError extends Error {
  constructor(message) {
    super(message);
    this.name = "MbodyError";
  }
}

/** The compiled kernels: one instance serves many models, one call at a time. */
export class Core {
  /**
   * @param {BufferSource|Response|WebAssembly.Module} source  what `mbody compile --target wasm32` wrote
   * @returns {Promise<Core>}
   */
  static async load(source) {
    let module = source;
    if (typeof Response !== "undefined" && source instanceof Response) source = await source.arrayBuffer();
    try {
      if (!(source instanceof WebAssembly.Module)) module = await WebAssembly.compile(source);
    } catch (error) {
      throw new MbodyError(`this is no compiled core that runs here (${error.message}); it needs WebAssembly with 128-bit vectors`);
    }
    return new Core(await WebAssembly.instantiate(module, {}));
  }

  constructor(instance) {
    const { exports } = instance;
    if (!exports.memory || !exports.mbody_sources) throw new MbodyError("this WebAssembly module is no core of mbody");
    exports._initialize?.();
    this.exports = exports;
    this.memory = exports.memory;
    this._end = up(exports.__heap_base.value);
    this._free = []; // [place, bytes] of memory given back
    /** Hash of the sources of the kernels, in hexadecimal. */
    this.sources = this._text(exports.mbody_sources.value);
  }

  /**
   * A model from its image (`mbody export MODEL --to image`).
   * @param {ArrayBuffer|Uint8Array} image
   * @returns {Model}
   */
  open(image) {
    const bytes = image instanceof Uint8Array ? image : new Uint8Array(image);
    return new Model(this, bytes);
  }

  _allocate(bytes) {
    const size = up(bytes);
    const found = this._free.findIndex(([, have]) => have >= size);
    if (found >= 0) return this._free.splice(found, 1)[0];
    const place = this._end;
    const lacking = place + size - this.memory.buffer.byteLength;
    if (lacking > 0) {
      try {
        this.memory.grow(Math.ceil(lacking / PAGE));
      } catch {
        throw new MbodyError(`there is no memory for an image of ${bytes} bytes`);
      }
    }
    this._end += size;
    return [place, size];
  }

  _text(place) {
    const bytes = new Uint8Array(this.memory.buffer, place);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }
}

/** The result of a run: instants with what is kept of each, and the measured quantities. */
export class Motion {
  constructor(model, t, s, pages, measured, stats) {
    /** Times, and values of the path parameter (of the driver, or times). */
    this.t = t;
    this.s = s;
    /** Numbers of one instant after the other: x, y, angle of each body's mass centre, their rates, their accelerations, then five a primitive. */
    this.pages = pages;
    this.rows = t.length ? pages.length / t.length : 0;
    /** Measured quantities of one instant after the other, in the order of `model.measures`. */
    this.measured = measured;
    /** Counts of the steps, and `doubts`, sentences. */
    this.stats = stats;
    this._model = model;
  }

  /** The history of a measured quantity, such as "crank.angle" or "motor.effort". */
  measure(name) {
    const column = this._model._column(name);
    const count = this._model.measures.length;
    return Float64Array.from({ length: this.t.length }, (_, k) => this.measured[k * count + column]);
  }

  /** The last instant alone. */
  last() {
    const columns = this._model.measures.length;
    return new Motion(this._model, this.t.slice(-1), this.s.slice(-1), this.pages.slice(-this.rows), this.measured.slice(-columns), this.stats);
  }

  /** Positions of the bodies at instant k: x, y, angle of each mass centre in turn. */
  position(k) {
    const n = this._model.manifest.coordinates;
    return this.pages.subarray(k * this.rows, k * this.rows + n);
  }
}

/** A mechanism that can be changed, driven and set free. */
export class Model {
  constructor(core, bytes) {
    const head = check(bytes, core.sources);
    this.core = core;
    [this._at, this._size] = core._allocate(bytes.length + ALIGNMENT);
    this._results = this._at + up(bytes.length);
    new Uint8Array(core.memory.buffer).set(bytes, this._at);
    const words = this._view(BigUint64Array, 0, Number(head[2]) / 8);
    const [first, count] = [Number(head[3]), Number(head[4])];
    for (let n = first; n < first + count; n++) words[Number(words[n])] += BigInt(this._at);
    this._data = this._at + 128;
    this._bytes = bytes.length;
    /** What the image says of its model: names, units, notes. */
    this.manifest = JSON.parse(new TextDecoder().decode(bytes.subarray(Number(head[7]), Number(head[7] + head[8]))));
    this._entries = Object.fromEntries(KINDS.map((kind) => [kind, new Map()]));
    for (let n = 0; n < Number(head[6]); n++) {
      const [kind, place, size, name, unit] = words.subarray(Number(head[5]) + 5 * n, Number(head[5]) + 5 * n + 5);
      this._entries[KINDS[Number(kind)]].set(core._text(this._at + Number(name)), {
        place: Number(place), count: Number(size), unit: core._text(this._at + Number(unit)), index: n,
      });
    }
    /** Names of the numbers that can be changed, of the inputs and of the measured quantities. */
    this.numbers = [...this._entries.number.keys()];
    this.inputs = [...this._entries.input.keys()];
    this.measures = [...this._entries.measure.keys()];
    this._closed = true;
    this._inputsOld = false; // whether the free motion has still to take an input
    this._drive = {}; // values of the drivers where they are known
  }

  /** Give the memory back; the model cannot be used any more. */
  free() {
    this.core._free.push([this._at, this._size]);
    this.core = null;
  }

  /** Whether the image has an analysis: "turn", "run". */
  can(analysis) {
    return this._entries.call.has(analysis);
  }

  /** A number by its dotted name, such as "crank.mass". */
  get(name) {
    return this._number(name)[0];
  }

  /** The unit of a number or a measured quantity. */
  unit(name) {
    const entries = [this._entries.number, this._entries.input, this._entries.measure];
    return (entries.map((one) => one.get(name)).find(Boolean) ?? this._missing(name)).unit;
  }

  /**
   * Change numbers, all at once. A free motion that has begun goes on with other inputs; with other
   * numbers it is to begin anew.
   * @param {Object<string, number>} values  by dotted name, inputs by theirs
   */
  set(values) {
    const before = Object.keys(values).map((name) => [this._number(name), this.get(name)]);
    for (const [name, value] of Object.entries(values)) this._number(name)[0] = Number(value);
    const refused = this._setNumbers();
    if (refused < 0) {
      this._inputsOld ||= Object.keys(values).some((name) => this._isInput(name));
      this._closed = false;
      return;
    }
    const name = this.numbers[refused];
    const sentence = name === undefined
      ? `the numbers do not fit together: ${Object.entries(values).map(([n, v]) => `${n} = ${v}`).join(", ")}`
      : `'${name}' cannot be ${this.get(name)} ${this.unit(name)}: it must be finite, and positive where a mass or a length is`;
    for (const [place, value] of before) place[0] = value;
    this._setNumbers();
    throw new MbodyError(sentence);
  }

  /**
   * Close the loops for the present numbers, from where the mechanism is.
   * @param {{t?: number, drive?: Object<string, number>}} [how]  time, and values of drivers
   */
  close({ t, drive = {} } = {}) {
    this._needs("close");
    this._knows(drive);
    this._close({ t, drive });
    this._closed = true;
    this._drive = { ...drive };
  }

  /**
   * Kinetostatics over a turn of the driver as its law goes, or over other times.
   * @param {{from?: number, to?: number}} [path]  first and last value of the path parameter (`manifest.driven["path parameters"].turn`); those of the image where none is given
   * @returns {Motion}
   */
  turn({ from, to } = {}) {
    this._needs("turn");
    const s = this._array("turn.s"), n = s.length - 1;
    if (from !== undefined || to !== undefined) {
      const [first, last] = [from ?? s[0], to ?? s[n]];
      for (let k = 0; k <= n; k++) s[k] = k === n ? last : first + (k * (last - first)) / n;
    }
    const byDriver = this._byDriver("turn");
    if (byDriver) s.forEach((value, k) => (this._array("turn.given")[3 * k] = value));
    else this._array("turn.t").set(s);
    const before = this._array("driven.q").slice();
    try {
      this._close(byDriver ? { drive: { [this.manifest.drivers[0]]: s[0] } } : { t: s[0] });
      return this._followed("turn");
    } finally {
      this._array("driven.q").set(before);
    }
  }

  /**
   * Move drivers to these values along the branch, with all forces there; the mechanism stays there.
   * @param {Object<string, number>} drive  values by driver
   * @param {{rate?: Object<string, number>, acceleration?: Object<string, number>, t?: number}} [motion]  of the drivers there, 0 where none is given; the time of loads
   * @returns {Motion}  of one instant
   */
  step(drive, { rate = {}, acceleration = {}, t } = {}) {
    this._needs("step");
    this._knows(drive, rate, acceleration);
    const names = this.manifest.drivers, there = { ...this._drive, ...drive };
    const before = this._array("driven.q").slice();
    if (!this._closed || names.some((name) => !(name in this._drive))) this.close({ drive: there });
    const [first, last] = [names.map((name) => this._drive[name]), names.map((name) => there[name])];
    if (t !== undefined) this._array("step.t").fill(t);
    const given = this._array("step.given"); // (2, drivers, 3): value, rate, acceleration
    names.forEach((name, n) => {
      given.set([first[n], rate[name] ?? 0, acceleration[name] ?? 0], 3 * n);
      given.set([last[n], rate[name] ?? 0, acceleration[name] ?? 0], 3 * (names.length + n));
    });
    if (names.length === 1) this._array("step.s").set([first[0], last[0]]);
    else this._array("step.chords").set(names.map((_, n) => last[n] - first[n]));
    try {
      const motion = this._followed("step");
      this._drive = there;
      return motion.last();
    } catch (error) {
      this._array("driven.q").set(before);
      throw error;
    }
  }

  /**
   * Begin a free motion.
   * @param {{t?: number, until?: number, q?: ArrayLike<number>, v?: ArrayLike<number>}} [start]  first and last time; position and velocity near which it begins (those of the image)
   * @returns {Float64Array}  what is kept of the first state
   */
  start({ t, until, q, v } = {}) {
    this._needs("begin");
    const times = this._array("start.times");
    if (t !== undefined) times[0] = t;
    if (until !== undefined) times[1] = until;
    if (!(times[1] > times[0])) throw new MbodyError(`a motion from ${times[0]} to ${times[1]} s has no length: give a later end`);
    if (q !== undefined) this._array("start.q").set(q);
    if (v !== undefined) this._array("start.v").set(v);
    if (this._acts) this._madeWith();
    if (this._acts) this._array("motion.happened")[0] = 0;
    this._evaluate(STARTING);
    return this._array("begin.page").slice();
  }

  /** What the motion begins with, or goes on with after inputs have changed. */
  _evaluate(stage) {
    const code = Number(this._call("begin")[0]);
    if (code) throw new MbodyError(`'${this.manifest.model}': ${BEGINNINGS[code]}`);
    this._inputsOld = false;
    if (this._acts) this._settle(stage);
  }

  /** Let the motion that has begun go on with other inputs: the word tells the kernel so. */
  _takeInputs() {
    const goesOn = this._view(BigInt64Array, this._entries.array.get("begin.goes_on").place, 1);
    goesOn[0] = 1n;
    try {
      this._evaluate(JUMPED);
    } finally {
      goesOn[0] = 0n;
    }
  }

  /** Impacts and changes of modes that the free motion has met: time, kind, name of what is struck. */
  get events() {
    if (!this._acts) return [];
    const kept = this._array("motion.events");
    const { contacts } = this.manifest.free;
    return Array.from({ length: this._array("motion.happened")[0] }, (_, n) => {
      const [t, code, who] = kept.slice(3 * n, 3 * n + 3);
      return { t, kind: code === HAPPENED.BEGUN ? "modes" : "impact", contact: contacts[who] };
    });
  }

  /** The time that the free motion has reached. */
  get time() {
    return this._array("motion.state")[SLOTS.TIME];
  }

  /**
   * Go on with the free motion to exactly this time.
   * @returns {Motion}  of one instant
   */
  advance(until) {
    return this._steps("advance", until, Float64Array.of(until));
  }

  /**
   * A whole free motion from its start; the instants lie evenly.
   * @param {{until?: number}} [how]
   * @returns {Motion}
   */
  run({ until, ...start } = {}) {
    const page = this.start({ until, ...start });
    const [first, last] = this._array("start.times");
    const count = this._array("run.times").length;
    const times = Float64Array.from({ length: count }, (_, k) => k === count - 1 ? last : first + (k * (last - first)) / (count - 1));
    return this._steps("run", last, times, page);
  }

  /** All that the model is now, to come back to with `restore`. */
  save() {
    const bytes = this._view(Uint8Array, 0, this._bytes).slice();
    return { closed: this._closed, inputsOld: this._inputsOld, drive: this._drive, bytes };
  }

  /** Come back to what `save` returned. */
  restore(saved) {
    this._view(Uint8Array, 0, this._bytes).set(saved.bytes);
    [this._closed, this._inputsOld, this._drive] = [saved.closed, saved.inputsOld, saved.drive];
  }

  // -- within -------------------------------------------------------------------------------------

  _view(Kind, place, count) {
    return new Kind(this.core.memory.buffer, this._at + place, count);
  }

  _array(name) {
    const entry = this._entries.array.get(name);
    if (!entry) throw new MbodyError(`the image of '${this.manifest.model}' has no ${name}`);
    return this._view(Float64Array, entry.place, entry.count);
  }

  _place(name) {
    return (this._entries.number.get(name) ?? this._entries.input.get(name) ?? this._missing(name)).place;
  }

  /** Whether a name is that of an input, or of its number. */
  _isInput(name) {
    return this.inputs.some((one) => this._place(one) === this._place(name));
  }

  _number(name) {
    return this._view(Float64Array, this._place(name), 1);
  }

  _missing(name) {
    const why = this.manifest.not_changeable?.[name];
    throw new MbodyError(why ? `'${name}' cannot be changed in an image: ${why}` : `'${this.manifest.model}' has no number or quantity '${name}'`);
  }

  _column(name) {
    return (this._entries.measure.get(name) ?? this._missing(name)).count;
  }

  _needs(call) {
    if (this.can(call)) return;
    const notes = (this.manifest.notes ?? []).join("; ");
    throw new MbodyError(`the image of '${this.manifest.model}' has no ${call}${notes && `: ${notes}`}`);
  }

  /** Whether something may open, stick or strike. */
  get _acts() {
    return this._entries.array.has("motion.stage");
  }

  /** Refuse numbers that the contacts of the image were not made with. */
  _madeWith() {
    const made = this._array("motion.numbers");
    const other = this.numbers.find((name, n) => !this._isInput(name) && this.get(name) !== made[n]);
    if (other) throw new MbodyError(`${other} is not what the contacts of this image were made with: export it again with the new number`);
  }

  /** Modes are decided: first ones, or those after forces have jumped. */
  _settle(stage) {
    const call = this.can("advance") ? "advance" : "run";
    this._view(BigInt64Array, this._entries.array.get("motion.stage").place, 1)[0] = stage;
    for (let code = HAPPENED.ZERO; code !== HAPPENED.BEGUN && code !== HAPPENED.UNBROKEN; ) {
      code = Number(this._call(call)[0]);
      if (code === HAPPENED.UNBROKEN) continue;
      if (code < HAPPENED.ZERO || code > HAPPENED.BEGUN) {
        throw new MbodyError(`the motion of '${this.manifest.model}' cannot go on at t = ${this.time} s: ${STOPPED[code]}`);
      }
      if (code !== HAPPENED.BEGUN) this._note(code);
    }
    this._array("begin.page").set(this._array("motion.page"));
  }

  /** Keep an impact, or a change of modes. */
  _note(code) {
    const [kept, count] = [this._array("motion.events"), this._array("motion.happened")];
    if (code === HAPPENED.ZERO || code === HAPPENED.DECIDED || 3 * (count[0] + 1) > kept.length) return;
    const struck = this._view(BigInt64Array, this._entries.array.get("motion.struck").place, 1)[0];
    kept.set([this.time, code, code === HAPPENED.IMPACT ? Number(struck) : -1], 3 * count[0]);
    count[0] += 1;
  }

  /** Arguments of a call are in the image; its results, words. */
  _call(name) {
    const kernel = this._acts && KERNELS[name] === "runge_kutta" ? "advance_motion" : KERNELS[name];
    const { place } = this._entries.call.get(name);
    const raised = this.core.exports[`mbody_${kernel}_words`](this._at + place, this._results);
    if (raised) throw new MbodyError(`the kernel ${kernel} failed with status ${raised}`);
    return new BigInt64Array(this.core.memory.buffer, this._results, 4);
  }

  _setNumbers() {
    for (const name of ["numbers.driven", "numbers.free"]) {
      if (!this.can(name)) continue;
      const refused = Number(this._call(name)[0]);
      if (refused >= 0) return refused;
    }
    return -1;
  }

  _knows(...tables) {
    const names = this.manifest.drivers;
    const unknown = tables.flatMap((table) => Object.keys(table)).find((name) => !names.includes(name));
    if (unknown !== undefined) throw new MbodyError(`there is no driver '${unknown}' (there are: ${names.join(", ") || "none"})`);
  }

  _close({ t, drive = {} }) {
    const given = this._array("close.given");
    this.manifest.drivers.forEach((name, n) => (given[n] = name in drive ? drive[name] : NaN));
    if (t !== undefined) this._array("close.t")[0] = t;
    const q = this._array("driven.q"), before = q.slice();
    const [good] = this._call("close");
    if (good === 0n) {
      this._array("driven.q").set(before);
      const where = Object.entries(drive).map(([name, value]) => `${name} = ${value}`).join(", ") || `t = ${this._array("close.t")[0]}`;
      throw new MbodyError(`the loops of '${this.manifest.model}' do not close at ${where}: give other numbers, or another value of the driver`);
    }
  }

  _byDriver(name) {
    // the third argument is the path, whose first word says what it is followed by
    const path = this._view(BigInt64Array, this._entries.call.get(name).place, 3)[2];
    return Number(new BigInt64Array(this.core.memory.buffer, Number(path), 1)[0]) === BY_DRIVER;
  }

  _followed(name) {
    this._array(`${name}.progress`).fill(0);
    const code = Number(this._call(name)[0]);
    const progress = this._array(`${name}.progress`);
    if (code) {
      const reached = progress[1];
      throw new MbodyError(code === 1
        ? `'${this.manifest.model}' cannot be followed beyond ${reached}: a dead centre, or a position at which it may go on in two ways`
        : `'${this.manifest.model}' has no position at ${this._array(`${name}.s`)[0]}`);
    }
    this._call(`${name}.measures`);
    const stats = { steps: progress[3], unbalanced: progress[4], changePoints: progress[5], doubts: [] };
    if (progress[5]) stats.doubts.push(`the mechanism passes ${progress[5]} change points, where it may go on in two ways`);
    return this._motion(name, this._array(`${name}.t`), this._array(`${name}.s`), `${name}.output`, stats);
  }

  _motion(name, t, s, pages, stats) {
    const motion = new Motion(this, t.slice(), s.slice(), this._array(pages).slice(), this._array(`${name}.measured`).slice(), stats);
    for (const one of this.measures.filter((measure) => measure.endsWith(".misfit"))) {
      const off = Math.max(...motion.measure(one).map(Math.abs));
      if (off > MISFIT * this.manifest.length) {
        stats.doubts.push(`'${one.slice(0, -7)}' does not fit: its wheels are ${off.toPrecision(3)} ${this.unit(one)} from where they meet; change the distance or a radius`);
      }
    }
    return motion;
  }

  _steps(name, until, times, first) {
    this._needs(name);
    if (this._inputsOld && name === "advance") this._takeInputs();
    if (!(until > this.time)) throw new MbodyError(`the motion is at t = ${this.time} s already: give a time after that, not ${until}`);
    this._array(`${name}.times`).set(times);
    this._array(`${name}.until`)[0] = until;
    if (this._acts) this._array(`${name}.steps`)[0] = AT_ONCE;
    else this._view(BigInt64Array, this._entries.array.get(`${name}.steps`).place, 1)[0] = BigInt(AT_ONCE);
    let state = this._array("motion.state");
    state[SLOTS.DELIVERED] = state[SLOTS.LAST_STEP_ALLOWED] = 0;
    if (first && times[0] <= this.time) {
      this._array(`${name}.pages`).set(first);
      state[SLOTS.DELIVERED] = 1;
    }
    const doubts = [];
    let [count, since, longest] = [state[SLOTS.STEPS], state[SLOTS.TIME], 0];
    for (let code = CODES.MORE; code !== CODES.DONE; ) {
      code = Number(this._call(name)[0]);
      state = this._array("motion.state");
      if (code >= HAPPENED.ZERO && code <= HAPPENED.BEGUN) this._note(code);
      else if (code === CODES.LAST_STEP) state[SLOTS.LAST_STEP_ALLOWED] = 1;
      else if (code === CODES.MORE && state[SLOTS.ARTIFICIAL_ENERGY] > state[SLOTS.ARTIFICIAL_LIMIT]) {
        state[SLOTS.ARTIFICIAL_LIMIT] *= 2;
        doubts.push(`at t = ${state[SLOTS.TIME]} s bodies without mass carry energy: give them masses`);
      } else if (code > CODES.MORE) {
        throw new MbodyError(`the motion of '${this.manifest.model}' ends at t = ${state[SLOTS.TIME]} s: ${STOPPED[code]}`);
      }
      if (code === CODES.MORE && state[SLOTS.STEPS] - count >= AT_ONCE) {
        const mean = (state[SLOTS.TIME] - since) / (state[SLOTS.STEPS] - count);
        const left = (until - state[SLOTS.TIME]) / mean;
        if (mean < 0.1 * longest && !(left < PATIENT)) {
          throw new MbodyError(`the loads of '${this.manifest.model}' jump to and fro at t = ${state[SLOTS.TIME]} s: the last ${AT_ONCE} steps were ${mean.toPrecision(1)} s each, the end would take ${left.toPrecision(1)} more; smooth what jumps`);
        }
        [count, since, longest] = [state[SLOTS.STEPS], state[SLOTS.TIME], Math.max(longest, mean)];
      }
    }
    this._call(`${name}.measures`);
    const stats = { steps: state[SLOTS.STEPS], rejected: state[SLOTS.REJECTED], evaluations: state[SLOTS.EVALUATIONS], doubts: doubts.slice(0, 1) };
    return this._motion(name, times, times, `${name}.pages`, stats);
  }
}

const KERNELS = {
  "numbers.driven": "set_numbers", "numbers.free": "set_numbers", close: "close_at", turn: "follow",
  step: "follow", begin: "begin_motion", advance: "runge_kutta", run: "runge_kutta",
  "turn.measures": "measures", "step.measures": "measures", "advance.measures": "measures",
  "run.measures": "measures",
};

function up(bytes) {
  return Math.ceil(bytes / ALIGNMENT) * ALIGNMENT;
}

/** The sixteen words that an image begins with; an image that is not whole or not ours is refused. */
function check(bytes, sources) {
  const damaged = (why) => new MbodyError(`the image is damaged (${why}): export it again`);
  if (bytes.length < 128) throw damaged(`${bytes.length} bytes`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const head = Array.from({ length: 16 }, (_, n) => view.getBigUint64(8 * n, true));
  if (head[0] !== MAGIC) throw new MbodyError("this is no image of mbody: make one with `mbody export MODEL --to image`");
  if (head[1] !== FORMAT) throw new MbodyError(`the image has format ${head[1]}, this module reads ${FORMAT}: export it again`);
  if (head[2] !== BigInt(bytes.length) || bytes.length % 8) throw damaged(`it has ${bytes.length} of ${head[2]} bytes`);
  const total = head[2];
  const inside = (first, count, size) => (first + count) * size <= total && count <= total;
  if (!inside(head[3], head[4], 8n) || !inside(head[5], 5n * head[6], 8n) || !inside(head[7], head[8], 1n)) throw damaged("its tables end beyond it");
  for (let n = head[3]; n < head[3] + head[4]; n++) {
    const word = view.getBigUint64(Number(8n * n), true);
    if (8n * word + 8n > total || view.getBigUint64(Number(8n * word), true) > total) throw damaged("an address lies beyond it");
  }
  const hash = [...bytes.subarray(72, 104)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  if (hash !== sources) throw new MbodyError(`the image was made for other kernels (${hash.slice(0, 8)} …) than these (${sources.slice(0, 8)} …): export it, or compile the core, again`);
  if (head[13] !== checksum(view, bytes.length / 8)) throw damaged("its checksum is not that of its bytes");
  return head;
}

/** Σ (2n + 1) word n modulo 2⁶⁴ without word 13, which has it; never 0. */
function checksum(view, words) {
  let sum = 0n;
  for (let n = 0; n < words; n++) {
    if (n !== 13) sum = BigInt.asUintN(64, sum + BigInt(2 * n + 1) * view.getBigUint64(8 * n, true));
  }
  return sum || 1n;
}
