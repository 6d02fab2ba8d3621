// Controls, and what follows when one of them is moved.

const form = document.getElementById("controls"),
  by = (id) => document.getElementById(id);
let { state, errors: addressErrors } = stateOf(location.hash);
let writing = null; // of the address, a moment after the last change

// A number by a field and a slider: linear from low to high, or logarithmic about the first value.
for (const [name, { label, unit, group, low, high, decades, wave }] of Object.entries(NUMBERS)) {
  const own = (value) => (wave ? (2 * Math.PI) / value : value), // of the state or of the field
    row = document.createElement("div"),
    centre = Math.log10(own(Number.isFinite(FIRST[name]) ? FIRST[name] : FIRST.E_star / 50));
  row.className = "number";
  const field = Object.assign(document.createElement("input"), {
    id: name,
    type: "text",
    inputMode: "decimal",
    spellcheck: false,
  });
  const slider = Object.assign(document.createElement("input"), {
    id: `slide-${name}`,
    type: "range",
    min: 0,
    max: 1000,
    step: 1,
  });
  const fault = Object.assign(document.createElement("p"), { id: `error-${name}`, className: "error" });
  const text = Object.assign(document.createElement("label"), {
    htmlFor: name,
    textContent: unit ? `${label} [${unit}]` : label,
  });
  fault.setAttribute("role", "alert");
  field.setAttribute("aria-describedby", fault.id);
  slider.setAttribute("aria-label", label);
  row.append(text, field, slider, fault);
  by(group).append(row);
  const toValue = (place) =>
    decades ? 10 ** (centre + decades * (place / 500 - 1)) : low + ((high - low) * place) / 1000;
  slider.addEventListener("input", () => {
    const value = Number(toValue(slider.valueAsNumber).toPrecision(6));
    state[name] = own(value);
    field.value = value;
    update();
  });
  field.addEventListener("input", () => {
    state[name] = field.value.trim() === "" ? none(name) : own(Number(field.value));
    placeSlider();
    update();
  });
  function placeSlider() {
    const place = decades
      ? 500 * ((Math.log10(own(state[name])) - centre) / decades + 1)
      : (1000 * (state[name] - low)) / (high - low);
    if (Number.isFinite(place)) slider.value = Math.round(place);
    slider.setAttribute("aria-valuetext", shown(own(state[name])));
  }
  NUMBERS[name].show = () => {
    field.value = Number.isFinite(state[name]) ? Number(own(state[name]).toPrecision(15)) : "";
    placeSlider();
  };
}
for (const name of WORDS.variant) by("variant").append(new Option(name));
for (const name of ["theory", "variant", "against", "convention"]) {
  by(name).addEventListener("change", () => {
    state[name] = by(name).value;
    update();
  });
}
by("log").addEventListener("change", () => {
  state.log = by("log").checked ? "yes" : "no";
  update();
});
for (const box of form.elements.beside) {
  box.addEventListener("change", () => {
    state.beside = [...form.elements.beside].filter(({ checked }) => checked).map(({ value }) => value);
    update();
  });
}
by("spectrum").addEventListener("input", () => {
  state.spectrum = by("spectrum").value.trim();
  update();
});
for (const button of form.elements.source) {
  button.addEventListener("change", () => {
    const pasted = form.elements.source.value === "spectrum";
    state.spectrum = pasted ? by("spectrum").value.trim() : "";
    // MBMA is of five numbers here
    if (pasted && state.theory === "mbma") by("theory").value = state.theory = "calibrated";
    showSource();
    update();
  });
}
function showSource() {
  const pasted = form.elements.source.value === "spectrum";
  by("pasted").hidden = !pasted;
  by("numbers").hidden = pasted;
}

// The controls as the state has them.
function show() {
  for (const { show: own } of Object.values(NUMBERS)) own();
  for (const name of ["theory", "variant", "against", "convention"]) by(name).value = state[name];
  by("log").checked = state.log === "yes";
  for (const box of form.elements.beside) box.checked = state.beside.includes(box.value);
  if (state.spectrum !== "" || by("spectrum").value === "") by("spectrum").value = state.spectrum;
  form.elements.source.value = state.spectrum === "" ? "numbers" : "spectrum";
  showSource();
}

// Checks the state, computes and draws, or says what is wrong with it.
function update(extra = {}) {
  delete state.samples;
  const pasted = form.elements.source.value === "spectrum";
  const errors = {
    ...extra,
    ...faultsOf(state),
    ...(pasted && state.spectrum === "" ? { spectrum: "paste two columns, q and C" } : {}),
  };
  let found = null;
  if (!Object.keys(errors).length) {
    found = curvesOf(state);
    if (found.fault) errors.theory = found.fault;
  }
  for (const name of [...Object.keys(NUMBERS), "spectrum", "theory"]) {
    by(`error-${name}`).textContent = errors[name] ?? "";
    by(name).setAttribute("aria-invalid", name in errors);
  }
  const bad = Object.keys(errors).length > 0;
  by("charts").parentElement.classList.toggle("stale", bad);
  for (const id of ["csv", "law", "link"]) by(id).disabled = bad;
  if (bad) return;
  by("subtitle").textContent =
    `h_rms = ${shown(found.h_rms)} ${LENGTH ?? ""}, rms gradient ${shown(found.gradient)}${state.samples ? `, ${state.samples.q.length} samples of a spectrum` : `, q₁/q₀ = ${shown(state.q1 / state.q0)}`}`;
  draw(state, { ...found, state });
  clearTimeout(writing);
  writing = setTimeout(() => history.replaceState(null, "", addressOf(state)), 200);
}

const say = (text) => (by("note").textContent = text);
by("csv").addEventListener("click", () => save("contact.csv", csvOf(state, drawn), "text/csv"));
by("law").addEventListener("click", () => {
  try {
    save("law.c", lawOf(state), "text/x-c");
    say("");
  } catch (fault) {
    say(`No law was written: ${fault.message}.`);
  }
});
by("link").addEventListener("click", async () => {
  const address = location.href.replace(/#.*/, "") + addressOf(state);
  history.replaceState(null, "", addressOf(state));
  try {
    await navigator.clipboard.writeText(address);
    say("The link is copied.");
  } catch {
    say("The link is in the address bar.");
  }
});
form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("reset", (event) => {
  event.preventDefault();
  open({ ...FIRST });
});
addEventListener("hashchange", ({ newURL }) => {
  // not location.hash: the last change of a control may have been written there since
  const asked = stateOf(new URL(newURL).hash);
  open(asked.state, asked.errors);
});
function open(next, errors = {}) {
  state = next;
  show();
  update(errors);
}

by("origin").textContent = DATA.note;
by("version").textContent =
  `mbma_tables ${DATA.version}: its C as WebAssembly, with its tables. Nothing is sent anywhere.`;
open(state, addressErrors);
document.documentElement.dataset.ready = performance.now();
// the browser compiles what runs often better: do that before the first slider moves
for (const against of WORDS.against) setTimeout(() => curvesOf({ ...state, against, beside: WORDS.theory }), 50);
