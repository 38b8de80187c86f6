// What all parts of the viewer use: elements of a page, numbers for people, ticks of an axis.

const SVG = "http://www.w3.org/2000/svg";
export const TURN = 2 * Math.PI;
export const DEG = Math.PI / 180;
export const MINUS = "−";

export const el = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value !== undefined) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
export const sv = (name, attributes = {}, ...children) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

const power = (digits, exponent) => `${+digits}·10${String(+exponent).replace(/[-0-9]/g, (sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)])}`;
/** A number for people: so many significant digits, a true minus sign. */
export function shown(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size && (size < 1e-3 || size >= 1e7)
    ? power(...value.toExponential(digits - 1).split("e")) : String(+value.toPrecision(digits));
  return text.replaceAll("-", MINUS);
}
/** The greatest of 1, 2, 5, 10, … that is not above a positive value. */
export function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return power * [5, 2, 1].find((digit) => digit * power <= value * (1 + 1e-9));
}
export function ticks(low, high, most) {
  if (!(high > low)) return [low];
  const least = (high - low) / most, below = nice(least);
  const step = [1, 2, 2.5, 5].map((by) => nice(below * by)).find((one) => one >= least * (1 - 1e-9)) ?? 10 * below;
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push(n * step);
  return found;
}
