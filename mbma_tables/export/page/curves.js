// Curves of a state: pressure, area, stiffness and conductance of each theory at common separations or pressures.

const GAPS = 100,
  PRESSURES = 100;
const LIGHTEST = 1e-5,
  HEAVIEST = 1; // pressures drawn, over E* times the rms gradient
// Quantities of the library by the answer of a theory; titles and units are those of their declarations.
const OF_ANSWER = {
  mean_separation: ({ u }) => u,
  pressure: ({ force }) => force,
  area: ({ area }) => area,
  stiffness: ({ stiffness }) => stiffness,
  tangential_stiffness: ({ unloading }, { nu }) =>
    ofCore("mbma_tangential_stiffnesses", unloading, ofCore("mbma_tangential_ratios", nu, LIMITS.isotropic_share)),
  // over a metre in units of the surface, as k_s is
  solid_conductance: ({ unloading }, { k_s, E_star }) =>
    ofCore("mbma_solid_conductances", unloading, k_s, E_star) / (METRE ?? 1),
};
const QUANTITIES = Object.keys(OF_ANSWER);
const NAMES = { mbma: "MBMA", calibrated: "calibrated", persson: "Persson" };

function curvesOf(state) {
  const model = prepare(state),
    { status, h_rms, gradient } = model.moments();
  if (status !== OK)
    return { fault: "no theory can be prepared for this surface: its numbers are too large or too small" };
  const theories = [
    state.theory,
    ...state.beside.filter((name) => name !== state.theory && !(state.samples && name === "mbma")),
  ];
  const scale = state.E_star * gradient,
    byGap = state.against === "gap";
  const x = byGap
    ? Float64Array.from({ length: GAPS - 1 }, (_, k) => (state.h_max * (k + 1)) / GAPS)
    : Float64Array.from(
        { length: PRESSURES },
        (_, k) => scale * LIGHTEST * (HEAVIEST / LIGHTEST) ** (k / (PRESSURES - 1)),
      );
  const yields = Number.isFinite(state.hardness);
  const curves = theories.map((theory) => {
    const at = yields && theory !== "persson" ? yielding(model, theory, state, h_rms, gradient) : model[theory],
      refused = yields && theory === "persson";
    const curve = { theory, ...Object.fromEntries(QUANTITIES.map((name) => [name, new Array(x.length).fill(null)])) };
    curve.silence = [];
    const gapAt = byGap ? (u) => u : separations(model, theory, state.h_max, at);
    x.forEach((value, k) => {
      const u = gapAt(value),
        found = u > 0 && !refused ? at(u) : null;
      if (!found || !Number.isFinite(found.force)) {
        curve.silence[k] = refused ? "with a hardness it is in the Python library" : u > 0 ? model.why() : "it does not reach such a pressure";
        return;
      }
      const answer = { unloading: found.stiffness, ...found, u };
      for (const [name, of] of Object.entries(OF_ANSWER)) curve[name][k] = of(answer, state);
    });
    curve.scatter = scatterOf(state, curve);
    curve.concerns = concernsOf(state, curve, h_rms, gradient);
    return curve;
  });
  return { x, curves, h_rms, gradient };
}

// The mean separation at a pressure, on the branch of first contact; NaN beyond it.
function separations(model, theory, h_max, at = model[theory]) {
  if (theory === "persson") return model.perssonSeparation;
  // ln of depth below h_max and of force: both fall by many decades towards first contact
  const nodes = [];
  for (let k = 1; k <= 60; ++k) {
    const share = k <= 20 ? 10 ** ((k - 20) / 5) * 0.05 : 0.05 + (0.95 * (k - 20)) / 40;
    const depth = h_max * (theory === "mbma" ? share : Math.min(share, 1 - 1e-6)),
      found = at(h_max - depth);
    if (!found || !(found.force > (nodes.at(-1)?.force ?? 0))) break;
    const { force, stiffness } = found;
    // x = ln depth against y = ln force
    nodes.push({ force, x: Math.log(depth), y: Math.log(force), slope: force / (stiffness * depth) });
  }
  return (pressure) => {
    const last = nodes.findIndex(({ force }) => force >= pressure);
    if (last < 0) return NaN;
    let low = last ? nodes[last - 1].x : -Infinity,
      high = nodes[last].x;
    let x = last
      ? cubic(nodes[last - 1], nodes[last], Math.log(pressure))
      : high + nodes[0].slope * Math.log(pressure / nodes[0].force);
    for (let k = 0; k < 60; ++k) {
      if (!(x >= low && x <= high)) x = low > -Infinity ? (low + high) / 2 : high - 1;
      const depth = Math.exp(x),
        { force, stiffness } = at(h_max - depth) ?? { force: NaN };
      const miss = Math.log(force / pressure),
        step = (miss * force) / (stiffness * depth);
      if (miss > 0) high = x;
      else low = x;
      x -= step;
      // Newton's method squares what is missing
      if (Math.abs(miss) < 1e-7) break;
    }
    return h_max - Math.exp(x);
  };
}

// x at y by a cubic through two nodes with slopes dx/dy.
function cubic(p, q, y) {
  const h = q.y - p.y,
    s = (y - p.y) / h,
    d = q.x - p.x,
    a = h * p.slope - d,
    b = d - h * q.slope;
  return p.x + s * d + s * (1 - s) * (a * (1 - s) + b * s);
}

