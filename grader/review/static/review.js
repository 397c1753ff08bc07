"use strict";
// The review page: one question after the other, by keys, mouse or touch. Everything that is decided is sent
// to the server at once; nothing is kept here but where one is and what is shown.

const FIRST_GUESS_S = 6, LONGEST_LOOK_S = 60, LOOKS_COUNTED = 20, POLL_MS = 2500;
const INK_MS = 500, EIGHT = 8, MOST_KEPT = 12, KEPT_KEYS = "56789", PART_OF_POINTS = ["partial", "follow_through"];

const state = {
  students: new Map(), rows: new Map(), version: -1, mode: "student", list: [], at: 0, question: null, busy: false,
  comments: [], looks: [], shown: performance.now(), tiles: [], tile: 0, fetched: new Map(), page: null, asked: false, ink: [],
};

// The part of the class that this window shows: `?part=2/3` by student, `?criterion=v_B,v_C` by criterion ------

const address = new URLSearchParams(location.search), wholeClass = { criteria: [] };
const part = { share: /^([1-9]\d*)\/([1-9]\d?)$/.exec(address.get("part") || ""), criteria: (address.get("criterion") || "").split(",").filter(Boolean) };

function isOf(row, { share, criteria }) {
  const isStudent = !share || state.students.get(row.student).place % share[2] === share[1] - 1;
  return isStudent && (!criteria.length || [row.criterion, ...(row.covers || [])].some((name) => criteria.includes(name)));
}

function checkPart() {
  const known = new Set([...state.rows.values()].map((row) => row.criterion)), isAsked = address.get("part") || address.get("criterion");
  const isThere = (!address.get("part") || (part.share && Number(part.share[1]) <= Number(part.share[2]))) && part.criteria.every((name) => known.has(name));
  if (!isThere) { Object.assign(part, { share: null }, wholeClass); advise(texts.no_part); }
  else if (isAsked) $("share").textContent = partName(part);
}

function partName({ share, criteria }) {
  const part = share ? texts.part.replace("{count}", share[1]).replace("{whole}", share[2]) : "";
  return [part, criteria.join(", ")].filter(Boolean).join(" · ") || texts.whole_class;
}

/** How far each part is, and who has decided in it. */
function showShares() {
  const count = Math.min(Math.max(Number($("parts").value) || 2, 2), 99), rows = [...state.rows.values()];
  const shares = Array.from({ length: count }, (_, at) => ({ share: ["", at + 1, count], criteria: [] }));
  const names = [...new Set(rows.filter((row) => isSingle(row) && (isOpen(row) || row.decided)).map((row) => row.criterion))];
  $("share-list").replaceChildren(...[wholeClass, ...shares, ...names.map((name) => ({ criteria: [name] }))].map((one) => {
    const own = rows.filter((row) => isOf(row, one)), settled = own.filter((row) => row.decided), by = new Map(), line = element("tr"), name = element("td");
    for (const row of settled) by.set(row.by || texts.somebody, (by.get(row.by || texts.somebody) || 0) + 1);
    name.append(element("a", { href: one.share ? `?part=${one.share[1]}/${count}` : one.criteria.length ? `?criterion=${one.criteria}` : "?" }, partName(one)), element("div", { class: "small soft" }, [...by].map((each) => each.join(" ")).join(", ")));
    line.append(name, ...[own.filter(isOpen).length, settled.length].map((text) => element("td", { class: "number" }, String(text))));
    return line;
  }));
}

// What there is to decide --------------------------------------------------------------------------

const keyOf = (row) => `${row.student}/${row.criterion}`;
const isOpen = (row) => (row.verdict === "review" && !row.under) || row.asked;
const isSingle = (row) => !row.kind;
const isMine = (row) => isOf(row, part);
const current = () => state.rows.get(state.list[state.at]);
const nameOf = (student) => ($("anonymous").checked ? `${texts.sheet} ${student.number + 1}` : student.label);

function take(data) {
  const changed = new Set(data.students.map((student) => student.key)), there = new Set(data.keys);
  for (const [key, row] of state.rows) {
    if (changed.has(row.student) || !there.has(row.student)) { state.rows.delete(key); state.fetched.delete(key); }
  }
  for (const student of data.students) {
    state.students.set(student.key, student);
    for (const row of student.rows) state.rows.set(keyOf(row), row);
    for (const asked of student.questions) takeQuestion(asked);
  }
  if (data.comments) state.comments = data.comments;
  state.version = data.version;
  $("pages-left").textContent = data.pages ? `(${data.pages})` : "";
  showProgress();
}

