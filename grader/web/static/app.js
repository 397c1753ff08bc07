"use strict";
// What the pages do: send forms and files to the API, show what it answers, follow jobs.
const $ = (id) => document.getElementById(id);
const texts = JSON.parse($("texts").textContent);
const token = document.querySelector("meta[name=form-token]").content;
const fill = (text, known) => text.replace(/%\((\w+)\)s/g, (_, name) => known[name]);
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

/** The answer to a request; throws {message} where it is refused or there is none. */
async function call(method, path, body, { raw = body instanceof FormData } = {}) {
  const headers = { "X-Planmark-Form": token, "Accept-Language": document.documentElement.lang };
  if (body !== undefined && !raw) { headers["Content-Type"] = "application/json"; body = JSON.stringify(body); }
  else if (raw && !(body instanceof FormData)) headers["Content-Type"] = "application/octet-stream";
  let response;
  try { response = await fetch(path, { method, headers, body }); } catch { throw { message: texts.gone }; }
  if (response.ok) return response.json();
  const told = await response.json().catch(() => ({}));
  throw { message: told.message || `${response.status} ${response.statusText}`, code: told.code, status: response.status };
}

function tell(place, text, good = false) {
  const there = place || $("message");
  there.textContent = text;
  there.classList.toggle("good", good);
  there.hidden = !text;
}

/** Do something while its button waits; what is refused is told beside it. */
async function doing(button, place, act) {
  tell(place, "");
  if (button) button.disabled = true;
  try { await act(); } catch (error) {
    if (!error.message) throw error;
    tell(place, error.message);
  } finally { if (button) button.disabled = false; }
}

const go = (then, answer) => {
  if (then) location.assign(then.replace(/\{(\w+)\}/g, (_, name) => answer[name]));
  else location.reload();
};

// Forms and buttons -------------------------------------------------------------------------------

function valuesOf(form) {
  const values = {};
  for (const one of form.elements) {
    if (!one.name) continue;
    if (one.type === "checkbox") values[one.name] = one.checked;
    else if ("list" in one.dataset) values[one.name] = one.value.split("\n").map((line) => line.trim()).filter(Boolean);
    else if (one.type === "number") values[one.name] = Number(one.value);
    else if (one.value !== "" || form.dataset.send?.startsWith("PATCH")) values[one.name] = one.value;
  }
  return values;
}

for (const form of document.querySelectorAll("form[data-send]")) {
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const [method, path] = form.dataset.send.split(" "), place = form.querySelector(".said"), values = valuesOf(form);
    doing(event.submitter, place, async () => {
      const answer = await ("query" in form.dataset ? call(method, `${path}?${new URLSearchParams(values)}`) : call(method, path, values));
      if ("query" in form.dataset) tell(place, answer[form.dataset.shows], true);
      else if (form.dataset.shows) tell(place, `${answer.sent.length} ✓ ${Object.entries({ ...answer.refused, ...answer.withheld }).map(([who, why]) => `${who}: ${why.message}`).join("; ")}`, !Object.keys(answer.refused).length);
      else if (form.dataset.told) { form.reset(); tell(place, texts[form.dataset.told], true); } else go(form.dataset.then, answer);
    });
  });
}
$("offer")?.addEventListener("click", (event) => doing(event.target, null, async () => {
  const { secret, picture } = await call("POST", "/api/v1/account/second-factor"), form = $("second-factor");
  form.elements.secret.value = secret;
  form.querySelector("img").src = picture;
  form.hidden = false;
}));
for (const form of document.querySelectorAll("form[data-erase]")) {
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (!confirm(texts.sure)) return;
    const student = encodeURIComponent(form.elements.student.value);
    doing(event.submitter, form.querySelector(".said"), async () => {
      const { kept } = await call("DELETE", form.dataset.erase + student);
      if (kept.length) tell(form.querySelector(".said"), kept.join(", ")); else go();
    });
  });
}
for (const button of document.querySelectorAll("button[data-send]")) {
  button.addEventListener("click", () => {
    if ("sure" in button.dataset && !confirm(texts.sure)) return;
    const [method, path] = button.dataset.send.split(" ");
    doing(button, null, async () => go(button.dataset.then, await call(method, path)));
  });
}
for (const box of document.querySelectorAll("input[data-change]")) {
  box.addEventListener("change", async () => {
    const [method, path] = box.dataset.change.split(" ");
    if (box.checked && box.dataset.warn && !confirm(box.dataset.warn)) { box.checked = false; return; }
    tell(null, "");
    try { await call(method, path, { [box.name]: box.checked }); } catch (error) { box.checked = !box.checked; tell(null, error.message); }
  });
}

