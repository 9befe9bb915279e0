// A recording: what is to be done in large type, how far the plan is, and three things to ask for.

const $ = (id) => document.getElementById(id);
const ACTIONS = { next: "Enter", redo: "r", stop: "s" };
let can = [];

export function showRecording(recording) {
  $("recording").hidden = false;
  if ($("say").textContent !== recording.say) $("say").textContent = recording.say;
  $("recording").classList.toggle("asks", recording.can.includes("next"));
  can = recording.can;
  for (const what of Object.keys(ACTIONS)) $(`do-${what}`).disabled = !can.includes(what);
  $("plan").max = recording.total || 1;
  $("plan").value = recording.done;
  const figures = [["Runs", `${recording.done} of ${recording.total}`]];
  if (recording.run) figures.push(["Run", recording.attempt > 1 ? `${recording.run}, attempt ${recording.attempt}` : recording.run]);
  if (recording.elapsed_s !== null) figures.push(["Time", `${recording.elapsed_s.toFixed(1)} of ${recording.run_s.toFixed(1)} s`]);
  if (recording.drive) {
    const [speed, set] = recording.drive;
    figures.push(["Drum", speed === null ? "not read" : `${speed.toFixed(1)} of ${set} mm/s`]);
  }
  if (recording.free_gb !== null) figures.push(["Disk", `${recording.free_gb} GB free`]);
  $("recording").querySelector("dl").replaceChildren(...figures.map(([name, value]) => {
    const figure = document.createElement("div");
    for (const [tag, text] of [["dt", name], ["dd", value]]) {
      figure.append(Object.assign(document.createElement(tag), { textContent: text }));
    }
    return figure;
  }));
  const said = recording.notes.join("\n");
  if ($("notes").dataset.said === said) return;
  $("notes").dataset.said = said;
  $("notes").replaceChildren(...recording.notes.map((note) =>
    Object.assign(document.createElement("li"), { textContent: note })));
}

async function ask(what) {
  if (!can.includes(what)) return;
  if (what === "stop" && !confirm("Stop the recording? What is finished is kept.")) return;
  const answer = await fetch(`do/${what}${location.search}`, { method: "POST" }).catch(() => null);
  $("refused").textContent = answer?.ok ? "" : `That could not be done${answer ? ": " + await answer.text() : "."}`;
}

for (const [what, key] of Object.entries(ACTIONS)) {
  $(`do-${what}`).onclick = () => ask(what);
  addEventListener("keydown", (event) => {
    if (event.target.closest("button, summary, a, input") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === key && !event.repeat) ask(what);
  });
}
