// Draws what the server sends: a greeting with the models, then states and pictures.

import { drawRaster, drawSpectrum } from "./draw.js";
import { colour, drawMap, showScale } from "./maps.js";
import { showRecording } from "./record.js";
import { showLessons } from "./teach.js";

const STALE_S = 1; // older than that nothing is shown as if it were now
const HISTORY = 600; // columns of the history, one a message
const MOST = 20; // textures shown until all are asked for

const ink = () => getComputedStyle(document.body).color;
const $ = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

let paused = false, marked = true, state = null, picture = null, saidAt = 0;
const models = new Map();

function greet(hello) {
  models.clear();
  const classifying = hello.models.filter((model) => model.textures.length);
  document.body.classList.toggle("looking", !classifying.length); // no models: pictures take the page
  $("models").hidden = !classifying.length;
  $("title").textContent = classifying.length ? "What the fingertip recognises" : "What the sensor shows";
  $("rest").hidden = !hello.has_rest;
  if (hello.recording) $("title").textContent = "Recording";
  showBeside(hello.name, Object.entries(hello.beside ?? {}));
  $("models").replaceChildren(...classifying.map((model) => {
    const view = modelView(model);
    models.set(model.model, view);
    return view.article;
  }));
}

function showBeside(name, pages) { // of several fingertips, each on a port of its own
  $("beside").hidden = !pages.length;
  $("beside").replaceChildren(...pages.map(([other, port]) => {
    const link = make("a", { textContent: other, href: Object.assign(new URL(location), { port }) });
    if (other === name) link.setAttribute("aria-current", "page");
    return link;
  }));
}

function modelView(model) {
  const view = { model, all: model.textures.length <= MOST, rows: new Map() };
  view.felt = make("p", { className: "felt", textContent: "…" });
  view.trouble = make("p", { className: "trouble" });
  view.counts = make("p", { className: "counts" });
  view.faults = new Map();
  view.faulty = make("details", { className: "faults", hidden: true });
  view.bars = make("div", { className: "bars", role: "list", tabIndex: 0 });
  view.bars.setAttribute("aria-label", `Textures by ${model.title}`);
  for (const texture of model.textures) view.rows.set(texture, row(called(model, texture)));
  view.history = make("canvas", { className: "history", width: HISTORY, height: model.textures.length });
  view.history.setAttribute("role", "img");
  view.history.setAttribute("aria-label", `Evidence of ${model.title} over the last half minute`);
  const heading = make("h2", {}, model.title);
  if (!view.all) {
    const button = make("button", { textContent: `All ${model.textures.length}` });
    button.setAttribute("aria-pressed", "false");
    button.onclick = () => {
      view.all = !view.all;
      button.setAttribute("aria-pressed", view.all);
    };
    heading.append(button);
  }
  const legend = make("p", { className: "legend" });
  legend.innerHTML = '<i style="background:var(--all)"></i>evidence of the touch so far '
    + '<i style="background:var(--now)"></i>this moment alone';
  const about = make("details", {}, make("summary", { textContent: "About this model" }),
    ...model.description.map((sentence) => make("p", { textContent: sentence })));
  const [first, last] = [model.textures[0], model.textures.at(-1)];
  const time = make("p", { className: "legend axis" }, make("span", { textContent: "half a minute ago" }),
    make("span", { textContent: `evidence, ${called(model, first)} at the top to ${called(model, last)}`,
      title: "Dark: none of the evidence; yellow: all of it." }),
    make("span", { textContent: "now" }));
  const head = make("div", { className: "head" }, heading, view.felt);
  view.article = make("article", {}, head, view.trouble, view.bars, legend,
    view.history, time, view.counts, view.faulty, about);
  return view;
}

function called(model, texture) {
  const spacing = model.named_by_spacing && Number.isFinite(Number(texture)); // of bumps; else a name
  return spacing ? `${texture} mm` : texture;
}

function row(name) {
  const parts = { name: make("span", { textContent: name }), all: make("div", { className: "all" }),
    now: make("div", { className: "now" }), share: make("span", { className: "share" }) };
  parts.track = make("div", { className: "track" }, parts.all, parts.now);
  parts.cells = [parts.name, parts.track, parts.share];
  return parts;
}