for (const button of document.querySelectorAll("[data-copy]")) {
  button.addEventListener("click", () => {
    // Also where there is no https; where it is refused, the address stands selected.
    getSelection().selectAllChildren($(button.dataset.copy));
    if (document.execCommand("copy")) tell(button.parentElement.querySelector("[role=status]"), texts.copied);
  });
}
$("print")?.addEventListener("click", () => print());

// Files -------------------------------------------------------------------------------------------

/** Send files, one after the other; what is refused is listed, and the page shows what is there. */
async function upload(input, files) {
  const box = document.querySelector(".upload"), bar = box?.querySelector("progress"), said = box?.querySelector("[role=status]");
  const refused = [], again = "fixed" in input.dataset || !$("replace")?.checked ? "" : "?replace=true";
  let done = 0;
  if (box) { box.hidden = false; box.querySelector("ul").replaceChildren(); bar.value = 0; }
  for (const [file, name] of files) {
    if (said) said.textContent = `${fill(texts.uploaded, { done, total: files.length })}: ${name}`;
    const path = input.dataset.put + ("fixed" in input.dataset ? "" : name.split("/").map(encodeURIComponent).join("/"));
    try {
      const answer = await call("PUT", path + again, file, { raw: true });
      refused.push(...(answer.refused || []).map((one) => `${one.name}: ${one.message}`));
    } catch (error) { refused.push(`${name}: ${error.message}`); }
    done += 1;
    if (box) bar.value = done / files.length;
  }
  if (!refused.length) { location.reload(); return; }
  if (box) box.querySelector("ul").replaceChildren(...refused.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  if (said) said.textContent = texts.upload_ended;
  tell(null, `${texts.refused} ${refused.slice(0, 5).join("; ")}`);
}
for (const input of document.querySelectorAll("input[data-put]")) {
  input.addEventListener("change", () => upload(input, [...input.files].map((file) => [file, file.webkitRelativePath.split("/").slice(1).join("/") || file.name])));
}

/** The files of what was dropped, with folders; each with its path. */
async function filesOf(entry, before = "") {
  if (entry.isFile) return [[await new Promise((found, failed) => entry.file(found, failed)), before + entry.name]];
  const reader = entry.createReader(), files = [];
  for (;;) {
    const some = await new Promise((found, failed) => reader.readEntries(found, failed));
    if (!some.length) return files;
    for (const one of some) files.push(...await filesOf(one, `${before}${entry.name}/`));
  }
}
for (const place of document.querySelectorAll(".drop")) {
  const over = (event) => { event.preventDefault(); place.classList.toggle("over", event.type === "dragover"); };
  for (const kind of ["dragover", "dragleave", "drop"]) place.addEventListener(kind, over);
  place.addEventListener("drop", async (event) => {
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean);
    upload(place.querySelector("input[multiple]"), (await Promise.all(entries.map((one) => filesOf(one)))).flat());
  });
}

// Self-check --------------------------------------------------------------------------------------

const whole = (name) => { const text = $(`in-${name}`)?.value.trim(); return /^\d{1,6}$/.test(text) ? Number(text) : null; };

