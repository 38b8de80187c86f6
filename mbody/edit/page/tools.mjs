// The tools of the board: small state machines. They get what the pointer does in places of the
// world, with what lies there, and say which edit is meant; they know no pixels and no server.
//
// A hit is {pin, body, element, xy, raw, polar, moved, shift, alt}: the point or link there, the
// place to which it snaps, typed numbers, and whether the pointer has gone since it was pressed; `more` where
// a further point is wanted.

import { TOOL_WORDS, WORDS } from "./words.mjs";
import { away, direction } from "./snapping.mjs";

const { did } = WORDS;
/** The place by which a point is named: of a link, if one has it. */
export const place = (pin) => pin.places.find((one) => !one.startsWith("ground.")) ?? pin.places[0];
export const bodyOf = (name) => name.slice(0, name.indexOf("."));
const linkOf = (hit) => hit.body ?? (hit.pin && bodyOf(place(hit.pin)) !== "ground" ? bodyOf(place(hit.pin)) : null);
const owner = (hit) => (hit.pin ? bodyOf(place(hit.pin)) : hit.body ?? "ground");
const where = (hit) => (hit.pin ? hit.pin.xy : hit.xy);

/** The name of a new point: a letter that no point has. */
export function letter(state, used = []) {
  const names = new Set([...state.pins.flatMap((pin) => pin.places.map((one) => one.slice(one.indexOf(".") + 1))), ...used]);
  for (let round = 0; ; round++) for (const one of "ABCDEFGHIJKLMNOPQRSTUVWXYZ") {
    const name = round ? `${one}${round}` : one;
    if (!names.has(name)) { used.push(name); return name; }
  }
}
/** A place as an end of an element: of a point, or a new point of the link or the ground. */
const end = (hit) => (hit.pin ? place(hit.pin) : { body: hit.body ?? "ground", xy: hit.xy });
/** A place of the name of a point; a new point of a link is a step before. */
function anchored(board, hit, steps, used = []) {
  if (hit.pin) return place(hit.pin);
  const name = letter(board.state, used);
  steps.push({ do: "point", body: hit.body, xy: hit.xy, name, grain: board.grain });
  return `${hit.body}.${name}`;
}
const together = (board, steps, what) => board.edit(steps.length > 1 ? { do: "all", steps, what } : { ...steps[0], what });

/** A tool of two places: dragged from one to the other, or both clicked. */
const two = (key, icon, ends, begins = () => "") => ({
  key, icon, from: null, draws: true,
  down(board, hit) {
    this.fresh = !this.from;
    if (this.from) return;
    const why = begins(hit);
    if (why) board.say(why); else this.from = hit;
  },
  move(board, hit) { if (this.from) board.rubber([where(this.from), where(hit)]); },
  up(board, hit) {
    const { from } = this;
    if (!from || (this.fresh && !hit.moved) || away(where(from), where(hit)) < board.grain) return;
    this.stop(board);
    ends.call(this, board, from, hit);
  },
  stop(board) { const was = this.from; this.from = null; board.rubber(null); return Boolean(was); },
});
/** A tool of one place. */
const one = (key, icon, act) => ({ key, icon, down() {}, move() {}, up: act, stop: () => false });

