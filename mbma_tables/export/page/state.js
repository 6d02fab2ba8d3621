// What the page shows, as numbers and words: read from the address and the controls, checked, written to the address.

const { length: LENGTH, stress: STRESS, metre: METRE } = DATA.units;
const OVER_E = STRESS === "1";
const NUMBERS = {
  hurst: { label: "H, Hurst exponent", unit: "", group: "numbers", low: 0.05, high: 1 },
  // wavenumbers, shown as wavelengths 2π/q
  q0: { label: "longest wavelength, 2π/q₀", unit: LENGTH ?? "length", group: "numbers", decades: 2, wave: true },
  q1: { label: "shortest wavelength, 2π/q₁", unit: LENGTH ?? "length", group: "numbers", decades: 2, wave: true },
  h_rms: { label: "h_rms, rms height", unit: LENGTH ?? "length", group: "numbers", decades: 1.5 },
  h_max: { label: "h_max, highest point", unit: LENGTH ?? "length", group: "height", decades: 1 },
  E_star: { label: "E*, effective modulus", unit: OVER_E ? "" : (STRESS ?? "stress"), group: "material", decades: 3 },
  hardness: { label: "hardness, empty: elastic", unit: OVER_E ? "E*" : (STRESS ?? "stress"), group: "material", decades: 2 },
  k_s: { label: "k_s, mean conductivity", unit: METRE ? "W/(m K)" : "", group: "material", decades: 3 },
  nu: { label: "ν, Poisson's ratio", unit: "", group: "material", low: 0, high: 0.5 },
};
const WORDS = {
  theory: ["mbma", "calibrated", "persson"],
  variant: Object.keys(DATA.model.variants),
  against: ["gap", "pressure"],
  log: ["yes", "no"],
  convention: ["paper", "isotropic"],
};
const FIRST = {
  against: "gap",
  log: "yes",
  beside: ["calibrated", "persson"],
  spectrum: "",
  convention: "paper",
  ...DATA.start,
  hardness: DATA.start.hardness ?? Infinity,
};
const none = (name) => (name === "hardness" ? Infinity : NaN);

// The state that an address asks for, and what is wrong with it.
function stateOf(address) {
  const asked = new URLSearchParams(address.replace(/^#/, "")),
    state = { ...FIRST },
    errors = {};
  for (const [name, text] of asked) {
    if (name in NUMBERS) {
      state[name] = text.trim() === "" ? none(name) : Number(text);
    } else if (name in WORDS) {
      if (WORDS[name].includes(text)) state[name] = text;
      else errors.theory = `${name} must be one of ${WORDS[name].join(", ")}; the address has ${text}`;
    } else if (name === "beside") {
      state.beside = text.split(",").filter((theory) => WORDS.theory.includes(theory));
    } else if (name === "spectrum") {
      state.spectrum = text.replaceAll(";", "\n");
    } else {
      errors.theory = `the address has ${name}, which is nothing here`;
    }
  }
  return { state, errors };
}

// The address of a state: what differs from the page's first one.
function addressOf(state) {
  const parts = new URLSearchParams();
  for (const [name, value] of Object.entries(state)) {
    if (name === "samples" || String(value) === String(FIRST[name])) continue;
    parts.set(name, name === "spectrum" ? value.trim().replace(/\s*\n\s*/g, ";") : String(value));
  }
  return `#${parts}`;
}

// Columns of a pasted spectrum, with its fault in words; C as the paper has it.
function samplesOf(text, convention) {
  const q = [],
    C = [],
    unit = convention === "isotropic" ? 1 / (4 * Math.PI ** 2) : 1;
  for (const [k, line] of text.split("\n").entries()) {
    const row = line.replace(/#.*/, "").trim();
    if (row === "") continue;
    const numbers = row.split(/[\s,]+/).map(Number),
      where = `line ${k + 1}, “${row.slice(0, 40)}”`;
    if (numbers.length !== 2 || !numbers.every(Number.isFinite))
      return { fault: `${where}: two numbers are needed, q and C` };
    if (!(numbers[0] > 0)) return { fault: `${where}: q must be positive; leave q = 0 out` };
    if (!(numbers[0] >= (q.at(-1) ?? 0))) return { fault: `${where}: q must rise from line to line` };
    if (!(numbers[1] >= 0)) return { fault: `${where}: C must not be negative` };
    q.push(numbers[0]);
    C.push(unit * numbers[1]);
  }
  if (q.length > LIMITS.max_samples)
    return { fault: `${q.length} lines are given, ${LIMITS.max_samples} is the most here: thin them out` };
  const held = q.filter((value, k) => C[k] > 0);
  if (!(held.at(-1) > 3 * held[0])) return { fault: "wavenumbers of positive C must span more than a factor 3" };
  return { q, C };
}

// Faults of a state by control, in words.
function faultsOf(state) {
  const errors = {},
    floor = Math.max(3, DATA.model.variants[state.variant].numbers[4]); // of zeta_u
  for (const name of Object.keys(NUMBERS)) {
    const value = state[name];
    if (name === "hardness" && value === Infinity) continue;
    if (name === "nu" && value > -1 && value <= 0.5) continue;
    if (!Number.isFinite(value)) errors[name] = `${name} must be a number`;
    else if (name === "nu") errors[name] = `nu must be in (-1, 0.5], got ${value}`;
    else if (!(value > 1e-300 && value < 1e300)) errors[name] = `${name} must be positive, got ${value}`;
  }
  if (state.spectrum !== "") {
    for (const name of ["hurst", "q0", "q1", "h_rms"]) delete errors[name];
    const samples = samplesOf(state.spectrum, state.convention);
    if (samples.fault) errors.spectrum = samples.fault;
    else state.samples = samples;
    if (state.theory === "mbma") {
      errors.theory =
        "MBMA here needs five numbers: of a spectrum take the calibrated law or Persson's theory, or the Python library";
    }
    return errors;
  }
  if (!errors.hurst && state.hurst > 1) errors.hurst = `H must be in (0, 1], got ${state.hurst}`;
  if (!errors.q0 && !errors.q1) {
    const zeta_1 = state.q1 / state.q0,
      mbma = state.theory === "mbma" || state.beside.includes("mbma"),
      least = mbma ? floor : 3;
    const which = least > 3 ? `, as variant ${state.variant} needs` : "";
    if (!(zeta_1 > least)) errors.q1 = `longest must be more than ${least} times shortest${which}, it is ${shown(zeta_1)} times`;
    else if (!(zeta_1 <= 1e8)) errors.q1 = `longest must be at most 1e8 times shortest, it is ${shown(zeta_1)} times`;
  }
  return errors;
}

function shown(value, digits = 4) {
  if (value === null || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5)
    ? value.toExponential(digits - 1)
    : String(Number(value.toPrecision(digits)));
}
