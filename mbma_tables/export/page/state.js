// What the page shows, as numbers and words: read from the address and the controls, checked, written to the address.

const { length: LENGTH, stress: STRESS } = DATA.units;
const OVER_E = STRESS === "1";
const per = (unit) => (unit ? `1/${unit}` : "1/length");
const NUMBERS = {
  hurst: { label: "H, Hurst exponent", unit: "", group: "numbers", low: 0.05, high: 1 },
  q0: { label: "q₀, longest wave", unit: per(LENGTH), group: "numbers", decades: 2 },
  q1: { label: "q₁, shortest wave", unit: per(LENGTH), group: "numbers", decades: 2 },
  h_rms: { label: "h_rms, rms height", unit: LENGTH ?? "length", group: "numbers", decades: 1.5 },
  h_max: { label: "h_max, highest point", unit: LENGTH ?? "length", group: "height", decades: 1 },
  E_star: { label: "E*, effective modulus", unit: OVER_E ? "" : (STRESS ?? "stress"), group: "material", decades: 3 },
  k_s: { label: "k_s, mean conductivity", unit: "", group: "material", decades: 3 },
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
};

// The state that an address asks for, and what is wrong with it.
function stateOf(address) {
  const asked = new URLSearchParams(address.replace(/^#/, "")),
    state = { ...FIRST },
    errors = {};
  for (const [name, text] of asked) {
    if (name in NUMBERS) {
      state[name] = text.trim() === "" ? NaN : Number(text);
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
    if (!Number.isFinite(value)) errors[name] = `${name} must be a number`;
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
    if (!(zeta_1 > least)) errors.q1 = `q₁ must be more than ${least} q₀${which}; q₁/q₀ is ${shown(zeta_1)}`;
    else if (!(zeta_1 <= 1e8)) errors.q1 = `q₁ must be at most 1e8 q₀; q₁/q₀ is ${shown(zeta_1)}`;
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