function takeQuestion(asked) {
  // A question stands in the place of the rows that it covers.
  const own = state.rows.get(keyOf(asked)), { kind, ...rest } = asked;
  if (kind === "verdict" && own && asked.covers.length === 1) { own.rank = asked.rank; own.settles = asked.settles; return; }
  for (const name of asked.covers) {
    const row = state.rows.get(`${asked.student}/${name}`);
    if (row && name !== asked.criterion) row.under = asked.criterion;
  }
  state.rows.set(keyOf(asked), { ...own, ...rest, kind, order: -1 });
}

function ordered() {
  // Where most points are at stake first: students by the sum of theirs, criteria by the sum of the class.
  const rows = [...state.rows.values()].filter(isMine), sums = new Map();
  const group = state.mode === "student" ? (row) => row.student : (row) => row.criterion;
  for (const row of rows) sums.set(group(row), (sums.get(group(row)) || 0) + (isOpen(row) ? row.stake : 0));
  const inside = state.mode === "student" ? (row) => row.rank ?? 1000 + row.order : (row) => row.probability ?? 0;
  const place = new Map([...sums.keys()].sort((a, b) => sums.get(b) - sums.get(a)).map((name, index) => [name, index]));
  return rows.sort((a, b) => place.get(group(a)) - place.get(group(b)) || inside(a) - inside(b) || state.students.get(a.student).number - state.students.get(b.student).number);
}

function relist(keep) {
  const all = $("all").checked;
  state.list = ordered().filter((row) => all || isOpen(row) || keyOf(row) === keep).map(keyOf);
  if (state.rows.has(keep) && !state.list.includes(keep)) state.list.unshift(keep);
  state.at = Math.max(0, state.list.indexOf(keep));
}

function showProgress() {
  const rows = [...state.rows.values()].filter(isMine), open = rows.filter(isOpen).length;
  const settled = rows.filter((row) => row.decided).length;
  const mean = state.looks.length ? state.looks.reduce((a, b) => a + b) / state.looks.length : FIRST_GUESS_S;
  const minutes = Math.ceil((open * mean) / 60);
  state.asked ||= open > 0;
  $("bar").max = Math.max(1, open + settled);
  $("bar").value = settled;
  $("progress").textContent = open ? texts.left.replace("{open}", open).replace("{minutes}", minutes) : texts.nothing_left;
  $("progress").dataset.open = open;
}

function looked() {
  state.looks.push(Math.min((performance.now() - state.shown) / 1000, LONGEST_LOOK_S));
  state.looks = state.looks.slice(-LOOKS_COUNTED);
}

// One question -------------------------------------------------------------------------------------

const viewer = new Viewer($("view"), (node, x, y) => moveNode(node, x, y));
viewer.onLoad = () => { if (state.question && state.question.look === viewer.look) setReady(true); };

function setReady(isReady) {
  // Keys answer only what is seen: not before the picture is there.
  state.ready = isReady;
  document.body.dataset.ready = isReady ? "1" : "";
}

function fetchQuestion(key) {
  if (!state.fetched.has(key)) {
    const row = state.rows.get(key);
    const wanted = call(`api/question?student=${row.student}&criterion=${encodeURIComponent(row.criterion)}`);
    wanted.catch(() => state.fetched.delete(key));
    state.fetched.set(key, wanted);
  }
  return state.fetched.get(key);
}

