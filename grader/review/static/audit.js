"use strict";
// The audit: a settled verdict, the drawing it is about, and one key. Nothing is kept here.

const $ = (id) => document.getElementById(id);
const texts = JSON.parse($("texts").textContent);
const SVG = "http://www.w3.org/2000/svg";
const ANSWER_KEYS = { 1: "right", 2: "wrong", 3: "unclear" };
const VERDICT_KEYS = { 1: "full", 2: "partial", 3: "none", 4: "follow_through" };
const windowId = Math.random().toString(36).slice(2) + Date.now().toString(36);
const state = { question: null, correcting: null, busy: false, ready: false, whole: false };

const stored = (name) => { try { return localStorage.getItem(`planmark-${name}`); } catch { return null; } };

async function call(path, body) {
  const by = stored("by") ?? document.body.dataset.by;
  const options = body === undefined ? {} : {
    method: "POST", body: JSON.stringify({ window: windowId, by, ...body }),
    headers: { "Content-Type": "application/json", "X-Planmark": "review" },
  };
  let answer;
  try { answer = await fetch(path, options); } catch { throw { message: texts.gone }; }
  const data = await answer.json().catch(() => ({}));
  if (!answer.ok) throw { message: data.message || answer.statusText };
  return data;
}

function tell(message) { $("note").textContent = message || ""; $("note").hidden = !message; }

function show(facts) {
  const question = facts.question;
  Object.assign(state, { question, correcting: null, ready: false, whole: false });
  $("progress").textContent = `${facts.checked} / ${Math.max(facts.short, facts.checked)}`;
  $("bar").max = facts.short || 1;
  $("bar").value = Math.min(facts.checked, facts.short);
  $("question").hidden = !question;
  $("done").hidden = Boolean(question);
  $("found").textContent = $("found-last").textContent = facts.found;
  $("none").textContent = facts.none;
  $("instead").hidden = true;
  $("answers").hidden = false;
  document.body.dataset.shown = question ? `${question.student}/${question.criterion}` : "";
  if (!question) return;
  $("who").textContent = stored("anonymous") === "1" ? `# ${question.number}` : question.label;
  $("what").innerHTML = question.title;
  $("sentence").innerHTML = question.sentence;
  $("badge").className = `badge v-${question.said}`;
  $("badge").textContent = question.mark;
  $("asks").textContent = question.asks;
  $("numbers").replaceChildren(...question.numbers.flatMap(([name, value]) => {
    const term = document.createElement("dt"), cell = document.createElement("dd");
    term.textContent = name;
    cell.innerHTML = value;
    return [term, cell];
  }));
  $("view").style.display = question.look ? "" : "none";
  $("no-scan").hidden = Boolean(question.look);
  $("no-scan").textContent = texts.no_scan;
  for (const tool of document.querySelectorAll(".tools button")) tool.hidden = !question.look;
  if (question.look) draw(); else state.ready = true;
}

function draw() {
  // The picture first: keys answer only what can be seen.
  const look = state.question.look, svg = $("view"), { width, height } = svg.getBoundingClientRect();
  let [x, y, w, h] = state.whole ? [0, 0, ...look.page_mm] : look.box;
  const wide = Math.max(w, (h * width) / height), high = (wide * height) / width;
  x += (w - wide) / 2; y += (h - high) / 2;
  svg.setAttribute("viewBox", [x, y, wide, high].join(" "));
  const left = Math.max(0, x), top = Math.max(0, y);
  const part = { x: left, y: top, w: Math.max(1, Math.min(look.page_mm[0], x + wide) - left), h: Math.max(1, Math.min(look.page_mm[1], y + high) - top) };
  const scale = Math.min((width * (window.devicePixelRatio || 1)) / wide, 60);
  const image = document.createElementNS(SVG, "image"), marks = document.createElementNS(SVG, "g");
  image.setAttribute("preserveAspectRatio", "none");
  marks.setAttribute("class", "marks");
  marks.innerHTML = look.marks || "";
  svg.replaceChildren(image, marks);
  const query = new URLSearchParams(Object.entries({ ...part, scale }).map(([name, value]) => [name, value.toFixed(2)]));
  const loader = new Image();
  loader.onload = () => {
    for (const [name, value] of [["x", part.x], ["y", part.y], ["width", part.w], ["height", part.h]]) image.setAttribute(name, value);
    image.setAttribute("href", loader.src);
    state.ready = true;
    svg.dataset.loaded = "1";
  };
  loader.onerror = () => tell(texts.gone);
  loader.src = `${look.scan}&${query}`;
}

async function busy(work) {
  if (state.busy) return;
  state.busy = true;
  document.body.dataset.busy = "1";
  try { await work(); } catch (error) { if (error instanceof Error) throw error; tell(error.message); } finally { state.busy = false; delete document.body.dataset.busy; }
}

const next = async () => show(await call("api/audit"));

function check(answer) {
  const question = state.question;
  if (!question || !state.ready || state.correcting) return;
  busy(async () => {
    const { student, criterion, said, checked: seen } = question;
    let facts;
    try { facts = await call("api/audit", { student, criterion, said, answer, seen }); }
    catch (error) { await next(); throw error; }
    tell("");
    if (answer !== "wrong") { show(facts); return; }
    state.correcting = question;
    $("found").textContent = facts.found;
    $("instead-text").textContent = `${texts.instead} ${texts.opened}`;
    $("instead").hidden = false;
    $("answers").hidden = true;
  });
}

function correct(verdict) {
  const { student, criterion, seen } = state.correcting;
  busy(async () => {
    await call("api/decide", { answers: [{ student, criterion, verdict, seen }] });
    await next();
  });
}

function undo() {
  busy(async () => {
    const done = await call("api/undo", {});
    tell(done.undone ? "" : texts.undone);
    await next();
  });
}

function hideMarks() { $("hide").setAttribute("aria-pressed", String($("view").classList.toggle("bare"))); }
function wholeSheet() { state.whole = !state.whole; if (state.question?.look) draw(); }

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  const letter = event.code.startsWith("Key") ? event.code.slice(3).toLowerCase() : event.key;
  if (state.correcting && VERDICT_KEYS[event.key]) correct(VERDICT_KEYS[event.key]);
  else if (state.correcting && event.key === "ArrowRight") busy(next);
  else if (ANSWER_KEYS[event.key]) check(ANSWER_KEYS[event.key]);
  else if (letter === "u") undo();
  else if (letter === "f") wholeSheet();
  else if (event.key === " " && !event.target.closest("button, a")) hideMarks();
  else return;
  event.preventDefault();
});
for (const button of document.querySelectorAll("[data-answer]")) button.onclick = () => check(button.dataset.answer);
for (const button of document.querySelectorAll("[data-verdict]")) button.onclick = () => correct(button.dataset.verdict);
$("undo").onclick = undo;
$("later").onclick = () => busy(next);
$("hide").onclick = hideMarks;
$("whole").onclick = wholeSheet;
window.addEventListener("resize", () => { if (state.question?.look) draw(); });
busy(next);
