// The C of mbma_tables as WebAssembly, filled with its numbers and tables.

const DATA = JSON.parse(document.getElementById("data").textContent);
const LIMITS = DATA.limits;
const OK = 0,
  OUTSIDE = 6; // as in mbma.h
const RTOL = 1e-11; // asked of MBMA's totals
const LAW_BYTES = 1 << 21; // room for an mbma_spectrum

function bytesOf(text) {
  const letters = atob(text),
    bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; ++k) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

// Undoes `packed` of export/page/explorer.py: the bytes of a table.
async function unpacked({ count, bytes: size, differences, text }) {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const bytes = new Uint8Array(count * size),
    words = new Int32Array(bytes.buffer);
  for (let k = 0; k < bytes.length; ++k) bytes[k] = planes[(k % size) * count + Math.floor(k / size)];
  for (let n = 0; n < differences; ++n) {
    for (let k = 1; k < count; ++k) words[k] += words[k - 1];
  }
  return bytes;
}

const tables = await Promise.all(
  Object.entries(DATA.model.tables).map(async ([name, table]) => [name, await unpacked(table)]),
);
const C = (await WebAssembly.instantiate(bytesOf(DATA.model.module))).instance.exports;
C._initialize();
// memory that the module does not use: two laws, arguments, answers, numbers of yielding, a spectrum
const OWN = 65536 * C.memory.grow(Math.ceil((2 * LAW_BYTES + 3072 + 16 * LIMITS.max_samples) / 65536));
const LAWS = { persson: OWN, calibrated: OWN + LAW_BYTES };
const ARGUMENTS = OWN + 2 * LAW_BYTES,
  ANSWER = ARGUMENTS + 1024,
  YIELDING = ANSWER + 1024,
  CALL = ARGUMENTS + 512,
  SAMPLES = YIELDING + 1024;
const numbersAt = (place, count) => new Float64Array(C.memory.buffer, place, count);
for (const [name, bytes] of tables) new Uint8Array(C.memory.buffer, C[name].value, bytes.length).set(bytes);

// A number by a loop of the core over arrays, which have one entry here.
function ofCore(name, ...numbers) {
  const places = numbers.map((_, k) => CALL + 8 * k),
    result = CALL + 8 * numbers.length;
  numbersAt(CALL, numbers.length).set(numbers);
  C[name](1, ...places, result);
  return numbersAt(result, 1)[0];
}

// One surface, variant and modulus as functions of the mean separation, by theory.
function prepare(state) {
  const surface = ["hurst", "q0", "q1", "h_rms", "h_max"].map((name) => state[name]);
  const variant = DATA.model.variants[state.variant];
  // mbma_variant: five numbers and three flags
  numbersAt(C.MBMA_VARIANT.value, 5).set(variant.numbers.slice(0, 5));
  new Int32Array(C.memory.buffer, C.MBMA_VARIANT.value + 40, 3).set(variant.numbers.slice(5));
  numbersAt(ARGUMENTS, 5).set(surface);
  const samples = state.samples;
  if (samples) {
    numbersAt(SAMPLES, samples.q.length).set(samples.q);
    numbersAt(SAMPLES + 8 * samples.q.length, samples.C.length).set(samples.C);
  }
  const held = {};
  const law = (theory) => {
    const number = theory === "persson" ? 0 : 1,
      count = samples?.q.length;
    held[theory] ??= samples
      ? C.mbma_spectrum_of(count, SAMPLES, SAMPLES + 8 * count, state.h_max, number, LAWS[theory])
      : C.mbma_surface_spectrum_of(ARGUMENTS, number, LAWS[theory]);
    return held[theory];
  };
  let fault = OK;
  const answer = (status) => {
    if (status !== OK) {
      fault = status;
      return null;
    }
    const [force, area, stiffness] = numbersAt(ANSWER, 3);
    return { force, area, stiffness };
  };
  const byLaw = (theory, u) => answer(law(theory) || C.mbma_spectrum_contact_of(LAWS[theory], u, state.E_star, ANSWER));
  return {
    mbma(u) {
      const found = answer(C.mbma_total_of(ARGUMENTS, 2 * u - state.h_max, state.E_star, RTOL, ANSWER));
      if (found && variant.cover) found.area = ofCore("mbma_covered_areas", found.area);
      return found;
    },
    calibrated(u) {
      const status = samples ? OUTSIDE : C.mbma_calibrated_of(ARGUMENTS, u, state.E_star, ANSWER);
      return status === OUTSIDE ? byLaw("calibrated", u) : answer(status);
    },
    persson: (u) => byLaw("persson", u),
    // the only theory whose separation at a pressure is a formula
    perssonSeparation(pressure) {
      const status = law("persson") || C.mbma_spectrum_separation_of(LAWS.persson, pressure, state.E_star, ANSWER);
      return status === OK ? numbersAt(ANSWER, 1)[0] : NaN;
    },
    // why the last answer that is missing is missing
    why() {
      const bytes = new Uint8Array(C.memory.buffer, C.mbma_message(fault));
      return String.fromCharCode(...bytes.subarray(0, bytes.indexOf(0)));
    },
    // mbma_spectrum begins with h_rms, h_max, gradient
    moments() {
      const status = law("persson"),
        [h_rms, , gradient] = numbersAt(LAWS.persson, 3);
      return { status, h_rms, gradient };
    },
  };
}