/** Tell errors at their fields, texts by the fields' ids; the first of them has the focus. */
function faults(texts) {
  for (const said of document.querySelectorAll(".fault")) {
    const field = said.previousElementSibling;
    field.removeAttribute("aria-invalid");
    field.setAttribute("aria-describedby", field.dataset.described);
    said.remove();
  }
  for (const [id, text] of Object.entries(texts)) {
    const field = $(id), said = Object.assign(document.createElement("p"), { id: `fault-${id}`, className: "said small fault", textContent: text.charAt(0).toUpperCase() + text.slice(1) });
    field.dataset.described = field.getAttribute("aria-describedby") || "";
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-describedby", `${said.id} ${field.dataset.described}`.trim());
    field.after(said);
    field.closest("details")?.setAttribute("open", "");
  }
  document.querySelector("[aria-invalid]")?.focus();
}

/** Do something with what a form holds; what is wrong with a number or with the file is told there. */
function sending(form, button, act) {
  const place = form.querySelector(".said");
  faults({});
  doing(button, place, async () => {
    try { await act(place); } catch (error) {
      const number = /^(n|position)_range$/.exec(error.code)?.[1];
      const field = number ? `in-${number}` : form.id === "photo" && [413, 415, 422].includes(error.status) ? "picture" : "";
      if (!$(field)) throw error;
      tell(place, "");
      faults({ [field]: error.message });
    }
  });
}

function show(form, told) {
  const place = $("result"), parts = [];
  const add = (name, html, text) => { const one = document.createElement(name); if (html) one.innerHTML = html; else one.textContent = text; parts.push(one); return one; };
  for (const problem of told.problems || []) add("p", "", problem).className = "note";
  if (told.is_right) add("p", "", told.is_read ? texts.right_read : texts.right);
  else if (!told.lines.length && !Object.keys(told.fields || {}).length) add("p", "", told.is_read === false ? texts.unread : texts.nothing);
  for (const result of ["off", "open", "right"]) {
    const lines = told.lines.filter((line) => line.result === result);
    if (!lines.length) continue;
    add("h2", "", lines[0].word.charAt(0).toUpperCase() + lines[0].word.slice(1));
    const list = add("ul", "", "");
    list.className = "plain card";
    for (const line of lines) {
      const item = document.createElement("li");
      item.innerHTML = `<span class="badge r-${result}" aria-hidden="true">${line.mark}</span> <b>${line.html}</b> ${line.hint}${line.advice ? `<br><span class="soft">→ ${line.advice}</span>` : ""}`;
      list.append(item);
    }
  }
  for (const drawing of told.drawing || []) add("figure", drawing).className = "drawing";
  place.replaceChildren(...parts);
  place.hidden = !parts.length;
  form.after(place);
  place.focus();
  place.scrollIntoView({ block: "start" });
  faults(Object.fromEntries(Object.entries(told.fields || {}).map(([column, text]) => [`f-${column}`, text])));
  if (told.attempts_left !== null && told.attempts_left !== undefined) $("left").textContent = fill(texts.left, { count: told.attempts_left });
}

$("check")?.addEventListener("submit", (event) => {
  event.preventDefault();
  const form = event.target, cells = {};
  for (const input of form.querySelectorAll("[data-column]")) if (input.value.trim()) cells[input.dataset.column] = input.value.trim();
  $("result").hidden = true;
  sending(form, event.submitter, async () => {
    show(form, await call("POST", `/api/v1/publications/${form.dataset.key}/checks`, { n: whole("n"), position: whole("position"), cells, lang: form.dataset.lang }));
  });
});

$("photo")?.addEventListener("submit", (event) => {
  event.preventDefault();
  const form = event.target, asked = new URLSearchParams({ lang: form.dataset.lang });
  for (const name of ["n", "position"]) if (whole(name) !== null) asked.set(name, whole(name));
  $("result").hidden = true;
  sending(form, event.submitter, async (place) => {
    tell(place, texts.sending, true);
    let job = await call("POST", `/api/v1/publications/${form.dataset.key}/photos?${asked}`, $("picture").files[0], { raw: true });
    while (job.state === "queued" || job.state === "running") {
      tell(place, job.state === "queued" ? fill(texts.waits, { count: job.before }) : texts.looking, true);
      await pause(700);
      job = await call("GET", `/api/v1/photos/${job.key}`);
    }
    if (job.state !== "done") throw { message: job.message, status: 422 };
    tell(place, "");
    show(form, job.result);
  });
});
$("hand-in")?.addEventListener("click", (event) => {
  const form = $("photo"), file = $("picture").files[0];
  if (!file) { form.reportValidity(); return; }
  sending(form, event.target, async (place) => {
    tell(place, texts.sending, true);
    const asked = new URLSearchParams({ name: file.name.slice(0, 200) }), item = document.createElement("li"), sheets = $("sheets");
    const { at, name, code } = await call("POST", `/api/v1/publications/${form.dataset.key}/sheets?${asked}`, file, { raw: true });
    item.append(`${at}: `, Object.assign(document.createElement("bdi"), { textContent: name }), `, ${texts.receipt} `, Object.assign(document.createElement("b"), { textContent: code }));
    sheets.querySelector("ul").append(item);
    sheets.hidden = false;
    tell(place, "");
    item.tabIndex = -1;
    item.focus();
  });
});

