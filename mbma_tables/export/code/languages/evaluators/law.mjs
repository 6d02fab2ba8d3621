// Quantities of a law as functions of overclosure, by the library's C, core/law.c, as WebAssembly.
const [FORCE, AREA, STIFFNESS, ENERGY, CURVATURE] = [0, 1, 2, 4, 5]; // of its mbma_quantity

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** The functions of the C, from the text of its module. */
function compiled(text) {
  const functions = new WebAssembly.Instance(new WebAssembly.Module(bytes(text))).exports;
  functions._initialize();
  return functions;
}

/** The numbers of a law in the module's memory; before them its mbma_law and room for a number. */
function opened(C, text) {
  const block = bytes(text), at = 65536 * C.memory.grow(Math.ceil((block.length + 64) / 65536));
  new Uint8Array(C.memory.buffer, at + 64, block.length).set(block);
  C.mbma_law_open(at, at + 64, block.length / 8);
  return at;
}

function check(name, value, low, high, unit) {
  if (typeof value !== "number" || Number.isNaN(value)) throw new TypeError(`${name} must be a number`);
  if (value < low || value > high) throw new RangeError(`${name} must be in [${low}, ${high}] ${unit}, got ${value}`);
}

/** A quantity of a law's own, by its number. */
function ask(C, law, quantity, c) {
  check("overclosure", c, law.c_least, law.c_most, law.length);
  return C.mbma_law_at_overclosure(law.at, quantity, c);
}

/** Pressure and tangent in one pass. */
function both(C, law, c) {
  check("overclosure", c, law.c_least, law.c_most, law.length);
  const value = C.mbma_law_and_slope(law.at, FORCE, c, law.at + 32);
  return [value, new DataView(C.memory.buffer).getFloat64(law.at + 32, true)];
}

/** The tangent's derivative; a power of c may overflow where c is no normal number. */
function bend(C, law, c) {
  return ask(C, law, CURVATURE, c > 0 && c < 2.3e-308 ? 2.3e-308 : c);
}

/** A quantity with polynomials of its own. */
function along(C, law, curve, c) {
  check("overclosure", c, law.c_least, law.c_most, law.length);
  if (curve.h_rms > 0) {
    const flow = C.mbma_law_flow(curve.at, law.h_max, curve.h_rms, law.h_max - 2 * c, 0);
    return !(flow <= 0) ? flow : c >= curve.unknown_from ? NaN : 0; // blocked
  }
  if (c > curve.end) return NaN;
  if (c < curve.begin) return curve.apart + curve.far / (law.h_max - c + curve.jump); // bodies are apart
  // one that begins at first contact keeps its digits there
  if (curve.from_contact) return C.mbma_law_at_overclosure(curve.at, FORCE, c) - curve.offset;
  return C.mbma_law_flow(curve.at, law.h_max, 1, law.h_max - 2 * c, 0) - curve.offset;
}

/** Where pressure is p, on the branch of first contact. */
function inverse(C, law, p) {
  check("pressure", p, ask(C, law, FORCE, law.first), ask(C, law, FORCE, law.c_turn), law.stress);
  return C.mbma_law_overclosure(law.at, FORCE, p, law.first, law.c_turn);
}