// Reasons why the surface is outside the simulated range, as `theories/tested.py` has them.
function untestedSurface(state, h_rms, theory) {
  if (state.samples) return [];
  const ratio = state.h_max / h_rms,
    zeta_1 = state.q1 / state.q0,
    [narrow, broad] = LIMITS.zeta_1[theory],
    [flat, high_peaks] = LIMITS.heights;
  return [
    [`the Hurst exponent is below ${LIMITS.hurst}`, state.hurst < LIMITS.hurst * (1 - 1e-9)],
    [`the longest wavelength is less than ${narrow} times the shortest`, zeta_1 < narrow * (1 - 1e-9)],
    [`the longest wavelength is more than ${broad} times the shortest`, zeta_1 > broad * (1 + 1e-9)],
    [`h_max/h_rms is outside ${flat} to ${high_peaks}`, ratio < flat || ratio > high_peaks],
  ];
}

// Standard deviations of logarithms, as `Contact.scatter`: by contact fraction, null where not known.
function scatterOf(state, curve) {
  const other = curve.theory === "mbma" && state.variant !== "reported",
    rows = LIMITS.scatter[other ? `mbma_${state.variant}` : curve.theory],
    nodes = LIMITS.log_area,
    [lightest, heaviest] = LIMITS.compared,
    zeta_1 = state.q1 / state.q0,
    [narrow, broad] = LIMITS.zeta_1[other ? `mbma_${state.variant}` : curve.theory],
    alike =
      state.hurst >= LIMITS.hurst * (1 - 1e-9) &&
      zeta_1 >= narrow * (1 - 1e-9) &&
      zeta_1 <= Math.max(broad, LIMITS.broadest) * (1 + 1e-9),
    // beyond the bandwidth of all theories, as `Calibrated.scatter` has it
    doublings = state.samples ? 0 : Math.log2(Math.max(zeta_1 / LIMITS.zeta_1.persson[1], 1)),
    wide = LIMITS.wide_scatter[curve.theory] ?? {};
  const at = (quantity) => (area) => {
    const row = rows[quantity].map((value, k) => [nodes[k], value]).filter(([, value]) => value !== null);
    if ((!state.samples && !alike) || area === null || !row.length || area < lightest || area > heaviest) return null;
    const x = Math.log(area),
      above = row.findIndex(([node]) => node >= x);
    if (above < 0) return rows[quantity].at(-1) === null ? null : Math.exp(row.at(-1)[1]);
    if (above === 0) return Math.exp(row[0][1]);
    const [[x0, y0], [x1, y1]] = [row[above - 1], row[above]];
    return Math.exp(y0 + ((y1 - y0) * (x - x0)) / (x1 - x0));
  };
  const widened = (quantity) => (area) => {
    const stated = at(quantity)(area);
    return stated === null ? null : Math.hypot(stated, (wide[quantity] ?? 0) * Math.sqrt(doublings));
  };
  const known = Number.isFinite(state.hardness) ? () => () => null : widened; // with a hardness the library has it
  return Object.fromEntries(["pressure", "area", "stiffness"].map((name) => [name, curve.area.map(known(name))]));
}

const OF_HARDNESS = "validity and scatter of a contact with a hardness are in the Python library";

// Reasons against a theory's answers, as `Contact.reasons`: each with whether it holds at a point.
function concernsOf(state, curve, h_rms, gradient) {
  const always = (holds) => () => holds,
    [low, high] = LIMITS.area,
    reasons = [];
  reasons.push([
    "the rms gradient is above 1: are heights and wavenumbers in one unit?",
    always(gradient > LIMITS.gradient),
  ]);
  reasons.push([OF_HARDNESS, always(Number.isFinite(state.hardness))]);
  if (state.samples && state.spectrum === FIRST.spectrum)
    DATA.departures.forEach((text) => reasons.push([text, always(true)]));
  if (curve.theory === "mbma") {
    const gap = softening(curve);
    reasons.push([
      `areas of islands are added, A/A0 is above ${LIMITS.mbma_area}`,
      (k) => !DATA.model.variants[state.variant].cover && curve.area[k] > LIMITS.mbma_area,
    ]);
    reasons.push(["stiffness falls with compression here, which no simulation shows", (k) => curve.mean_separation[k] < gap]);
  } else if (curve.theory === "persson") {
    reasons.push(["u is above h_max, where the surface has no contact", (k) => curve.mean_separation[k] > state.h_max]);
  }
  untestedSurface(state, h_rms, curve.theory).forEach(([text, holds]) => reasons.push([text, always(holds)]));
  reasons.push([`A/A0 is below ${low}`, (k) => curve.area[k] > 0 && curve.area[k] < low]);
  reasons.push([`A/A0 is above ${high}`, (k) => curve.area[k] > high]);
  return reasons;
}

// The separation of the first local maximum of stiffness under compression, by the drawn points.
function softening(curve) {
  const points = curve.mean_separation
    .map((gap, k) => [gap, curve.stiffness[k]])
    .filter(([gap]) => gap !== null)
    .sort((a, b) => b[0] - a[0]);
  const peak = points.findIndex(([, stiffness], k) => k + 1 < points.length && stiffness > points[k + 1][1]);
  return peak < 0 ? -Infinity : points[peak][0];
}
