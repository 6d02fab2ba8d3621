// Files: the drawn curves as CSV, and the chosen theory's law as C.

const LAW_RTOL = 1e-8,
  LAW_TANGENT = 1e-6,
  LAW_DEGREE = 11,
  LAW_MAX_PIECES = 400;
const LAW_FROM = 1e-4,
  LAW_TO = 0.99; // overclosure over h_max

// What a file is of, one fact a line.
function factsOf(state) {
  const surface = state.samples
    ? [
        `surface: a spectrum of ${state.samples.q.length} samples from q = ${state.samples.q[0]} to ${state.samples.q.at(-1)}, h_max = ${state.h_max}`,
      ]
    : [
        `surface: hurst = ${state.hurst}, q0 = ${state.q0}, q1 = ${state.q1}, h_rms = ${state.h_rms}, h_max = ${state.h_max}`,
      ];
  return [
    `mbma_tables ${DATA.version}, page of mbma explore: ${DATA.title}`,
    ...surface,
    `E* = ${state.E_star}, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; k_s = ${state.k_s}; ${Number.isFinite(state.hardness) ? `hardness ${state.hardness}` : "elastic"}; nu = ${state.nu}`,
    `lengths in ${LENGTH ?? "the unit of the surface"}, stresses ${OVER_E ? "over E*" : `in ${STRESS ?? "the unit of E*"}`}; u is the mean separation of the mean planes, first contact at h_max`,
    `theory ${state.theory}${state.theory === "mbma" ? `, variant ${state.variant}` : ""}`,
    `state ${addressOf(state)}`,
    "scatter: standard deviation of the logarithm from simulation to simulation, of the force at equal u, else at equal pressure; it is no numerical error",
  ].map((line) => line.replace(/[\r\n]+/g, " "));
}

function csvOf(state, { x, curves }) {
  const cell = (text) => (/[",]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const columns = curves.flatMap((curve) => [
    ...QUANTITIES.map((name) => [`${curve.theory} ${name}${UNITS[name] ? ` [${UNITS[name]}]` : ""}`, curve[name]]),
    ...Object.entries(curve.scatter).map(([name, values]) => [`${curve.theory} scatter of ln ${name}`, values]),
  ]);
  const head = columns.map(([name]) => cell(name)).join(",");
  const rows = Array.from(x, (_, k) => columns.map(([, values]) => values[k] ?? "").join(","));
  return [...factsOf(state).map((line) => `# ${line}`), head, ...rows, ""].join("\n");
}

// Chebyshev nodes in [-1, 1], and the coefficients of powers of t through values at them.
const LAW_NODES = Array.from({ length: LAW_DEGREE + 1 }, (_, k) => Math.cos((Math.PI * (k + 0.5)) / (LAW_DEGREE + 1)));
function powersOf(values) {
  const count = LAW_NODES.length,
    result = new Array(count).fill(0);
  let before = [1],
    own = [0, 1]; // T_0 and T_1 by powers
  for (let n = 0; n < count; ++n) {
    const weight =
      values.reduce((sum, value, k) => sum + value * Math.cos((n * Math.PI * (k + 0.5)) / count), 0) *
      ((n ? 2 : 1) / count);
    before.forEach((coefficient, power) => (result[power] += weight * coefficient));
    const next = [0, ...own.map((coefficient) => 2 * coefficient)];
    before.forEach((coefficient, power) => (next[power] -= coefficient));
    [before, own] = [own, next];
  }
  return result;
}
const atPowers = (powers, t) => powers.reduceRight((sum, coefficient) => sum * t + coefficient, 0);

// Polynomials of ln p and ln A over ln c, c = h_max - u the overclosure, or over c where pressure has no end at h_max:
// pieces are halved until they are near enough.
function piecesOf(state) {
  const model = prepare(state),
    pieces = [],
    largest = { pressure: 0, area: 0, tangent: 0 };
  const endless = state.theory === "persson",
    [to, from] = endless ? [(c) => c, (x) => x] : [Math.log, Math.exp];
  const at = (x) => model[state.theory](state.h_max - from(x));
  const pending = [[to(LAW_FROM * state.h_max), to(LAW_TO * state.h_max)]];
  while (pending.length) {
    const [low, high] = pending.pop(),
      middle = (low + high) / 2,
      half = (high - low) / 2;
    const found = LAW_NODES.map((t) => at(middle + half * t));
    if (!found.every((value) => value && value.force > 0)) throw new Error("the theory has no answer down to there");
    const pressure = powersOf(found.map(({ force }) => Math.log(force))),
      area = powersOf(found.map((value) => Math.log(value.area)));
    const errors = { pressure: 0, area: 0, tangent: 0 };
    for (let k = 0; k < 9; ++k) {
      const t = -1 + (2 * k) / 8,
        x = middle + half * t,
        known = at(x),
        scale = endless ? 1 : from(x);
      const powers = pressure.map((coefficient, n) => n * coefficient).slice(1),
        p = Math.exp(atPowers(pressure, t));
      errors.pressure = Math.max(errors.pressure, Math.abs(p / known.force - 1));
      errors.area = Math.max(errors.area, Math.abs(Math.exp(atPowers(area, t)) / known.area - 1));
      errors.tangent = Math.max(
        errors.tangent,
        Math.abs((p * atPowers(powers, t)) / (half * scale * known.stiffness) - 1),
      );
    }
    const near = errors.pressure <= LAW_RTOL && errors.area <= LAW_RTOL && errors.tangent <= LAW_TANGENT;
    if (!near && half > 1e-4 * (endless ? state.h_max : 1) && pieces.length + pending.length < LAW_MAX_PIECES) {
      pending.push([middle, high], [low, middle]);
      continue;
    }
    for (const name of Object.keys(errors)) largest[name] = Math.max(largest[name], errors[name]);
    pieces.push({ middle, half, high, pressure, area });
  }
  return { pieces, largest, endless };
}

