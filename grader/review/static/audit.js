"use strict";
// The audit: a settled verdict, the drawing it is about, and one key. Nothing is kept here. With `?second=20`
// a fifth of what others decided is marked a second time, blind: one key gives the verdict.

const ANSWER_KEYS = { 1: "right", 2: "wrong", 3: "unclear" };
const second = new URLSearchParams(location.search).get("second");
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
  $("instead").hidden = !second;
  $("answers").hidden = Boolean(second);
  showDiffering(facts.differ || []);
  document.body.dataset.shown = question ? `${question.student}/${question.criterion}` : "";
  if (!question) return;
  $("who").textContent = whoOf(question);
  showFacts(question);
  if (second) { $("instead-text").textContent = question.asks; $("points").value = ""; $("most").textContent = `/ ${question.most}`; }
  $("badge").className = `badge v-${question.said}`;
  $("badge").textContent = question.mark;
  $("asks").textContent = question.asks;
  if (question.look) viewer.show({ ...question.look, nodes: [] }); else state.ready = true;
}

function showDiffering(pairs) {
  $("differ").hidden = $("to-differ").hidden = !pairs.length;
  $("differ-list").replaceChildren(...pairs.map((one) => {
    const item = element("li"), link = element("a", { href: `./#${encodeURIComponent(`${one.student}/${one.criterion}`)}` });
    link.innerHTML = one.title;
    item.append(whoOf(one), " ", link, ` ${one.said}`);
    return item;
  }));
}

const whoOf = (one) => (stored.get("anonymous", "") === "1" ? `# ${one.number}` : one.label);
const next = async () => show(await call(second ? `api/second?${new URLSearchParams({ share: second, by: decider() })}` : "api/audit"));

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

function markAgain(verdict) {
  const { student, criterion, seen } = state.question, points = verdict === "partial" || verdict === "follow_through" ? $("points").value : "";
  if (state.ready) busy(async () => {
    try { show(await call("api/second", { student, criterion, verdict, seen, share: Number(second), points: points === "" ? null : Number(points) })); }
    catch (error) { await next(); throw error; }
    tell("");
  });
}

function correct(verdict) {
  if (second) { markAgain(verdict); return; }
  const { student, criterion, seen } = state.correcting;
  busy(async () => {
    await call("api/decide", { answers: [{ student, criterion, verdict, seen }] });
    await next();
  });
}

function undo() {
  busy(async () => {
    const done = await call("api/undo", {});
    tell(done.undone ? "" : texts.nothing_to_undo);
    await next();
  });
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || event.target.closest("input")) return;
  const letter = event.code.startsWith("Key") ? event.code.slice(3).toLowerCase() : event.key;
  if ((second ? state.question : state.correcting && event.key !== "0") && VERDICT_KEYS[event.key]) correct(VERDICT_KEYS[event.key]);
  else if (state.correcting && event.key === "ArrowRight") busy(next);
  else if (!second && ANSWER_KEYS[event.key]) check(ANSWER_KEYS[event.key]);
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
$("by").value = $("by").readOnly ? document.body.dataset.by : stored.get("by", document.body.dataset.by);
$("by").onchange = () => { stored.set("by", $("by").value.trim()); busy(next); };
$("share").value = second || 20;
$("share").onchange = () => { location.search = `?second=${$("share").value}`; };
for (const part of document.querySelectorAll(".of-second")) part.hidden = !second;
for (const part of document.querySelectorAll(".of-audit")) part.hidden = Boolean(second);
busy(next);
