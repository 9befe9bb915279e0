// Tactile images in colour, and the bars that say what the colours mean.

// Cividis at eight places (Nuñez et al., PLoS ONE 2018): the same to the colour-blind.
const CIVIDIS = [[0, 34, 78], [18, 53, 112], [59, 73, 108], [87, 93, 109],
  [112, 113, 115], [138, 134, 120], [190, 174, 105], [254, 232, 56]];
const ROUND = [1, 2, 3, 4, 5, 6, 8, 10]; // times a power of ten: where a scale may end
const LOST = -1; // stands where a marker is lost; null where none belongs
const LEAST_PX = { sa1: 0.5, ra1: 0.3 }; // noise of tracking does not fill the colours
const RECENT = 100; // images that the scale is made for, five seconds at most
const SHARE = 0.99; // of what they show lies within the scale: one marker that jumps does not darken the rest

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

// The end of a canvas' scale: a round number, so that it can be read; it grows as soon as more than
// a hundredth of what the last images show lies above it, and shrinks only where there is room.
function scaleEnd(canvas, image) {
  const { recent, end: before } = scales.get(canvas) ?? { recent: [], end: 0 };
  recent.push(image.flat().filter((value) => value !== null && value !== LOST));
  if (recent.length > RECENT) recent.shift();
  const values = Float32Array.from(recent.flat()).sort();
  const most = Math.max(values[Math.floor(SHARE * (values.length - 1))] ?? 0, LEAST_PX[canvas.id]);
  const end = most > before ? roundUp(most) : Math.min(before, roundUp(1.25 * most));
  scales.set(canvas, { recent, end });
  return end;
}

// Draws an image from 0 to the end of its scale, which it returns. Where no marker stands the page
// shows through, and where one is lost, with a cross.
export function drawMap(canvas, image, ink) {
  const end = scaleEnd(canvas, image);
  const shape = Math.round((canvas.width * image.length) / image[0].length);
  if (canvas.height !== shape) canvas.height = shape; // pixels are squares, whatever the layout
  const context = canvas.getContext("2d");
  const height = canvas.height / image.length, width = canvas.width / image[0].length;
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.strokeStyle = ink;
  context.lineWidth = width / 12;
  context.beginPath();
  image.forEach((line, y) => line.forEach((value, x) => {
    if (value === LOST) {
      context.moveTo((x + 0.3) * width, (y + 0.3) * height), context.lineTo((x + 0.7) * width, (y + 0.7) * height);
      context.moveTo((x + 0.3) * width, (y + 0.7) * height), context.lineTo((x + 0.7) * width, (y + 0.3) * height);
    } else if (value !== null) {
      const [left, top] = [Math.round(x * width), Math.round(y * height)];
      context.fillStyle = colour(value / end);
      context.fillRect(left, top, Math.round((x + 1) * width) - left, Math.round((y + 1) * height) - top);
    }
  }));
  context.stroke();
  return end;
}

// Shows a bar of the colours from 0 to an end, with three numbers and the unit.
export function showScale(bar, end, unit = "px") {
  const said = `Colours from 0 to ${end} ${unit} or more`;
  if (bar.getAttribute("aria-label") === said) return;
  bar.setAttribute("aria-label", said);
  bar.style.background = `linear-gradient(to top, ${CIVIDIS.map((c) => `rgb(${c})`)})`;
  bar.replaceChildren(...[0, 0.5, 1].map((share) => {
    const number = Number((share * end).toPrecision(3));
    const tick = document.createElement("span");
    tick.style.bottom = `${100 * share}%`;
    tick.textContent = share === 1 ? `≥ ${number} ${unit.split(" ")[0]}` : `${number}`;
    return tick;
  }));
}
