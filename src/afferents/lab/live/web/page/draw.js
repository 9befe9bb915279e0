// Spectra and spikes on canvases.

// Makes a canvas as fine as the screen shows it, so that its letters are as large as others.
function fitted(canvas) {
  const fine = devicePixelRatio, { clientWidth: width, clientHeight: height } = canvas;
  const [across, down] = [Math.round(width * fine), Math.round(height * fine)];
  if (canvas.width !== across) canvas.width = across;
  if (canvas.height !== down) canvas.height = down;
  const context = canvas.getContext("2d");
  context.setTransform(fine, 0, 0, fine, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  return { context, width, height };
}

// Draws amplitudes, marks the comb of harmonics, and returns its fundamental in Hz, or 0.
export function drawSpectrum(canvas, amplitude, step, ink) {
  const { context, width, height } = fitted(canvas);
  const most = Math.max(...amplitude.slice(1), 1e-9), left = 8, floor = height - 22, top = 18;
  const x = (bin) => left + (bin / (amplitude.length - 1)) * (width - 2 * left);
  const y = (value) => floor - (Math.min(value / most, 1)) * (floor - top);
  context.strokeStyle = context.fillStyle = ink;
  context.textAlign = "center";
  const every = 50 / step;
  for (let bin = 0; bin < amplitude.length; bin += every) {
    context.fillText(`${Math.round(bin * step)}${bin ? "" : " Hz"}`, Math.max(x(bin), 18), height - 6);
  }
  context.beginPath();
  amplitude.forEach((value, bin) => (bin > 1 ? context.lineTo(x(bin), y(value)) : context.moveTo(x(bin), y(value))));
  context.stroke();
  const comb = fundamental(amplitude, step);
  if (comb) for (let bin = comb / step; bin < amplitude.length; bin += comb / step) context.fillText("▾", x(bin), 13);
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
  const { context, width, height } = fitted(canvas);
  const left = 30, gap = 6, floor = 20, span = 1000;
  const shares = classes.map(({ units }) => Math.max(units.length, 12)); // few units have higher rows
  const room = (height - floor - gap * classes.length) / shares.reduce((a, b) => a + b);
  const x = (age) => left + (1 - age / span) * (width - left - 8);
  context.strokeStyle = context.fillStyle = ink;
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