// Grading -----------------------------------------------------------------------------------------

const grade = $("grade");
async function follow(path, key) {
  const box = $("job"), bar = box.querySelector("progress"), said = box.querySelector("[role=status]"), cancel = $("cancel");
  grade.disabled = true; box.hidden = false; cancel.hidden = false;
  cancel.onclick = () => call("DELETE", `${path}/${key}`).catch((error) => tell(null, error.message));
  for (;;) {
    const job = await call("GET", `${path}/${key}`);
    if (job.state !== "queued" && job.state !== "running") { location.reload(); return; }
    if (job.total) bar.value = job.done / job.total; else bar.removeAttribute("value");
    const stage = { opening: texts.opening, looking: texts.looking_at, marking: texts.marking }[job.stage];
    said.textContent = job.state === "queued" ? texts.queued : `${stage || ""} ${job.total ? `${job.done} / ${job.total}` : ""}`;
    await pause(1000);
  }
}
if (grade) {
  const path = grade.dataset.job;
  grade.addEventListener("click", () => doing(null, null, async () => follow(path, (await call("POST", path)).key)));
  if (grade.dataset.running) doing(null, null, () => follow(path, grade.dataset.running));
}

$("export")?.addEventListener("submit", (event) => {
  event.preventDefault();
  const form = event.target, place = $("exported"), asked = new URLSearchParams(), files = new FormData();
  const make = (name, known) => Object.assign(document.createElement(name), known);
  for (const [name, value] of new FormData(form)) {
    if (value instanceof File) { if (value.name) files.append(name, value); } else if (value && name !== "platform") asked.set(name, value);
  }
  place.replaceChildren();
  doing(event.submitter, form.querySelector(".said"), async () => {
    const made = await call("POST", `${form.dataset.api}${$("platform").value}?${asked}`, files), list = make("ul", { className: "plain" });
    const link = make("a", { href: made.address, download: made.name, textContent: made.name }), head = make("p", {});
    const left = {};
    for (const state of ["withheld", "unplaced"]) {
      for (const [who, reasons] of Object.entries(made[state])) (left[`${texts[state]}: ${reasons.map((one) => one.message).join(", ")}`] ||= []).push(who);
    }
    const lines = [...made.notes.map((note) => note.message), ...Object.entries(left).map(([why, who]) => `${why}: ${who.join(", ")}`)];
    list.append(...lines.map((textContent) => make("li", { textContent })));
    head.append(made.written.length || Object.keys(left).length ? fill(texts.in_file, { count: made.written.length }) : "", " ", link);
    place.append(head, list);
    link.click();
  });
});

// A platform's activity ----------------------------------------------------------------------------

$("choose")?.addEventListener("submit", (event) => {
  event.preventDefault();
  const form = event.target, key = encodeURIComponent($("publication").value);
  doing(event.submitter, form.querySelector(".said"), async () => {
    const { address, JWT } = await call("POST", `/api/v1/lti/chosen/${form.dataset.name}?key=${key}`);
    if (!JWT) { location.assign(address); return; }
    const back = Object.assign(document.createElement("form"), { method: "post", action: address });
    back.append(Object.assign(document.createElement("input"), { type: "hidden", name: "JWT", value: JWT }));
    document.body.append(back);
    back.submit();
  });
});