const select = {
  key: "v", icon: "M6 3v15l4-4 2.6 6 2.6-1.2L12.6 13H18z", held: null,
  down(board, hit) {
    const name = hit.pin ? ["points", place(hit.pin)] : hit.element ?? (hit.body && ["bodies", hit.body]);
    this.held = null;
    if (!name && hit.shift) { this.held = { band: hit.raw }; return false; }
    board.choose(name, hit.shift);
    if (!name) return true; // the paper moves the view
    if (hit.pin && board.away) { board.goHome(); board.say(WORDS.nowHome); return false; }
    if (hit.pin) this.held = hit.pin.fixed ? { fixed: hit.pin.fixed } : { pin: hit.pin, name };
    else if (hit.body) return move.down(board, hit);
    return false;
  },
  move(board, hit, pressed) {
    const { held } = this;
    if (!pressed) return;
    if (move.held) return move.move(board, hit, pressed);
    if (held?.band) return board.rubber([held.band, [hit.raw[0], held.band[1]], hit.raw, [held.band[0], hit.raw[1]], held.band]);
    if (held?.fixed && hit.moved) return board.say(held.fixed, true);
    if (!held?.pin || !hit.moved) return;
    held.on = true;
    if (board.many) return board.rubber([held.pin.xy, hit.xy]);
    board.drag({ do: "point", place: held.name[1], to: hit.xy, ...(hit.alt ? { along: true } : {}) });
  },
  up(board, hit) {
    const { held } = this;
    if (move.held) return move.up();
    this.held = null;
    board.rubber(null);
    if (held?.band) return board.chooseWithin(held.band, hit.raw);
    if (!held?.on) return;
    const { pin, name: [, own] } = held, what = did.move(pin.name);
    if (board.many) return board.moveChosen([hit.xy[0] - pin.xy[0], hit.xy[1] - pin.xy[1]]);
    if (hit.pin) return board.edit({ do: "join", place: own, to: place(hit.pin), what: did.join });
    return board.edit(() => (board.reached ? { do: "move", place: own, xy: board.reached, grain: board.grain, ...(hit.alt ? { along: true } : {}), what }
      : null));
  },
  stop(board) { const was = this.held; this.held = null; board.rubber(null); if (was?.on) board.drop(); return Boolean(was?.on) || move.stop(board); },
};
const move = {
  key: "h", held: null, icon: "M8 12V5.5a1.5 1.5 0 0 1 3 0V11V4a1.5 1.5 0 0 1 3 0v7V5.5a1.5 1.5 0 0 1 3 0V14c0 4-2.5 6.5-5.5 6.5S7 19 5.5 16L4 13c-.6-1.4 1.2-2.2 2-1z",
  down(board, hit) {
    const body = linkOf(hit);
    this.held = body ? { body, at: board.arm(body, hit.raw) } : null;
    return !body;
  },
  move(board, hit, pressed) { if (pressed && this.held && hit.moved) board.drag({ do: "move", ...this.held, to: hit.raw }); },
  up() { this.held = null; },
  stop(board) { const was = this.held; this.held = null; if (was) board.goHome(); return Boolean(was); },
};
const link = {
  ...two("l", "M5 18 18 6M5 18m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0-5 0M18 6m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0-5 0"), more: [], typed: true,
  move(board, hit) { if (this.from) board.rubber([where(this.from), ...this.more.map(where), where(hit)]); },
  up(board, hit) {
    const { from, more } = this, last = more.at(-1) ?? from;
    if (!from || (this.fresh && !hit.moved) || away(where(last), where(hit)) < board.grain) return;
    if (hit.more && !hit.polar) { more.push(hit); return; } // a further point
    const steps = [], used = [];
    const at = [from, ...more, hit].map((hit) => (hit.pin || hit.body ? { on: anchored(board, hit, steps, used) }
      : { xy: hit.xy, ...(hit.polar ? { polar: hit.polar } : {}) }));
    const goes = !hit.pin && !hit.body;
    this.more = [];
    together(board, [...steps, { do: "link", at, grain: board.grain }], did.link).then((good) => {
      // the chain goes on from its end, unless it ended on what was there
      const end = good && goes && board.lastPin;
      this.from = end && board.tool === "link" ? { pin: end, xy: end.xy } : null;
      board.rubber(null);
    });
  },
  stop(board) { const was = this.from; this.from = null; this.more = []; board.rubber(null); return Boolean(was); },
};
const ground = one("g", "M12 4 6 14h12zM4 14h16M6 18l2-4M11 18l2-4M16 18l2-4", (board, { pin, body, xy }) => {
  if (pin?.ground) return board.edit({ do: "unground", place: place(pin), what: did.unground(pin.name) });
  if (pin) return board.edit({ do: "ground", place: place(pin), grain: board.grain, what: did.ground(pin.name) });
  if (!body) return board.edit({ do: "point", body: "ground", xy, grain: board.grain, what: did.pivot });
  const name = letter(board.state);
  return together(board, [{ do: "point", body, xy, name, grain: board.grain }, { do: "ground", place: `${body}.${name}`, grain: board.grain }],
    did.ground(name));
});
const slider = {
  ...two("s", "M3 17h18M3 7h18M8 9h8v6H8z"),
  up(board, hit) {
    const { from } = this;
    if (!from || (this.fresh && !hit.moved && from.pin)) return;
    this.stop(board);
    if (!from.pin && !from.body) return board.say(WORDS.notAPoint(TOOL_WORDS.slider[1]));
    const angle = away(where(from), where(hit)) > board.grain ? direction(where(from), where(hit)) : 0, other = linkOf(hit);
    if (!from.pin) return board.block(from.body, from.xy, angle);
    const slot = other && !from.pin.places.some((one) => bodyOf(one) === other) ? { body: other, angle: board.lineAngle(other) } : { angle };
    return board.edit({ do: "slider", place: place(from.pin), ...slot, grain: board.grain, what: did.slider(from.pin.name) });
  },
};
const centre = (hit) => (hit.pin ? "" : WORDS.noCentre);
const gear = {
  ...two("w", "M12 12m-6 0a6 6 0 1 0 12 0a6 6 0 1 0-12 0M12 3v3M12 18v3M3 12h3M18 12h3M5.6 5.6l2.1 2.1M16.3 16.3l2.1 2.1M18.4 5.6l-2.1 2.1M7.7 16.3l-2.1 2.1",
    null, centre), radius: 0,
  up(board, hit) {
    const { from } = this, far = from && away(where(from), where(hit));
    if (!from || (this.fresh && !hit.moved)) return;
    if (!hit.pin) { this.radius = far; return board.say(`${TOOL_WORDS.gear[0]}: ${WORDS.length} ${board.number(far)}`); }
    const radius = this.radius && this.radius < far ? this.radius : far / 2;
    this.stop(board);
    this.radius = 0;
    board.add("joint", "gear", { gear: [place(from.pin), place(hit.pin)], radius_i: board.figure(radius), radius_j: board.figure(far - radius) }, did.gear);
  },
};
const cam = two("c", "M12 4c5 0 7 4 6 8s-3 7-6 7-6-3-6-7 1-8 6-8zM12 12m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0-3 0", (board, from, hit) => {
  if (!hit.pin) return board.say(WORDS.noCentre);
  return board.menu.cam(place(from.pin), place(hit.pin), away(from.pin.xy, hit.pin.xy));
}, centre);
/** Between two points, or about a link. */
const between = (key, icon, kind, fields, turning) => {
  const made = two(key, icon, (board, from, hit) => {
    if (owner(from) === owner(hit)) return board.say(WORDS.sameLink, true);
    return board.add("load", kind, { [kind]: [end(from), end(hit)], ...fields(board, away(where(from), where(hit))) }, did[kind]);
  });
  const up = made.up;
  made.up = function (board, hit) {
    const { from } = this;
    if (!from || !this.fresh || hit.moved || from.pin || !from.body) return up.call(this, board, hit);
    this.stop(board);
    return board.add("load", turning[0], { [turning[0]]: from.body, ...turning[1](board) }, did[kind]);
  };
  return made;
};
const units = (board, text) => text.replace(/\b(force|length|torque|time)\b/g, (name) => board.state.units[name]);
const spring = between("k", "M4 20l3-3 1-4 6 3-5-6 6 3-4-6 5 1 4-4", "spring",
  (board, long) => ({ stiffness: units(board, "1 force/length"), free_length: board.figure(long) }),
    ["torsion_spring", (board) => ({ stiffness: units(board, "1 torque/rad"), free_angle: 0 })]);
