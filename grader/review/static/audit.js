"use strict";
// The audit: a settled verdict, the drawing it is about, and one key. Nothing is kept here.

const ANSWER_KEYS = { 1: "right", 2: "wrong", 3: "unclear" };
const VERDICT_KEYS = { 1: "full", 2: "partial", 3: "none", 4: "follow_through" };
const state = { question: null, correcting: null, busy: false, ready: false };

const viewer = new Viewer($("view"), () => {});
viewer.onLoad = () => { state.ready = true; };

function failed(error) {
  if (error instanceof Error) throw error;
  tell(error.message);
}

function show(facts) {
  const question = facts.question;
  Object.assign(state, { question, correcting: null, ready: false });
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
  $("who").textContent = stored.get("anonymous", "") === "1" ? `# ${question.number}` : question.label;
  showFacts(question);
  $("badge").className = `badge v-${question.said}`;
  $("badge").textContent = question.mark;
  $("asks").textContent = question.asks;
  for (const tool of document.querySelectorAll(".tools button")) tool.hidden = !question.look;
  if (question.look) viewer.show({ ...question.look, nodes: [] }); else state.ready = true;
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

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  const letter = event.code.startsWith("Key") ? event.code.slice(3).toLowerCase() : event.key;
  if (state.correcting && VERDICT_KEYS[event.key]) correct(VERDICT_KEYS[event.key]);
  else if (state.correcting && event.key === "ArrowRight") busy(next);
  else if (ANSWER_KEYS[event.key]) check(ANSWER_KEYS[event.key]);
  else if (letter === "u") undo();
  else if (letter === "f") viewer.whole();
  else if (event.key === " " && !event.target.closest("button, a")) hideMarks();
  else return;
  event.preventDefault();
});
for (const button of document.querySelectorAll("[data-answer]")) button.onclick = () => check(button.dataset.answer);
for (const button of document.querySelectorAll("[data-verdict]")) button.onclick = () => correct(button.dataset.verdict);
$("undo").onclick = undo;
$("later").onclick = () => busy(next);
$("hide").onclick = hideMarks;
$("whole").onclick = () => viewer.whole();
busy(next);