function showModel(view, prediction) {
  const fresh = prediction.fresh && prediction.age_s < STALE_S;
  view.article.classList.toggle("stale", !fresh);
  const ranked = [...view.model.textures].sort((a, b) => prediction.evidence[b] - prediction.evidence[a]);
  const leader = ranked[0], share = Math.round(100 * prediction.evidence[leader]);
  const after = prediction.sure_after_s;
  const sure = after === null ? "" : after < 0.05 ? ", sure at once" : `, sure after ${after.toFixed(1)} s`;
  const unknown = fresh && prediction.state === "unknown";
  view.article.classList.toggle("unknown", unknown);
  let felt = `${leader}`, how = `${share}%${sure}`;
  if (!fresh) [felt, how] = [prediction.state === "waiting" ? "waiting" : "nothing fresh", ""];
  else if (unknown) [felt, how] = ["unknown", "like nothing it has learnt"];
  else if (prediction.state === "untouched") [felt, how] = ["no touch", "the skin is at rest"];
  view.felt.replaceChildren(felt === leader ? called(view.model, felt) : felt, " ", make("small", { textContent: how }));
  view.felt.dataset.felt = felt;
  if (prediction.troubles.length) view.trouble.textContent = prediction.troubles.at(-1);
  else if (fresh) view.trouble.textContent = "";
  const shown = new Set(view.all ? ranked : ranked.slice(0, MOST));
  const cells = [];
  for (const [texture, parts] of view.rows) {
    if (!shown.has(texture)) continue;
    const now = Math.min(prediction.probabilities[texture] ?? 0, view.model.most_sure); // no surer than it was found right
    parts.all.style.width = `${100 * prediction.evidence[texture]}%`;
    parts.now.style.width = `${100 * now}%`;
    parts.share.textContent = `${Math.round(100 * prediction.evidence[texture])}%`;
    cells.push(...parts.cells);
  }
  if (view.bars.childElementCount !== cells.length || !view.all) view.bars.replaceChildren(...cells);
  drawHistory(view, fresh ? prediction.evidence : null);
  view.counts.textContent = counted(prediction);
  listFaults(view, prediction.troubles);
  return `${view.model.title}: ${felt} ${how}`;
}

function listFaults(view, troubles) {
  const said = troubles.at(-1), same = view.faults.get(said);
  if (!said || said === view.lastFault) return void (view.lastFault = said);
  view.lastFault = said;
  view.faults.set(said, { n: (same?.n ?? 0) + 1, at: new Date().toLocaleTimeString() });
  view.faulty.hidden = false;
  view.faulty.replaceChildren(make("summary", { textContent: "What was wrong" }),
    ...[...view.faults].map(([text, { n, at }]) =>
      make("p", { textContent: `${text} ${n > 1 ? `${n} times, last at` : "At"} ${at}.` })));
}

function counted(prediction, moment = true) {
  const { frames, samples, ...faults } = prediction.counters;
  const parts = prediction.latency_ms === null || !moment ? [] : [`${prediction.latency_ms.toFixed(1)} ms from memory to prediction`];
  if (prediction.markers_found !== null && moment) parts.push(`${Math.round(100 * prediction.markers_found)}% of markers seen`);
  for (const [name, n] of Object.entries(faults)) if (n) parts.push(`${n} ${name.replace("_", " ").replace(n === 1 ? /s$/ : "", "")}`);
  return parts.join(" · ");
}

function drawHistory(view, evidence) {
  const canvas = view.history, context = canvas.getContext("2d");
  context.globalCompositeOperation = "copy";
  context.drawImage(canvas, -1, 0);
  context.globalCompositeOperation = "source-over";
  view.model.textures.forEach((texture, y) => {
    context.fillStyle = evidence ? colour(evidence[texture]) : "#888";
    context.fillRect(canvas.width - 1, y, 1, 1);
  });
}

function showVideo(video) {
  $("camera").hidden = $("maps").hidden = !video;
  if (!video) return;
  $("frames").textContent = `${rounded(video.rate_hz)} frames/s`;
  $("sensor").textContent = models.size ? "" : video.sensor;
  if (!video.sa1) return;
  for (const name of ["sa1", "ra1"]) {
    $(`${name}-scale`).hidden = !video[name];
    if (video[name]) showScale($(`${name}-scale`), drawMap($(name), video[name], ink()), video.unit);
  }
}

// A rate as it can be read: whole, or with one decimal where it is small.
const rounded = (rate, small = 20) => (rate < small ? rate.toFixed(1) : rate.toFixed(0));

async function showPicture() {
  if (!picture) return;
  const image = await createImageBitmap(picture);
  const canvas = document.querySelector("#camera canvas"), context = canvas.getContext("2d");
  [canvas.width, canvas.height] = [image.width, image.height];
  context.drawImage(image, 0, 0);
  image.close();
  if (!marked || !state?.video) return;
  for (const [key, [x, y, radius]] of state.video.masks ?? []) {
    context.strokeStyle = key === "keep" ? "#fff" : "#f33";
    context.beginPath();
    context.arc(x, y, radius, 0, 7);
    context.stroke();
  }
  if (!state.video.markers) return;
  context.strokeStyle = "#ffb000";
  context.lineWidth = 1.5;
  const ring = state.video.ring_px;
  context.beginPath();
  for (const [x, y] of state.video.markers) {
    if (x < 0) continue;
    context.moveTo(x + ring, y);
    context.arc(x, y, ring, 0, 7);
  }
  context.stroke();
}