const damper = between("d", "M3 12h6M9 7v10h8M9 7h8M13 9v6M13 12h8", "damper",
  (board) => ({ coefficient: units(board, "0.1 force*time/length") }), ["torsion_damper", (board) => ({ coefficient: units(board, "0.1 torque*time/rad") })]);
const cylinder = two("y", "M4 20l4-4M8 16l8-8 3 3-8 8zM16 8l4-4", (board, from, hit) => {
  if (owner(from) === owner(hit)) return board.say(WORDS.sameLink, true);
  return board.add("driver", "distance", { distance: [end(from), end(hit)], law: away(where(from), where(hit)) }, did.cylinder);
});
const force = two("f", "M4 20 18 6M18 6h-7M18 6v7", (board, from, hit) => {
  const steps = [], at = anchored(board, from, steps);
  return together(board, [...steps, { do: "force", place: at, force: units(board, "100 force"), angle: direction(where(from), hit.raw) }], did.force(at));
}, (hit) => (hit.pin || hit.body ? "" : WORDS.notAPoint(TOOL_WORDS.force[1])));
const onLink = (key, icon, name, act) => one(key, icon, (board, hit) => {
  const body = linkOf(hit);
  return body ? act(board, body, hit) : board.say(WORDS.notALink(TOOL_WORDS[name][1]));
});
const torque = onLink("t", "M18 8a7 7 0 1 0 1 6M18 8V3M18 8h-5", "torque", (board, body) =>
  board.edit({ do: "torque", body, torque: units(board, "1 torque"), what: did.torque(body) }));
const motor = onLink("m", "M12 12m-8 0a8 8 0 1 1 8 8M12 20l3-3M12 20l3 2.5M12 12m-1.5 0a1.5 1.5 0 1 0 3 0a1.5 1.5 0 1 0-3 0", "motor", (board, body, hit) => {
  const joint = board.slides(hit, body);
  return board.edit({ do: "motor", ...(joint ? { joint } : { body }), what: did.motor(joint ?? body) });
});
const point = onLink("p", "M4 20 20 4M12 12m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0", "point", (board, body, hit) => (hit.pin
  ? board.mass(body) : board.edit({ do: "point", body, xy: hit.xy, grain: board.grain, what: did.point(body) })));
const measure = {
  ...two("e", "M3 17 17 3l4 4L7 21zM7 13l2 2M10 10l3 3M13 7l2 2"),
  up(board, hit) {
    const { from } = this, write = (key, of) => board.edit({ do: "add", path: ["measures"], key, text: { of }, what: did.measure });
    if (!from || (this.fresh && !hit.moved && !from.body)) return;
    this.from = null;
    if (this.fresh && !hit.moved) return write(`angle_${from.body}`, `${from.body}.angle`);
    board.rubber([where(from), where(hit)]);
    if (!from.pin || !hit.pin) return;
    const [a, b] = [from, hit].map((one) => place(one.pin));
    return write(`distance_${from.pin.name}_${hit.pin.name}`, `hypot(${a}.x - ${b}.x, ${a}.y - ${b}.y)`);
  },
};

/** By name, in the order of the bar. */
export const TOOLS = { select, move, link, ground, slider, motor, force, torque, spring, damper, cylinder, gear, cam, point, measure };
for (const [name, tool] of Object.entries(TOOLS)) [tool.name, tool.hint] = TOOL_WORDS[name];