async function showQuestion(keepView = false) {
  // A node that was moved may have settled others.
  const place = state.list[state.at];
  state.list = state.list.filter((key) => state.rows.has(key));
  state.at = state.list.indexOf(place);
  const row = current();
  if (!row) { showMode("done"); return; }
  setReady(false);
  const question = await fetchQuestion(keyOf(row));
  if (current() !== row && keyOf(current() || {}) !== keyOf(row)) return;
  const same = state.question && keyOf(state.question) === keyOf(question);
  state.question = question;
  const student = state.students.get(question.student);
  $("who").textContent = nameOf(student);
  $("place").textContent = `${state.at + 1} / ${state.list.length}`;
  showFacts(question);
  $("state").innerHTML = question.state;
  $("sentence").parentElement.hidden = !question.sentence;
  $("why").innerHTML = question.why;
  $("why").hidden = !question.why;
  const accept = $("accept");
  accept.innerHTML = question.accept;
  accept.disabled = isOpen(row) && !question.choices.some((one) => one.default);
  accept.classList.toggle("main", !accept.disabled);
  $("settles").textContent = question.settles || "";
  $("choices").replaceChildren(...question.choices.map((choice, index) => {
    const button = element("button", { type: "button", "data-key": choice.key, "aria-pressed": String(choice.pressed) });
    button.innerHTML = `<kbd>${choice.key}</kbd> ${choice.label}`;
    button.onclick = () => choose(index);
    return button;
  }));
  $("not-judged").disabled = question.choices.some((choice) => choice.answers.length !== 1 || choice.answers[0].criterion !== question.criterion);
  $("look-note").textContent = question.look && question.look.note ? texts[question.look.note] : "";
  if (!same) { $("comment").value = question.comment; $("points").value = question.points ?? ""; }
  $("points").disabled = $("not-judged").disabled;
  $("most").textContent = question.most ? `/ ${question.most}` : "";
  $("score").textContent = student.score;
  $("remark").value = student.remark;
  $("added").value = student.added || "";
  $("comments").replaceChildren(...keptHere().map((kept, index) => {
    const item = element("span"), chip = element("button", { type: "button", title: `${kept.comment}, ${texts.verdicts[kept.verdict]}` });
    chip.innerHTML = `${KEPT_KEYS[index] ? `<kbd>${KEPT_KEYS[index]}</kbd> ` : ""}${kept.label}`;
    chip.onclick = () => useKept(kept);
    const change = element("button", { type: "button", "aria-label": texts.change_comment.replace("{text}", kept.comment) }, "✎");
    change.onclick = () => showKept(kept);
    item.append(chip, change);
    return item;
  }));
  setReady(!question.look);
  if (question.look) {
    const view = viewer.view;
    viewer.show(question.look);
    if (keepView && same && view) { viewer.fit(view); viewer.refine(); }
  }
  document.body.dataset.shown = `${keyOf(row)} ${state.version}`;
  state.shown = performance.now();
  const next = state.list[state.at + 1];
  if (next) fetchQuestion(next).catch(() => {});
}

function step(by) {
  if (state.mode === "eight") { focusTile(state.tile + by); return; }
  const to = state.at + by;
  if (to < 0 || to >= state.list.length) { if (to > 0) showMode("done"); return; }
  state.at = to;
  showQuestion().catch(failed);
}

function onward() {
  // To what is still open of this student, in its new order; then on in the list as it stood.
  const student = state.question ? state.question.student : "", all = $("all").checked;
  const place = state.list[state.at], before = state.list.slice(0, state.at + 1), after = state.list.slice(state.at + 1);
  const mine = ordered().filter((row) => row.student === student && (all || isOpen(row))).map(keyOf);
  const isOther = (key) => !key.startsWith(`${student}/`) && state.rows.has(key);
  const seen = before.filter((key) => state.rows.has(key) && !(mine.includes(key) && isOpen(state.rows.get(key))));
  const rest = state.mode === "student" ? [...mine.filter((key) => !seen.includes(key)), ...after.filter(isOther)] : after.filter((key) => state.rows.has(key));
  state.list = [...seen, ...rest];
  const from = Math.max(seen.lastIndexOf(place) + 1, 0), isNext = (key) => all || isOpen(state.rows.get(key));
  let next = state.list.findIndex((key, at) => at >= Math.min(from, seen.length) && isNext(key) && key !== place);
  if (next < 0) { relist(); next = state.list.findIndex((key) => isOpen(state.rows.get(key)) && key !== place); }
  if (next < 0 && state.rows.has(place) && isOpen(state.rows.get(place))) next = state.list.indexOf(place);
  if (next < 0) { showMode("done"); return; }
  state.at = next;
  showQuestion().catch(failed);
}

function failed(error) {
  if (error instanceof Error) throw error;
  if (error.clash) {
    const again = async () => { tell(""); state.fetched.clear(); take(await call("api/class")); await refreshScreen(); };
    tell(error.message, [[texts.look_again, () => busy(again)]]);
  } else advise(error.message);
}

function answerOf(question, verdict) {
  return { student: question.student, criterion: question.criterion, verdict, seen: question.seen };
}

/** An answer with the comment and the points that are written beside it; a verdict of all or nothing has none. */
function withWords(answer) {
  const isPart = PART_OF_POINTS.includes(answer.verdict) && !$("points").disabled, points = $("points").value;
  return {
    comment: answer.criterion.startsWith("node:") ? "" : $("comment").value.trim(), points: isPart && points !== "" ? Number(points) : null, ...answer,
  };
}

function send(answers) {
  return busy(async () => {
    take(await call("api/decide", { answers: answers.map(withWords) }));
    looked(); showProgress(); tell("");
    onward();
  });
}

function choose(index) {
  const choice = state.question && state.question.choices[index];
  if (choice) send(choice.answers);
}

function notJudged() {
  if (!state.question || $("not-judged").disabled) return;
  send([{ ...state.question.choices[0].answers[0], verdict: "not_judged" }]);
}

