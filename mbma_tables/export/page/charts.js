// Pictures by uPlot with one cursor, and the numbers under it.

const STRESS_LABEL = OVER_E ? "E*" : (STRESS ?? "stress"),
  LENGTH_LABEL = LENGTH ?? "length";
// The unit of a quantity, declared beside a "stress" and a "length".
function unitOf(name) {
  if (name === "solid_conductance" && !METRE) return `k_s/${LENGTH_LABEL}`;
  const unit = DATA.quantities[name].unit;
  return unit === "1" ? "" : unit.replace("stress", STRESS_LABEL).replace("length", LENGTH_LABEL);
}
const UNITS = Object.fromEntries(QUANTITIES.map((name) => [name, unitOf(name)]));
const titleOf = (name) => name.replaceAll("_", " ");
const withUnit = (name) => titleOf(name) + (UNITS[name] ? `  [${UNITS[name]}]` : "");
const abscissaOf = (state) => (state.against === "gap" ? "mean_separation" : "pressure");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const charts = new Map();
let drawn = null,
  cursor = null; // the curves in the pictures; the place under the cursor

// What has the scatter of a logarithm, by the uncertainty of a declaration; others follow the stiffness.
const OF_UNCERTAINTY = { scatter: "pressure", separation_scatter: "pressure", area_scatter: "area" };

// One standard deviation to either side of a quantity, where its scatter is stated: of the pressure at equal separation,
// of the rest at equal pressure.
function band(state, curve, name) {
  const byGap = state.against === "gap",
    scatter = curve.scatter[OF_UNCERTAINTY[DATA.quantities[name].uncertainty] ?? "stiffness"];
  if (byGap !== (name === "pressure")) return null;
  const side = (sign) =>
    curve[name].map((value, k) => {
      if (value === null || scatter[k] === null) return null;
      // a separation differs by what the pressure does over the stiffness
      return name === "mean_separation"
        ? Math.max(value + (sign * scatter[k] * curve.pressure[k]) / curve.stiffness[k], 0)
        : value * Math.exp(sign * scatter[k]);
    });
  return [side(1), side(-1)];
}

// The range of a quantity: seven decades at most, or from zero.
function rangeOf(log) {
  return (_, low, high) => {
    if (low === null || !(high > 0)) return [log ? 0.1 : 0, 1];
    return log ? [Math.max(low, high * 1e-7) / 1.2, high * 1.2] : [0, high * 1.05];
  };
}

function chartFor(name, state, theories, hasBand) {
  const log = state.log === "yes" && name !== "mean_separation",
    logX = state.against === "pressure";
  const axis = (label, logarithmic) => ({
    label,
    stroke: () => colour("fg"),
    grid: { stroke: () => colour("line"), width: 1 },
    ticks: { stroke: () => colour("line") },
    labelSize: 22,
    size: label ? 42 : 62,
    values: tickTexts,
    ...(logarithmic ? { splits: decades, filter: (_, splits) => splits } : {}),
  });
  const element = document.createElement("div");
  element.className = "chart";
  element.tabIndex = 0;
  element.setAttribute("role", "img");
  document.getElementById("charts").append(element);
  const side = { stroke: "transparent", pxAlign: 0, points: { show: false } },
    bandSeries = hasBand ? [side, { ...side }] : [];
  const chart = new uPlot(
    {
      title: withUnit(name),
      width: Math.max(element.clientWidth, 200),
      height: 260,
      cursor: { sync: { key: "mbma" }, y: false, points: { size: 6 } },
      scales: {
        x: { time: false, distr: logX ? 3 : 1, range: (_, low, high) => [low ?? 0.1, high ?? 1] },
        y: { distr: log ? 3 : 1, range: rangeOf(log) },
      },
      axes: [axis(withUnit(logX ? "pressure" : "mean_separation"), logX), axis("", log)],
      series: [
        {},
        ...theories.map((theory, k) => ({
          label: NAMES[theory],
          stroke: () => colour(theory),
          width: k ? 1.5 : 2.5,
          pxAlign: 0,
          dash: k ? [6, 4] : undefined,
          points: { show: false },
        })),
        ...bandSeries,
      ],
      bands: hasBand
        ? [{ series: [theories.length + 1, theories.length + 2], fill: () => `${colour(theories[0])}33` }]
        : [],
      hooks: { setCursor: [(own) => own.cursor.idx !== null && own.cursor.idx !== undefined && read(own.cursor.idx)] },
    },
    null,
    element,
  );
  const place = (k) => chart.setCursor({ left: chart.valToPos(drawn.x[k], "x"), top: 10 });
  element.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10, Home: -Infinity, End: Infinity },
      step = steps[event.key];
    if (step === undefined || !drawn) return;
    event.preventDefault();
    place(Math.min(Math.max((cursor ?? 0) + step, 0), drawn.x.length - 1));
  });
  chart.over.addEventListener(
    "touchmove",
    (event) => {
      const box = chart.over.getBoundingClientRect();
      chart.setCursor({ left: event.touches[0].clientX - box.left, top: 10 });
    },
    { passive: true },
  );
  return { chart, element };
}

