// Contact with a hardness, from the elastic one: calls of yielding.c in the module, one entry each.

// the law's constants, then the arguments and results of the calls
const HARDNESS_LAW = YIELDING;
numbersAt(HARDNESS_LAW, LIMITS.hardness.length).set(LIMITS.hardness);
const ENTRIES = ["u", "last", "force", "stiffness", "eta", "capped", "steep", "area", "covered", "frozen"];
const PLACES = Object.fromEntries(
  ENTRIES.map((name, k) => [name, HARDNESS_LAW + 8 * (LIMITS.hardness.length + k)]),
);
const put = (numbers) => Object.entries(numbers).forEach(([name, x]) => (numbersAt(PLACES[name], 1)[0] = x));
const get = (name) => numbersAt(PLACES[name], 1)[0];

// Answers at mean separations: force, area, stiffness of loading, and of a small unloading.
function yielding(model, theory, state, h_rms, gradient) {
  const scale = state.E_star * gradient,
    { u, last, force, stiffness, eta, capped, steep, area, covered, frozen } = PLACES,
    elasticAt = separations(model, theory, state.h_max);
  put({ last: state.h_max / h_rms, eta: state.hardness / scale });
  return (gap) => {
    const elastic = model[theory](gap);
    if (!elastic || !(elastic.force > 0)) return elastic;
    put({ u: gap / h_rms, force: elastic.force / scale, stiffness: (elastic.stiffness * h_rms) / scale });
    C.mbma_yielding_at_gaps(1, force, stiffness, u, last, eta, HARDNESS_LAW, capped, steep);
    C.mbma_frozen_factors(1, eta, HARDNESS_LAW, frozen);
    const same = model[theory](elasticAt(scale * get("capped")));
    put({ area: same ? same.area : NaN });
    C.mbma_yielding_areas(1, capped, area, eta, HARDNESS_LAW, 0, covered);
    return {
      force: scale * get("capped"),
      area: get("covered"),
      stiffness: (scale / h_rms) * get("steep"),
      unloading: get("frozen") * elastic.stiffness,
    };
  };
}