function accept() {
  const question = state.question, row = current();
  if (!question || !row) return;
  if (!isOpen(row)) { busy(async () => onward()); return; }
  const index = question.choices.findIndex((one) => one.default);
  if (index < 0) { advise(texts.choose); return; }
  choose(index);
}

function saveComment() {
  const row = current();
  if (!row || isOpen(row)) { document.activeElement.blur(); return; }
  busy(async () => {
    take(await call("api/decide", { answers: [withWords(answerOf(state.question, row.verdict))] }));
    advise(texts.saved);
    document.activeElement.blur();
    await showQuestion(true);
  });
}

// Comments kept for reuse --------------------------------------------------------------------------

/** The comments that were given to the criterion before; none where a question is about more than its verdict. */
function keptHere() {
  return $("not-judged").disabled ? [] : state.comments.filter((one) => one.criterion === state.question.criterion).slice(0, MOST_KEPT);
}

function useKept({ verdict, comment, points }) {
  if (state.ready) send([{ ...answerOf(state.question, verdict), comment, points }]); else tell(texts.wait);
}

function showKept(kept) {
  const isPart = PART_OF_POINTS.includes(kept.verdict), { criterion, verdict, comment, points, students } = kept;
  $("kept-what").innerHTML = `${state.question.title}: ${kept.label}`;
  $("kept-words").value = comment;
  $("kept-points").value = points ?? "";
  $("kept-points").disabled = !isPart;
  $("kept-count").textContent = kept.changes;
  $("kept-list").replaceChildren(...students.map((key) => element("li", {}, nameOf(state.students.get(key)))));
  $("kept-save").onclick = () => busy(async () => {
    const worth = isPart && $("kept-points").value !== "" ? Number($("kept-points").value) : null;
    take(await call("api/comment", { criterion, verdict, comment, points, students, words: $("kept-words").value.trim(), worth }));
    state.question = null;
    await refreshScreen();
  });
  $("kept").showModal();
}

function undo() {
  if (state.ink.length) { state.ink = []; return showQuestion(true); }
  return busy(async () => {
    const data = await call("api/undo", {});
    if (!data.undone) { advise(texts.nothing_to_undo); return; }
    take(data); tell("");
    if (state.mode === "eight") { showEight(data.undone); return; }
    const undone = state.rows.get(data.undone);
    if (undone && undone.under) data.undone = `${undone.student}/${undone.under}`;
    if (!state.rows.has(data.undone)) { await refreshScreen(); return; }
    if (!state.list.includes(data.undone)) relist(data.undone);
    state.at = state.list.indexOf(data.undone);
    showSection("question");
    state.question = null;
    await showQuestion();
  });
}

function moveNode(node, x, y) {
  return busy(async () => {
    const question = state.question, started = performance.now();
    try {
      take(await call("api/node", { student: question.student, sheet: question.look.sheet, node, x, y, seen: question.look.nodes.find((one) => `${one.figure}:${one.name}` === node).seen }));
    } finally {
      if (state.rows.has(keyOf(question))) await showQuestion(true); else onward();
    }
    document.body.dataset.nodeMs = Math.round(performance.now() - started);
  });
}

// Ink ----------------------------------------------------------------------------------------------

/** Post the strokes that wait: a hand that writes is not kept waiting, and one undo takes a word back. */
function sendInk() {
  clearTimeout(state.inkTimer);
  if (state.busy) { state.inkTimer = setTimeout(sendInk, INK_MS); return; }
  const [first] = state.ink, isSame = (one) => one.student === first.student && one.sheet === first.sheet;
  const now = state.ink.filter(isSame);
  state.ink = state.ink.filter((one) => !isSame(one));
  busy(async () => {
    try { take(await call("api/ink", { student: first.student, sheet: first.sheet, strokes: now.map((one) => one.stroke).filter(Boolean) })); }
    catch (error) { await showQuestion(true); throw error; }
    if (!first.stroke) await showQuestion(true);
    if (state.ink.length) state.inkTimer = setTimeout(sendInk, INK_MS);
  });
}

function addInk(points) {
  const { student, look } = state.question;
  if (!points) state.ink = [];
  state.ink.push({ student, sheet: look.sheet, stroke: points && points.map(({ x, y }) => [x, y]) });
  clearTimeout(state.inkTimer);
  state.inkTimer = setTimeout(sendInk, points ? INK_MS : 0);
}

function takePen() {
  viewer.onStroke = viewer.onStroke ? null : addInk;
  $("pen").setAttribute("aria-pressed", String(Boolean(viewer.onStroke)));
  $("wipe").hidden = !viewer.onStroke;
}

