// Teaching: a name, a touch that goes with it, and what is known so far.

const form = document.getElementById("teach");
const [button, said, refused, list] = ["button", "[role=status]", ".trouble", "ul"].map((one) => form.querySelector(one));
let teaching = false;

export function showLessons(lessons) {
  form.hidden = false;
  teaching = Boolean(lessons.name);
  button.textContent = teaching ? "End" : "Begin";
  for (const field of form.querySelectorAll("input")) field.disabled = teaching;
  const lasts = lessons.lasts_s === null ? "waiting for a touch: slide for some seconds" : `touched for ${lessons.lasts_s.toFixed(0)} s`;
  const now = teaching ? `${lessons.name}: ${lasts}` : lessons.last;
  if (said.textContent !== now) said.textContent = now;
  if (list.textContent === lessons.sentences.join("")) return;
  list.replaceChildren(...lessons.sentences.map((textContent) => Object.assign(document.createElement("li"), { textContent })));
}

form.onsubmit = async (event) => {
  event.preventDefault();
  const query = new URLSearchParams(location.search);
  if (!teaching) for (const [name, value] of new FormData(form)) query.set(name, value);
  const answer = await fetch(`do/${teaching ? "learnt" : "learn"}?${query}`, { method: "POST" }).catch(() => null);
  refused.textContent = answer?.ok ? "" : `That could not be done${answer ? ": " + await answer.text() : "."}`;
};
