// Contact with a hardness, from the elastic one: the formulas of mbma_tables/theories/yielding/formulas.py, and its constants.

const CAP = LIMITS.hardness;

function erfc(x) {
  if (x < 2.5) {
    let term = x,
      sum = x;
    for (let n = 1; n < 60; ++n) sum += (term *= -(x * x) / n) / (2 * n + 1);
    return 1 - (2 / Math.sqrt(Math.PI)) * sum;
  }
  let tail = 0;
  for (let n = 60; n > 0; --n) tail = n / 2 / (x + tail);
  return Math.exp(-x * x) / Math.sqrt(Math.PI) / (x + tail);
}
const phi = (d) => Math.exp((-d * d) / 2) / Math.sqrt(2 * Math.PI);
const below = (d) => (d < 0 ? erfc(-d / Math.SQRT2) / 2 : 1 - erfc(d / Math.SQRT2) / 2);

// Newton's method for a function that rises and is convex from `x` down to its root, or concave up to it.
function rootOf(miss, slope, x) {
  for (let k = 0; k < 80; ++k) {
    const step = miss(x) / slope(x);
    x -= step;
    if (!(Math.abs(step) > 1e-14 * Math.abs(x))) break;
  }
  return x;
}
// The level of Gaussian heights at a mean gap, d Φ(d) + φ(d).
const levelOf = (u) => rootOf((d) => d * below(d) + phi(d) - u, below, Math.max(u, 1));
const inverseErf = (share) =>
  rootOf((e) => 1 - share - erfc(e), (e) => (2 / Math.sqrt(Math.PI)) * Math.exp(-e * e), 0);

// A/A0 at F/(A0 E* g) from the elastic one there.
function cappedArea(force, elastic, eta) {
  const x = Math.min(force / eta, 1),
    e = inverseErf(Math.min(elastic, 1 - 1e-12)),
    own = (0.5 * x) / e,
    limit = 0.125 / (CAP.area_scale * Math.sqrt(eta)),
    small = Math.min(own * own, limit);
  const ratio = (small / Math.max(own * own, limit)) ** CAP.area_power,
    joint = (1 + ratio) ** (0.5 / CAP.area_power),
    reach = (own * own < limit ? e : (0.5 * x) / Math.sqrt(limit)) * joint,
    tau = small / joint ** 2;
  let share = 1 - erfc(reach);
  if (tau >= 0.06) {
    share = x;
    for (let n = 1; n < 12; ++n)
      share += ((2 / Math.PI) * Math.sin(n * Math.PI * x) * Math.exp(-((n * Math.PI) ** 2) * tau)) / n;
  } else if (1 / Math.sqrt(tau) - reach < 6) {
    share += erfc(1 / Math.sqrt(tau) - reach) - erfc(1 / Math.sqrt(tau) + reach);
  }
  return Math.min(Math.max(share, x), 1);
}

// Share of heights that bears and its -d/du: that above the level, or what the elastic contact covers without yielding.
function bearing(heights, slope, force, stiffness, eta) {
  const unyielded = -Math.expm1(-2 * eta * eta),
    covered = Math.min(unyielded * (1 - erfc(Math.SQRT2 * force)), 1 - 1e-12),
    coveredSlope = unyielded * Math.sqrt(8 / Math.PI) * Math.exp(-2 * force * force) * stiffness;
  const logOdds = Math.log(heights / (1 - heights)),
    coveredOdds = Math.log(covered / (1 - covered)),
    excess = Math.exp(8 * (coveredOdds - logOdds));
  if (!(excess > 1e-17) || heights === 1) return [heights, slope];
  const joined = Math.max(logOdds, coveredOdds) + Math.log1p(Math.min(excess, 1 / excess)) / 8,
    share = 1 / (1 + Math.exp(-joined)),
    weight = 1 / (1 + excess),
    rate =
      (weight > 0 ? (weight * slope) / (heights * (1 - heights)) : 0) +
      ((1 - weight) * coveredSlope) / (covered * (1 - covered));
  return [share, share * (1 - share) * rate];
}

// Answers at mean separations: force, area, stiffness of loading, and of a small unloading.
function yielding(model, theory, state, h_rms, gradient) {
  const scale = state.E_star * gradient,
    eta = state.hardness / scale,
    whole = below(levelOf(state.h_max / h_rms)),
    elasticAt = separations(model, theory, state.h_max),
    frozen = 1 + CAP.frozen * Math.exp(-eta / CAP.frozen_eta);
  return (u) => {
    const elastic = model[theory](u);
    if (!elastic || !(elastic.force > 0)) return elastic;
    const d = levelOf(u / h_rms),
      own = elastic.force / scale,
      [Q, slope] = bearing(
        (whole - below(d)) / whole,
        phi(d) / below(d) / whole / h_rms,
        own,
        elastic.stiffness / scale,
        eta,
      ),
      level = eta * Q,
      n = CAP.force_light + CAP.force_eta * eta + CAP.force_share * Q;
    const gain = Math.log(Math.max(own, level) / Math.min(own, level)),
      power = Math.exp(-n * gain),
      weight = power / (1 + power),
      lower = Math.log1p(power) / n,
      byElastic = own <= level ? 1 - weight : weight;
    const byLevel = (1 - byElastic) / Q + (CAP.force_share * (lower + weight * gain)) / n,
      force = Math.min(own, level) * Math.exp(-lower),
      rate = (byElastic * elastic.stiffness) / elastic.force + byLevel * slope;
    const same = model[theory](elasticAt(scale * force));
    return {
      force: scale * force,
      area: same ? cappedArea(force, same.area, eta) : NaN,
      stiffness: scale * force * rate,
      unloading: frozen * elastic.stiffness,
    };
  };
}