// Eight to a screen --------------------------------------------------------------------------------

function showEight(keep) {
  const open = ordered().filter((row) => isOpen(row) && isSingle(row));
  const first = keep && state.rows.get(keep) ? state.rows.get(keep) : open[0];
  if (!first) { showMode("done"); return; }
  const same = open.filter((row) => row.criterion === first.criterion).slice(0, EIGHT);
  state.tiles = (same.length ? same : [first]).map(keyOf);
  $("eight-title").innerHTML = first.title;
  $("tiles").replaceChildren(...state.tiles.map((key, index) => tileOf(key, index)));
  focusTile(0);
}

function tileOf(key, index) {
  const row = state.rows.get(key), tile = element("div", { class: "tile", tabindex: "-1", "data-key": key });
  const svg = svgElement("svg"), about = element("p"), buttons = element("div", { class: "row" });
  about.append(element("b", {}, nameOf(state.students.get(row.student))));
  const said = element("span", { class: "soft" });
  about.append(" ", said);
  Object.values(VERDICT_KEYS).filter((verdict) => verdict !== "not_judged").forEach((verdict) => {
    const button = element("button", { type: "button", "data-verdict": verdict, title: texts.verdicts[verdict], "aria-label": texts.verdicts[verdict] });
    button.append(element("span", { class: `badge v-${verdict}` }, texts.marks[verdict]));
    button.onclick = () => { focusTile(index); decideTiles([index], verdict); };
    buttons.append(button);
  });
  const acceptButton = element("button", { type: "button" });
  acceptButton.onclick = () => { focusTile(index); decideTiles([index]); };
  tile.append(svg, about, acceptButton, buttons);
  tile.onclick = (event) => { if (!event.target.closest("button")) focusTile(index); };
  fetchQuestion(key).then((question) => {
    said.innerHTML = question.brief;
    acceptButton.innerHTML = question.accept;
    acceptButton.disabled = !question.proposed;
    if (question.look) {
      const small = new Viewer(svg, () => {});
      small.show({ ...question.look, nodes: [] });
    }
  }).catch(failed);
  return tile;
}

function focusTile(index) {
  if (!state.tiles.length) return;
  state.tile = Math.min(Math.max(index, 0), state.tiles.length - 1);
  [...$("tiles").children].forEach((tile, at) => tile.classList.toggle("now", at === state.tile));
  const tile = $("tiles").children[state.tile];
  tile.focus({ preventScroll: true });
  tile.scrollIntoView({ block: "nearest" });
}

function decideTiles(indices, verdict) {
  return busy(async () => {
    const open = indices.map((index) => state.tiles[index]).filter((key) => state.rows.get(key) && (verdict || isOpen(state.rows.get(key))));
    const questions = await Promise.all(open.map(fetchQuestion));
    const answers = questions.filter((question) => verdict || question.proposed).map((question) => ({
      student: question.student, criterion: question.criterion, verdict: verdict || question.proposed, comment: "", seen: question.seen,
    }));
    if (!answers.length) { tell(texts.choose); return; }
    take(await call("api/decide", { answers }));
    looked(); showProgress(); tell("");
    state.tiles.forEach((key, at) => $("tiles").children[at].classList.toggle("settled", !isOpen(state.rows.get(key) || {})));
    const next = state.tiles.findIndex((key) => isOpen(state.rows.get(key) || {}));
    if (next < 0) showEight(); else focusTile(next);
  });
}

// Sure proposals -----------------------------------------------------------------------------------

function sureOnes() {
  const least = Number($("least").value) / 100;
  return [...state.rows.values()].filter((row) => isMine(row) && isOpen(row) && isSingle(row) && row.proposed && row.probability !== null && row.probability >= least);
}

function showSure() {
  const rows = sureOnes();
  $("sure-count").textContent = texts.settles.replace("{count}", rows.length);
  $("sure-list").replaceChildren(...rows.map((row) => {
    const item = element("li"), what = element("span");
    what.innerHTML = row.title;
    item.append(element("span", { class: `badge v-${row.proposed}` }, texts.marks[row.proposed]), ` ${nameOf(state.students.get(row.student))}: `, what, ` – ${texts.verdicts[row.proposed]}, ${Math.floor(100 * row.probability)} %`);
    return item;
  }));
  $("sure-accept").textContent = texts.accept_all.replace("{count}", rows.length);
  $("sure-accept").disabled = !rows.length;
}

function acceptSure() {
  return busy(async () => {
    const answers = sureOnes().map((row) => ({ student: row.student, criterion: row.criterion, verdict: row.proposed, comment: "", seen: row.seen }));
    take(await call("api/decide", { answers }));
    $("sure").close();
    await refreshScreen();
  });
}