// Powers of ten inside an axis, with 2 and 5 times these where they are few.
function decades(own, axis, low, high) {
  const first = Math.floor(Math.log10(low)),
    count = Math.ceil(Math.log10(high)) - first + 1;
  const places = (digits) =>
    Array.from({ length: count }, (_, k) => digits.map((digit) => Number(`${digit}e${first + k}`)))
      .flat()
      .filter((value) => value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9));
  return places([1]).length < 3 ? places([1, 2, 5]) : places([1]);
}

function tickTexts(own, splits) {
  return splits.map((value) => (value === null ? "" : shown(value, 3).replace(/\.?0*e/, "e")));
}

// Draws the curves; pictures are made anew where their series or scales are others.
function draw(state, found) {
  drawn = found;
  const theories = found.curves.map(({ theory }) => theory);
  const names = QUANTITIES.filter((name) => name !== abscissaOf(state));
  for (const [name, { chart, element }] of charts) {
    if (!names.includes(name)) {
      chart.destroy();
      element.remove();
      charts.delete(name);
    }
  }
  for (const name of names) {
    const sides = band(state, found.curves[0], name),
      key = [state.against, state.log, sides !== null, ...theories].join();
    let own = charts.get(name);
    if (own?.key !== key) {
      own?.chart.destroy();
      own?.element.remove();
      own = { key, ...chartFor(name, state, theories, sides !== null) };
      charts.set(name, own);
    }
    own.element.setAttribute(
      "aria-label",
      `${withUnit(name)}: ${theories.map((theory) => NAMES[theory]).join(", ")}; arrow keys move the cursor`,
    );
    own.chart.setData([found.x, ...found.curves.map((curve) => curve[name]), ...(sides ?? [])]);
  }
  // in one order, whichever was made last; what moves in a page loses focus and place
  const elements = names.map((name) => charts.get(name).element),
    place = document.getElementById("charts");
  if (elements.some((element, k) => place.children[k] !== element)) place.append(...elements);
  read(Math.min(cursor ?? Math.floor(found.x.length / 2), found.x.length - 1));
}

// Shows the numbers at a point of the curves.
function read(k) {
  cursor = k;
  const byGap = drawn.state.against === "gap",
    names = QUANTITIES.filter((name) => name !== abscissaOf(drawn.state));
  const cell = (kind, text, title) =>
    Object.assign(document.createElement(kind), { textContent: text, title: title ?? "" });
  const row = (...cells) => {
    const made = document.createElement("tr");
    made.append(...cells);
    return made;
  };
  const head = row(
    cell("th", `${byGap ? "u" : "p"} = ${shown(drawn.x[k], 5)} ${UNITS[abscissaOf(drawn.state)]}`),
    ...names.map((name) => cell("th", withUnit(name), DATA.quantities[name].meaning)),
    cell("th", "valid"),
  );
  const rows = drawn.curves.map((curve) => {
    const against =
      curve.area[k] === null
        ? [`has no answer here: ${curve.silence[k]}`]
        : curve.concerns.filter(([, holds]) => holds(k)).map(([text]) => text);
    const texts = names.map((name) => {
      const sides = curve === drawn.curves[0] ? band(drawn.state, curve, name) : null;
      const scatter = sides?.[0][k]
        ? ` ± ${shown(name === "mean_separation" ? sides[0][k] - curve.mean_separation[k] : 100 * Math.log(sides[0][k] / curve[name][k]), 2)}${name === "mean_separation" ? "" : "%"}`
        : "";
      return cell("td", shown(curve[name][k], 5) + scatter);
    });
    const name = cell("th", NAMES[curve.theory]);
    name.style.borderLeft = `0.6rem solid var(--${curve.theory})`;
    // the page does not judge contacts with a hardness
    const judged = against.some((text) => text !== OF_HARDNESS);
    const valid = judged ? "no" : against.length ? "not known" : "yes";
    const made = row(name, ...texts, cell("td", valid, against.join("; ")));
    made.dataset.theory = curve.theory;
    made.dataset.against = against.join("; ");
    return made;
  });
  const [top, body] = [document.createElement("thead"), document.createElement("tbody")];
  top.append(head);
  body.append(...rows);
  document.getElementById("readout").replaceChildren(top, body);
  document.getElementById("concerns").textContent = rows
    .filter(({ dataset }) => dataset.against)
    .map(({ dataset }) => `${NAMES[dataset.theory]}: ${dataset.against}.`)
    .join(" ");
}

new ResizeObserver(() => {
  for (const { chart, element } of charts.values()) {
    if (element.clientWidth && element.clientWidth !== chart.width)
      chart.setSize({ width: element.clientWidth, height: chart.height });
  }
}).observe(document.getElementById("charts"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
  charts.forEach(({ chart }) => chart.redraw()),
);