// What writes the same law in the library, under the same names.
function commandOf(state) {
  const numbers = ["hurst", "q0", "q1", "h_rms", "h_max", "E_star"].map(
    (name) => `--${name.replace("_", "-")} ${state[name]}`,
  );
  const units = `${LENGTH ? ` --length-unit ${LENGTH}` : ""}${STRESS && !OVER_E ? ` --stress-unit ${STRESS}` : ""}`;
  return state.samples
    ? "mbma_tables.export.code.law_code.law_text of Surface.from_spectrum(q, C, h_max)"
    : `mbma export c-law ${numbers.join(" ")}${Number.isFinite(state.hardness) ? ` --hardness ${state.hardness}` : ""}${units} --theory ${state.theory}${state.theory === "mbma" ? ` --variant ${state.variant}` : ""} --out law.c`;
}

function lawOf(state) {
  if (Number.isFinite(state.hardness)) throw new Error(`with a hardness the library writes it: ${commandOf(state)}`);
  const { pieces, largest, endless } = piecesOf(state),
    count = pieces.length,
    terms = LAW_DEGREE + 1;
  const rows = (name) => pieces.map((piece) => `    {${piece[name].join(", ")}},`).join("\n");
  const facts = [
    ...factsOf(state),
    `largest relative errors against the theory at nine points of each piece: pressure ${largest.pressure.toExponential(1)}, area ${largest.area.toExponential(1)}, tangent ${largest.tangent.toExponential(1)}`,
    `range: overclosures c = h_max - u from ${LAW_FROM} to ${LAW_TO} of h_max; ${endless ? "c <= 0 is not contact, though this theory has a force there" : "no contact up to c = 0"}; elsewhere the answer is NaN`,
    "pressure, tangent dp/dc and area A/A0 against overclosure c; compile with cc -std=c99 -O2 -c, link with -lm",
    `the library's own, nearer to it, with energy and the overclosure at a pressure: ${commandOf(state)}`,
  ];
  const ascii = (line) =>
    line
      .replace(/\*\//g, "* /")
      .replace(/[^\x20-\x7e]/g, (letter) => `\\u${letter.charCodeAt(0).toString(16).padStart(4, "0")}`);
  return `/*
${facts.map((line) => ` * ${ascii(line)}`).join("\n")}
 */
#include <math.h>

double law_pressure(double c);
double law_tangent(double c);
double law_with_tangent(double c, double *tangent); /* pressure and tangent in one pass */
double law_area(double c);

enum { PIECES = ${count}, TERMS = ${terms} };

/* Pieces in ${endless ? "c" : "ln c"}: upper end, middle, half width; then powers of ln p and of ln(A/A0). */
static const double PLACES[PIECES][3] = {
${pieces.map(({ high, middle, half }) => `    {${high}, ${middle}, ${half}},`).join("\n")}
};
static const double PRESSURE[PIECES][TERMS] = {
${rows("pressure")}
};
static const double AREA[PIECES][TERMS] = {
${rows("area")}
};

/* Piece of an overclosure and the place in it; -1 outside of the range. */
static int place(double c, double *t) {
    const double x = ${endless ? "c" : "c > 0.0 ? log(c) : -INFINITY"};
    int k = 0;
    if (!(x >= PLACES[0][1] - PLACES[0][2] && x <= PLACES[PIECES - 1][0])) {
        return -1;
    }
    while (k < PIECES - 1 && x > PLACES[k][0]) {
        ++k;
    }
    *t = (x - PLACES[k][1]) / PLACES[k][2];
    return k;
}

/* exp of a polynomial, and its derivative by c. */
static double quantity(const double powers[PIECES][TERMS], double c, double *slope) {
    double t = 0.0, value = 0.0, rate = 0.0;
    const int k = place(c, &t);
    *slope = k < 0 && !(c <= 0.0) ? NAN : 0.0;
    if (k < 0) {
        return *slope;
    }
    for (int n = TERMS - 1; n >= 0; --n) {
        rate = rate * t + value;
        value = value * t + powers[k][n];
    }
    value = exp(value);
    *slope = value * rate / ${endless ? "PLACES[k][2]" : "(PLACES[k][2] * c)"};
    return value;
}

double law_with_tangent(double c, double *tangent) { return quantity(PRESSURE, c, tangent); }

double law_pressure(double c) {
    double slope;
    return quantity(PRESSURE, c, &slope);
}

double law_tangent(double c) {
    double slope;
    quantity(PRESSURE, c, &slope);
    return slope;
}

double law_area(double c) {
    double slope;
    return quantity(AREA, c, &slope);
}
`;
}

function save(name, text, type) {
  const address = URL.createObjectURL(new Blob([text], { type }));
  Object.assign(document.createElement("a"), { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