// Pages --------------------------------------------------------------------------------------------

const pageViewer = { turn: 0, corners: [] };

async function showPages() {
  const data = await call("api/pages");
  $("no-pages").hidden = data.pages.length > 0;
  $("read-again").hidden = !data.pages.length;
  $("page-form").hidden = true;
  $("idle").hidden = !data.idle.length;
  $("idle-list").replaceChildren(...data.idle.map((text) => element("li", {}, text)));
  $("page-list").replaceChildren(...data.pages.map((page) => {
    const item = element("li"), button = element("button", { type: "button" }, page.label + (page.said ? ` – ${page.said}` : ""));
    button.onclick = () => showPage(page, button);
    item.append(button);
    return item;
  }));
  $("owner").replaceChildren(element("option", { value: "" }, "–"), ...data.owners.map((owner) => element("option", { value: owner.key }, owner.label)));
  if (data.pages.length) showPage(data.pages[0], $("page-list").querySelector("button"));
}

function showPage(page, button) {
  state.page = page;
  for (const one of $("page-list").querySelectorAll("button")) one.setAttribute("aria-current", String(one === button));
  $("page-form").hidden = false;
  $("page-why").textContent = page.why;
  $("owner").value = page.owner;
  pageViewer.turn = page.turn;
  pageViewer.corners = page.corners.length ? page.corners : null;
  $("corners").checked = page.corners.length > 0;
  drawPage();
}

function drawPage() {
  const { width, height, picture } = state.page, svg = $("page-view"), turned = svgElement("g");
  const flips = pageViewer.turn % 180 !== 0, wide = flips ? height : width, high = flips ? width : height;
  svg.replaceChildren(turned);
  if (!width) return;
  svg.setAttribute("viewBox", [-0.03 * wide, -0.03 * high, 1.06 * wide, 1.06 * high].join(" "));
  const shift = { 0: "", 90: `translate(0 ${width})`, 180: `translate(${width} ${height})`, 270: `translate(${height} 0)` }[pageViewer.turn];
  turned.setAttribute("transform", `${shift} rotate(${-pageViewer.turn})`);
  turned.append(svgElement("image", { width, height, href: picture, preserveAspectRatio: "none" }));
  if (!$("corners").checked) return;
  if (!pageViewer.corners) {
    const box = [[0, 0], [width, 0], [width, height], [0, height]].map(([x, y]) => [0.06 * width + 0.88 * x, 0.06 * height + 0.88 * y]);
    pageViewer.corners = [...box, ...box].slice(pageViewer.turn / 90, pageViewer.turn / 90 + 4);
  }
  const size = Math.max(width, height), outline = svgElement("polygon", { class: "outline", "stroke-width": size / 500 });
  const redraw = () => outline.setAttribute("points", pageViewer.corners.map((at) => at.join(",")).join(" "));
  redraw();
  turned.append(outline);
  pageViewer.corners.forEach((corner, index) => {
    const handle = svgElement("circle", { class: "handle", r: size / 45, "stroke-width": size / 400, tabindex: 0, role: "button", "aria-label": `${texts.corner} ${index + 1}` });
    const set = (x, y) => {
      pageViewer.corners[index] = [Math.min(Math.max(x, 0), width - 1), Math.min(Math.max(y, 0), height - 1)];
      handle.setAttribute("cx", pageViewer.corners[index][0]); handle.setAttribute("cy", pageViewer.corners[index][1]);
      redraw();
    };
    set(corner[0], corner[1]);
    handle.onpointerdown = (event) => { handle.setPointerCapture(event.pointerId); handle.dataset.held = "1"; };
    handle.onpointerup = () => { delete handle.dataset.held; };
    handle.onpointermove = (event) => {
      if (!handle.dataset.held) return;
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(turned.getScreenCTM().inverse());
      set(at.x, at.y);
    };
    handle.onkeydown = (event) => {
      const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!by) return;
      const pace = (event.shiftKey ? 0.02 : 0.002) * size;
      set(pageViewer.corners[index][0] + pace * by[0], pageViewer.corners[index][1] + pace * by[1]);
      event.preventDefault(); event.stopPropagation();
    };
    turned.append(handle);
  });
}

function turnPage(by) {
  // The corners go round with the sheet: the first is the upright sheet's top left one.
  pageViewer.turn = (pageViewer.turn + by + 360) % 360;
  if (pageViewer.corners) { const [a, b, c, d] = pageViewer.corners; pageViewer.corners = by > 0 ? [b, c, d, a] : [d, a, b, c]; }
  drawPage();
}