function showAudio(audio) {
  $("sound").hidden = !audio;
  if (!audio) return;
  $("samples").textContent = `${rounded(audio.rate_hz / 1000, 50)} kHz`;
  if (!audio.amplitude) return;
  const canvas = document.querySelector("#sound canvas");
  const comb = drawSpectrum(canvas, audio.amplitude, audio.step_hz, ink());
  $("comb").textContent = comb ? `harmonics of ${comb.toFixed(1)} Hz are marked ▾` : "no clear harmonics";
}

function showSpikes(classes) {
  $("spikes").hidden = !classes?.length;
  if ($("spikes").hidden) return;
  drawRaster(document.querySelector("#spikes canvas"), classes, ink());
  const counts = classes.map(({ name, units, spikes_a_unit }) =>
    `${name} ${spikes_a_unit.toFixed(0)} (${units.length} units${name === "PC" ? ", 0.15 s late" : ""})`);
  $("fired").textContent = `Spikes a unit, on average: ${counts.join(", ")}`;
}

function showQuality(predictions) {
  const figures = [...(state.video?.quality ?? []), ...(state.audio?.quality ?? [])];
  const troubles = models.size ? [] : predictions.flatMap(troublesOf);
  const issues = [...troubles, ...figures.map((figure) => figure.issue).filter(Boolean)];
  $("quality").hidden = !figures.length && !issues.length;
  $("quality").querySelector("dl").replaceChildren(...figures.map((figure) => make("div",
    { className: figure.issue ? "issue" : "" },
    make("dt", { textContent: figure.name }), make("dd", { textContent: figure.value }))));
  $("quality").querySelector("ul").replaceChildren(
    ...[...new Set(issues)].map((issue) => make("li", { textContent: issue })));
  const faults = models.size ? [] : predictions.map((prediction) => [prediction.model, counted(prediction, false)]);
  $("faults").textContent = faults.filter(([, counts]) => counts)
    .map(([name, counts]) => `${name} since the start: ${counts}`).join("; ");
}

// What went wrong with a stream that is looked at; the newest is kept until something comes again.
const troubled = new Map();
function troublesOf(prediction) {
  const fresh = prediction.fresh && prediction.age_s < STALE_S;
  if (prediction.troubles.length) troubled.set(prediction.model, prediction.troubles.at(-1));
  else if (fresh) troubled.delete(prediction.model);
  const said = [troubled.get(prediction.model)];
  if (!fresh && !state.ended) said.unshift(`Nothing fresh from the ${prediction.model}: ${prediction.state}.`);
  return said.filter(Boolean);
}

// A moment after a lesson there may be a prediction from before it.
const isOfItsModel = ({ model, evidence }) => models.get(model)?.model.textures.every((texture) => texture in evidence);

function show() {
  if (!state) return;
  if (state.recording) showRecording(state.recording); // never paused: it says what is to be done
  $("again").hidden = !(state.ended && state.repeats);
  if (state.lessons) showLessons(state.lessons);
  if (paused) return;
  $("link").textContent = state.ended ?? "live";
  const said = state.predictions.filter(isOfItsModel).map((p) => showModel(models.get(p.model), p));
  showVideo(state.video);
  showAudio(state.audio);
  showSpikes(state.spikes);
  showQuality(state.predictions);
  const truth = state.predictions.map((p) => p.truth).find(Boolean);
  $("truth").textContent = truth ? `the simulated rig now turns drum ${truth}` : "";
  if (performance.now() - saidAt > 2000) {
    saidAt = performance.now();
    $("said").textContent = said.join("; ");
  }
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}/feel${location.search}`);
  socket.binaryType = "blob";
  socket.onopen = () => { $("link").textContent = "live"; };
  socket.onmessage = ({ data }) => {
    if (data instanceof Blob) {
      picture = data;
      if (!paused) showPicture();
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "hello") greet(message);
    else state = message, show();
  };
  socket.onclose = () => {
    if (state?.recording?.ended) return void ($("link").textContent = "the recording is over");
    $("link").textContent = "connection lost, trying again…";
    for (const view of models.values()) view.article.classList.add("stale");
    setTimeout(connect, 1000);
  };
}

function press(button, value) {
  button.setAttribute("aria-pressed", value);
  return value;
}
const pause = () => {
  paused = press($("pause"), !paused);
  $("pause").firstChild.textContent = paused ? "Go on " : "Pause ";
  $("link").textContent = paused ? "paused: what is shown is from before" : "live";
};
const mark = () => { marked = press($("mark"), !marked); };
$("pause").onclick = pause;
$("again").onclick = () => fetch(`do/again${location.search}`, { method: "POST" });
const rest = () => fetch(`do/rest${location.search}`, { method: "POST" });
$("rest").onclick = rest;
$("mark").onclick = mark;
addEventListener("keydown", (event) => {
  if (event.target.closest("button, summary, a, input") || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " ") { event.preventDefault(); pause(); }
  if (event.key === "m") mark();
  if (event.key === "z" && !$("rest").hidden) rest();
});
connect();
