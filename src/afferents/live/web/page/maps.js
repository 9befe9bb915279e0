// Tactile images in colour, and the bars that say what the colours mean.

// Cividis at eight places (Nuñez et al., PLoS ONE 2018): the same to the colour-blind.
const CIVIDIS = [[0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109],
  [112, 113, 115], [138, 134, 120], [190, 174, 105], [254, 232, 56]];
const ROUND = [1, 2, 3, 4, 5, 6, 8, 10]; // times a power of ten: where a scale may end
const LEAST_PX = 0.5; // noise does not fill the colours

export function colour(share) {
  const place = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(place), CIVIDIS.length - 2), part = place - low;
  const mixed = CIVIDIS[low].map((c, i) => Math.round(c + part * (CIVIDIS[low + 1][i] - c)));
  return `rgb(${mixed})`;
}

// The round number at or above a value.
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ROUND.find((n) => n * power >= value * (1 - 1e-9));
}

const scales = new WeakMap();

// The end of a canvas' scale: a round number, so that it can be read; it grows at once, and
// shrinks only where the slowly forgotten maximum has room in it, so that it does not flicker.
function scaleEnd(canvas, image) {
  const before = scales.get(canvas) ?? { peak: 0, end: 0 };
  const peak = Math.max(...image.flat(), 0.99 * before.peak, LEAST_PX);
  const end = peak > before.end ? roundUp(peak) : Math.min(before.end, roundUp(1.25 * peak));
  scales.set(canvas, { peak, end });
  return end;
}

// Draws an image from 0 to the end of its scale, which it returns.
export function drawMap(canvas, image) {
  const end = scaleEnd(canvas, image);
  const shape = Math.round((canvas.width * image.length) / image[0].length);
  if (canvas.height !== shape) canvas.height = shape; // pixels are squares, whatever the layout
  const context = canvas.getContext("2d");
  const height = canvas.height / image.length, width = canvas.width / image[0].length;
  image.forEach((line, y) => line.forEach((value, x) => {
    context.fillStyle = colour(value / end);
    context.fillRect(x * width, y * height, width + 1, height + 1);
  }));
  return end;
}

// Shows a bar of the colours from 0 to an end, with three numbers and the unit.
export function showScale(bar, end, unit) {
  const said = `Colours from 0 to ${end} ${unit}`;
  if (bar.getAttribute("aria-label") === said) return;
  bar.setAttribute("aria-label", said);
  bar.style.background = `linear-gradient(to top, ${CIVIDIS.map((c) => `rgb(${c})`)})`;
  bar.replaceChildren(...[0, 0.5, 1].map((share) => {
    const number = Number((share * end).toPrecision(3));
    const tick = document.createElement("span");
    tick.style.bottom = `${100 * share}%`;
    tick.textContent = share === 1 ? `${number} ${unit}` : `${number}`;
    return tick;
  }));
}