function savePage() {
  return busy(async () => {
    const page = state.page;
    take(await call("api/page", {
      file: page.file, page: page.page, seen: page.seen, owner: $("owner").value || null, turn: pageViewer.turn === page.upright ? null : pageViewer.turn,
      corners: $("corners").checked ? pageViewer.corners : [],
    }));
    await showPages();
    advise(texts.page_saved);
  });
}

// Finished -----------------------------------------------------------------------------------------

function showDone() {
  const all = [...state.rows.values()].filter(isOpen), open = all.filter(isMine).length;
  const settled = all.length ? texts.part_settled.replace("{open}", all.length) : texts.all_settled;
  $("done-title").textContent = open ? texts.still_open.replace("{open}", open) : settled;
  $("done-text").textContent = all.length ? texts.can_finish : texts.now_finish;
  $("finish").focus();
  // The last question was settled here; whoever opens a settled class is left in peace.
  if (!all.length && state.asked) { state.asked = false; setTimeout(finish); }
}

function finish() {
  return busy(async () => {
    $("finish").disabled = true;
    $("finished").hidden = true;
    try {
      await call("api/finish", {});
      let data;
      do {
        await new Promise((later) => setTimeout(later, 250));
        data = await call("api/finish");
        $("finish-progress").textContent = data.progress;
      } while (data.running);
      if (data.message) throw data;
      if (data.to) { location.assign(data.to); return; }
      state.fetched.clear(); state.rows.clear(); state.students.clear();
      take(await call("api/class"));
      $("finish-progress").textContent = data.summary;
      $("changes").replaceChildren(...data.changes.map((text) => element("li", {}, text)));
      $("results").replaceChildren(...data.files.map((file) => {
        const item = element("li"), link = element("a", { href: file.href, target: "_blank", rel: "noopener" }, file.label);
        item.append(link, ` ${file.path}`);
        return item;
      }));
      $("commands").textContent = data.commands.join("\n");
      $("finished").hidden = false;
      document.body.dataset.finished = "1";
    } finally { $("finish").disabled = false; }
  });
}

// Screens ------------------------------------------------------------------------------------------

function showSection(id) {
  for (const section of document.querySelectorAll("main > section")) section.hidden = section.id !== id;
  for (const button of document.querySelectorAll("#top nav button")) {
    const mode = id === "question" || id === "eight" ? state.mode : id;
    button.setAttribute("aria-current", String(button.dataset.mode === mode));
  }
}

async function refreshScreen() {
  if (!$("done").hidden) { showDone(); return; }
  if (!$("pages").hidden) return;
  if (state.mode === "eight") { showEight(); return; }
  relist(state.list[state.at]);
  if (!state.list.length) showMode("done"); else await showQuestion();
}

function showMode(mode) {
  if (mode === "done") { showSection("done"); showDone(); return; }
  if (mode === "pages") { showSection("pages"); showPages().catch(failed); return; }
  state.mode = mode;
  if (mode === "eight") { showSection("eight"); showEight(); return; }
  const keep = state.question ? keyOf(state.question) : undefined;
  relist(state.rows.get(keep) && ($("all").checked || isOpen(state.rows.get(keep))) ? keep : undefined);
  if (!state.list.length) { showMode("done"); return; }
  showSection("question");
  showQuestion().catch(failed);
}

function jumps() {
  $("jump").replaceChildren(element("option", { value: "" }, "–"), ...[...state.students.values()].map((student) => element("option", { value: student.key }, `${nameOf(student)} ${student.score}`)));
}

// Keys ---------------------------------------------------------------------------------------------

