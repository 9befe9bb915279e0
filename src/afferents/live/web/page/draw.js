// Maps and spectra on canvases.

// Cividis at eight places (Nuñez et al., PLoS ONE 2018): the same to the colour-blind.
const CIVIDIS = [[0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109],
  [112, 113, 115], [138, 134, 120], [190, 174, 105], [254, 232, 56]];

export function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(place), CIVIDIS.length - 2), part = place - low;
  const mixed = CIVIDIS[low].map((c, i) => Math.round(c + part * (CIVIDIS[low + 1][i] - c)));
  return `rgb(${mixed})`;
}

const scales = new WeakMap();

// Draws a map from 0 to a slowly falling maximum, which it returns.
export function drawMap(canvas, image) {
  const most = Math.max(...image.flat(), 0.99 * (scales.get(canvas) ?? 0), 0.5);
  scales.set(canvas, most);
  const shape = Math.round((canvas.width * image.length) / image[0].length);
  if (canvas.height !== shape) canvas.height = shape; // pixels are squares, whatever the layout
  const context = canvas.getContext("2d");
  const height = canvas.height / image.length, width = canvas.width / image[0].length;
  image.forEach((line, y) => line.forEach((value, x) => {
    context.fillStyle = colour(value / most);
    context.fillRect(x * width, y * height, width + 1, height + 1);
  }));
  return most;
}

// Draws amplitudes, marks the comb of harmonics, and returns its fundamental in Hz, or 0.
export function drawSpectrum(canvas, amplitude, step, ink) {
  const context = canvas.getContext("2d"), { width, height } = canvas;
  const most = Math.max(...amplitude.slice(1), 1e-9), left = 8, floor = height - 26, top = 22;
  const x = (bin) => left + (bin / (amplitude.length - 1)) * (width - 2 * left);
  const y = (value) => floor - (Math.min(value / most, 1)) * (floor - top);
  context.clearRect(0, 0, width, height);
  context.strokeStyle = context.fillStyle = ink;
  context.font = "13px system-ui, sans-serif";
  context.textAlign = "center";
  const every = 50 / step;
  for (let bin = 0; bin < amplitude.length; bin += every) {
    context.fillText(`${Math.round(bin * step)}${bin ? "" : " Hz"}`, Math.max(x(bin), 18), height - 8);
  }
  context.beginPath();
  amplitude.forEach((value, bin) => (bin > 1 ? context.lineTo(x(bin), y(value)) : context.moveTo(x(bin), y(value))));
  context.stroke();
  const comb = fundamental(amplitude, step);
  if (comb) for (let bin = comb / step; bin < amplitude.length; bin += comb / step) context.fillText("▾", x(bin), 16);
  return comb;
}

// The comb whose teeth stand out most over what lies between them; 0 where none does.
function fundamental(amplitude, step) {
  const at = (bin) => Math.max(...[-1, 0, 1].map((off) => amplitude[Math.round(bin) + off] ?? 0));
  let best = 0, bestScore = 0;
  for (let base = 3 / step; base < amplitude.length / 2; base += 0.25) {
    let teeth = 0, gaps = 0, n = 0;
    for (let bin = base; bin < amplitude.length - base / 2; bin += base, n++) {
      teeth += Math.log(at(bin) + 1e-9);
      gaps += Math.log(at(bin + base / 2) + 1e-9);
    }
    const score = n >= 2 ? ((teeth - gaps) / n) * Math.sqrt(n) : 0;
    if (score > bestScore) [best, bestScore] = [base * step, score];
  }
  return bestScore > 3.5 ? best : 0;
}

// Draws a row a unit and a mark a spike, class below class; the newest lies at the right.
export function drawRaster(canvas, classes, ink) {
  const context = canvas.getContext("2d"), left = 34, gap = 8, floor = 22;
  const { width, height } = canvas, span = 1000;
  const shares = classes.map(({ units }) => Math.max(units.length, 12)); // few units have higher rows
  const room = (height - floor - gap * classes.length) / shares.reduce((a, b) => a + b);
  const x = (age) => left + (1 - age / span) * (width - left - 8);
  context.clearRect(0, 0, width, height);
  context.strokeStyle = context.fillStyle = ink;
  context.font = "13px system-ui, sans-serif";
  context.textAlign = "left";
  let top = gap / 2;
  classes.forEach(({ name, ages_ms }, i) => {
    const row = (shares[i] * room) / ages_ms.length;
    context.fillText(name, 6, top + (shares[i] * room) / 2 + 5);
    context.beginPath();
    ages_ms.forEach((ages, unit) => ages.forEach((age) => {
      context.moveTo(x(age), top + unit * row);
      context.lineTo(x(age), top + (unit + 0.8) * row);
    }));
    context.stroke();
    top += shares[i] * room + gap;
  });
  context.textAlign = "center";
  for (const age of [1000, 750, 500, 250, 0]) {
    context.fillText(age ? `\u2212${age}${age === span ? " ms" : ""}` : "now", Math.min(x(age), width - 18), height - 6);
  }
}