document.addEventListener("keydown", (event) => {
  const field = event.target.closest("input, textarea, select");
  if (field) {
    if (event.key === "Escape") field.blur();
    else if (event.key === "Enter" && !event.shiftKey && ["comment", "points"].includes(field.id)) { event.preventDefault(); saveComment(); }
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
  const onButton = event.target.closest("button, summary, a") && (event.key === "Enter" || event.key === " ");
  if (onButton || event.repeat) return;
  const asks = !$("question").hidden, eight = !$("eight").hidden;
  const acts = {
    Enter: () => (eight ? decideTiles([state.tile]) : accept()), ArrowRight: () => step(1), ArrowLeft: () => step(-1),
    c: () => { if (asks) { $("comment").focus(); $("comment").select(); } }, u: undo, " ": hideMarks, "+": () => viewer.zoom(0.7), "=": () => viewer.zoom(0.7),
    "-": () => viewer.zoom(1.4), f: () => viewer.whole(), a: () => { if (eight) decideTiles([...state.tiles.keys()]); },
  };
  // Keyboards of other alphabets have other letters on the same keys.
  const isForeign = event.key.length === 1 && event.key > "\u007f" && event.code.startsWith("Key");
  const letter = isForeign ? event.code.slice(3) : event.key;
  const key = letter.length === 1 ? letter.toLowerCase() : letter, verdict = VERDICT_KEYS[event.key];
  if (!asks && !eight && key !== "u") return;
  const place = asks && state.question && state.question.kind === "node" ? "abc".indexOf(key) : -1;
  const kept = asks && key.length === 1 ? keptHere()[KEPT_KEYS.indexOf(key)] : undefined;
  const answers = verdict || kept || key === "Enter" || (place >= 0 && key.length === 1);
  if (asks && answers && !state.ready) { event.preventDefault(); tell(texts.wait); return; }
  if (verdict && eight) { if (verdict !== "not_judged") decideTiles([state.tile], verdict); }
  else if (verdict) { if (verdict === "not_judged") notJudged(); else choose(Number(event.key) - 1); }
  else if (kept) useKept(kept);
  else if (place >= 0 && key.length === 1) choose(place);
  else if (acts[key]) acts[key]();
  else return;
  event.preventDefault();
});

$("accept").onclick = accept;
$("not-judged").onclick = notJudged;
for (const button of document.querySelectorAll("#top nav button")) button.onclick = () => showMode(button.dataset.mode);
$("back").onclick = () => step(-1);
$("on").onclick = () => step(1);
$("undo").onclick = undo;
$("eight-undo").onclick = undo;
$("hide").onclick = hideMarks;
$("pen").onclick = takePen;
$("wipe").onclick = () => addInk(null);
$("closer").onclick = () => viewer.zoom(0.7);
$("wider").onclick = () => viewer.zoom(1.4);
$("whole").onclick = () => viewer.whole();
$("accept-shown").onclick = () => decideTiles([...state.tiles.keys()]);
$("proposals").onclick = () => { $("settings").open = false; showSure(); $("sure").showModal(); };
$("share").onclick = () => { showShares(); $("shared").showModal(); };
$("parts").oninput = showShares;
$("least").oninput = showSure;
$("sure-accept").onclick = acceptSure;
$("turn-left").onclick = () => turnPage(90);
$("turn-right").onclick = () => turnPage(-90);
$("corners").onchange = drawPage;
$("save-page").onclick = savePage;
$("read-again").onclick = () => { showMode("done"); finish(); };
$("finish").onclick = finish;
$("save-whole").onclick = () => busy(async () => {
  const student = state.question.student;
  take(await call("api/whole", { student, comment: $("remark").value.trim(), added: Number($("added").value) || 0, seen: state.students.get(student).seen }));
  advise(texts.saved);
  await showQuestion(true);
});
$("by").value = $("by").readOnly ? document.body.dataset.by : stored.get("by", document.body.dataset.by);
$("by").onchange = () => stored.set("by", $("by").value.trim());
$("anonymous").checked = stored.get("anonymous", "") === "1";
$("anonymous").onchange = () => { stored.set("anonymous", $("anonymous").checked ? "1" : ""); jumps(); refreshScreen().catch(failed); };
$("all").onchange = () => refreshScreen().catch(failed);
$("settings").ontoggle = () => { if ($("settings").open) jumps(); };
function goTo(key) {
  $("all").checked = true; state.mode = "student"; $("settings").open = false;
  relist(key);
  showSection("question");
  showQuestion().catch(failed);
}

$("jump").onchange = () => {
  const wanted = $("jump").value;
  if (wanted) goTo([...state.rows.values()].filter((row) => row.student === wanted).map(keyOf)[0]);
};

async function poll() {
  try {
    const data = await call(`api/class?since=${state.version}`);
    if (data.students.length && !state.busy) {
      const shown = state.question && keyOf(state.question), before = shown && state.rows.get(shown);
      take(data);
      const after = shown && state.rows.get(shown);
      if (before && after && before.seen !== after.seen && !$("question").hidden && $("note").hidden) tell(texts.changed, [[texts.look_again, () => { tell(""); showQuestion().catch(failed); }]]);
    }
  } catch { /* told when something is decided */ }
  setTimeout(poll, POLL_MS);
}

(async () => {
  take(await call("api/class"));
  checkPart();
  showProgress();
  relist();
  const first = state.list.find((key) => state.rows.get(key).student === address.get("student"));
  if (first) state.question = state.rows.get(first);
  const linked = decodeURIComponent(location.hash.slice(1));
  if (state.rows.has(linked)) goTo(linked); else showMode("student");
  setTimeout(poll, POLL_MS);
})().catch(failed);
