"use strict";
// What the pages of the review and of the audit share: calls of the server, messages, a view of a scan.
// Each page has a `state` that says whether it is busy, and `failed`, which tells an error.

const $ = (id) => document.getElementById(id);
const texts = JSON.parse($("texts").textContent);
const SVG = "http://www.w3.org/2000/svg";
const VERDICT_KEYS = { 1: "full", 2: "partial", 3: "none", 4: "follow_through", 0: "not_judged" };
const SETTLE_MS = 160, MOST_POINTS = 250;
const stored = {
  get: (name, otherwise) => { try { return localStorage.getItem(`planmark-${name}`) ?? otherwise; } catch { return otherwise; } },
  set: (name, value) => { try { localStorage.setItem(`planmark-${name}`, value); } catch { /* not kept */ } },
};
let windowId = Math.random().toString(36).slice(2) + Date.now().toString(36);
try { windowId = sessionStorage.planmarkWindow ??= windowId; } catch { /* a page opened anew takes nothing back */ }

// The server ---------------------------------------------------------------------------------------

/** The name of the person who decides. */
const decider = () => ($("by") ? $("by").value.trim() : stored.get("by", document.body.dataset.by));

async function call(path, body) {
  const options = body === undefined ? {} : {
    method: "POST", body: JSON.stringify({ window: windowId, by: decider(), ...body }),
    headers: { "Content-Type": "application/json", "X-Planmark": "review" },
  };
  let answer;
  try { answer = await fetch(path, options); } catch { throw { message: texts.gone }; }
  const data = await answer.json().catch(() => ({}));
  if (!answer.ok) throw { status: answer.status, message: data.message || answer.statusText, ...data };
  return data;
}

function tell(message, buttons = []) {
  const note = $("note");
  note.replaceChildren(document.createTextNode(message || ""));
  for (const [text, act] of buttons) {
    const button = element("button", { type: "button" }, text);
    button.onclick = act;
    note.append(" ", button);
  }
  note.hidden = !message;
}

/** Tell something that the reader may close. */
const advise = (message) => tell(message, [[texts.close, () => tell("")]]);

function element(name, attributes = {}, text = "") {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text) made.textContent = text;
  return made;
}

function svgElement(name, attributes = {}) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// A view of a scan ---------------------------------------------------------------------------------

class Viewer {
  constructor(svg, onNode) {
    this.svg = svg; this.onNode = onNode; this.pointers = new Map(); this.view = null;
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 60) * 0.004), this.point(event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => this.down(event));
    svg.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, (event) => this.up(event));
    new ResizeObserver(() => { if (this.view) { this.fit(this.view); this.refine(); } }).observe(svg);
  }

  show(look) {
    this.look = look; this.drag = null; this.pointers.clear();
    delete this.svg.dataset.loaded;
    this.svg.replaceChildren();
    this.base = svgElement("image", { preserveAspectRatio: "none" }); this.fine = this.base.cloneNode();
    this.marks = svgElement("g", { class: "marks" });
    this.marks.innerHTML = look.marks || "";
    this.nodes = svgElement("g", { class: "nodes" });
    this.ink = svgElement("g", { class: "ink" });
    this.ink.innerHTML = look.ink || "";
    this.svg.append(this.base, this.fine, this.marks, this.nodes, this.ink);
    for (const node of look.nodes || []) this.addNode(node);
    const [x, y, w, h] = look.box;
    this.fit({ x, y, w, h });
    this.place(this.base, this.visible(1.0));
  }

  addNode(node) {
    const title = svgElement("title");
    const circle = svgElement("circle", { class: "node", tabindex: 0, role: "button", "aria-label": `${texts.node} ${node.label}`, cx: node.x, cy: node.y });
    circle.dataset.node = `${node.figure}:${node.name}`;
    title.textContent = node.label;
    circle.append(title);
    circle.addEventListener("keydown", (event) => this.nudge(event, circle));
    this.nodes.append(circle);
  }

  nudge(event, circle) {
    const step = event.shiftKey ? 1.0 : 0.2, by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (by) {
      circle.setAttribute("cx", Number(circle.getAttribute("cx")) + step * by[0]);
      circle.setAttribute("cy", Number(circle.getAttribute("cy")) + step * by[1]);
    } else if (event.key === "Enter") {
      this.onNode(circle.dataset.node, Number(circle.getAttribute("cx")), Number(circle.getAttribute("cy")));
    } else return;
    event.preventDefault(); event.stopPropagation();
  }

  fit(view) {
    const { width, height } = this.svg.getBoundingClientRect();
    if (!width || !height) { this.view = view; return; }
    const w = Math.max(view.w, (view.h * width) / height), h = (w * height) / width;
    this.view = { x: view.x + view.w / 2 - w / 2, y: view.y + view.h / 2 - h / 2, w, h };
    this.svg.setAttribute("viewBox", [this.view.x, this.view.y, w, h].join(" "));
    const mm = w / width;
    for (const circle of this.nodes ? this.nodes.children : []) {
      circle.setAttribute("r", 11 * mm); circle.setAttribute("stroke-width", 1.6 * mm);
    }
  }

  visible(margin) {
    const [wide, high] = this.look.page_mm, { x, y, w, h } = this.view;
    const left = Math.max(0, x - (margin - 1) * w / 2), top = Math.max(0, y - (margin - 1) * h / 2);
    const right = Math.min(wide, x + (w * (1 + margin)) / 2), bottom = Math.min(high, y + (h * (1 + margin)) / 2);
    return { x: left, y: top, w: Math.max(1, right - left), h: Math.max(1, bottom - top) };
  }

  place(image, part) {
    const { width } = this.svg.getBoundingClientRect();
    if (!this.look.scan || !width) return;
    const scale = (width * (window.devicePixelRatio || 1)) / this.view.w;
    const query = new URLSearchParams({
      x: part.x.toFixed(2), y: part.y.toFixed(2), w: part.w.toFixed(2), h: part.h.toFixed(2), scale: Math.min(scale, 60).toFixed(2),
    });
    const loader = new Image();
    loader.onload = () => {
      for (const [name, value] of [["x", part.x], ["y", part.y], ["width", part.w], ["height", part.h]]) image.setAttribute(name, Number(value.toFixed(2)));
      image.setAttribute("href", loader.src);
      this.loaded();
    };
    loader.onerror = () => { if (this.svg.id === "view") advise(texts.no_picture); this.loaded(); };
    loader.src = `${this.look.scan}&${query}`;
  }

  loaded() {
    this.svg.dataset.loaded = this.look.scan;
    if (this.onLoad) this.onLoad();
  }

  refine() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { if (this.look) this.place(this.fine, this.visible(1.3)); }, SETTLE_MS);
  }

  point(event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return { x: at.x, y: at.y };
  }

  zoom(factor, about = null) {
    if (!this.look) return;
    const { x, y, w, h } = this.view, centre = about || { x: x + w / 2, y: y + h / 2 };
    const most = 1.3 * Math.max(...this.look.page_mm), wide = Math.min(Math.max(w * factor, 4), most), f = wide / w;
    this.fit({ x: centre.x - (centre.x - x) * f, y: centre.y - (centre.y - y) * f, w: wide, h: h * f });
    this.refine();
  }

  whole() {
    if (!this.look) return;
    const isWhole = this.view.w >= 0.98 * this.look.page_mm[0], [x, y, w, h] = this.look.box;
    this.fit(isWhole ? { x, y, w, h } : { x: 0, y: 0, w: this.look.page_mm[0], h: this.look.page_mm[1] });
    this.refine();
  }

  down(event) {
    if (!this.look) return;
    this.svg.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.line) { this.line.remove(); this.line = null; } // a second finger zooms
    else if (this.onStroke && this.pointers.size === 1) {
      this.line = svgElement("polyline", { class: "stroke" }); this.points = [this.point(event)];
      this.ink.append(this.line);
    }
    const node = event.target.closest(".node");
    // A node that cannot be saved now does not move.
    this.drag = node && this.pointers.size === 1 && !state.busy ? node : null;
    this.moved = false;
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last || !this.look) return;
    if (this.line) { this.draw(this.point(event)); return; }
    const mm = this.view.w / this.svg.getBoundingClientRect().width;
    const by = { x: (event.clientX - last.x) * mm, y: (event.clientY - last.y) * mm };
    if (this.drag) {
      const at = this.point(event);
      this.moved = true;
      this.drag.setAttribute("cx", at.x); this.drag.setAttribute("cy", at.y);
    } else if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(last.x - other.x, last.y - other.y), after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 5 && after > 5) this.zoom(before / after, this.point({ clientX: (event.clientX + other.x) / 2, clientY: (event.clientY + other.y) / 2 }));
      this.fit({ ...this.view, x: this.view.x - by.x / 2, y: this.view.y - by.y / 2 });
    } else this.fit({ ...this.view, x: this.view.x - by.x, y: this.view.y - by.y });
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  /** Draw on to a point, inside the sheet; points of a long stroke are farther apart. */
  draw(at) {
    const [wide, high] = this.look.page_mm, last = this.points.at(-1), next = { x: Math.min(Math.max(at.x, 0), wide), y: Math.min(Math.max(at.y, 0), high) };
    if (Math.hypot(next.x - last.x, next.y - last.y) < 0.3) return;
    this.points.push(next);
    if (this.points.length > MOST_POINTS) this.points = this.points.filter((_, index) => index % 2 === 0);
    this.line.setAttribute("points", this.points.map(({ x, y }) => `${x},${y}`).join(" "));
  }

  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    if (this.line) { this.line = null; if (this.points.length > 1) this.onStroke(this.points); return; }
    if (this.drag && this.moved) this.onNode(this.drag.dataset.node, Number(this.drag.getAttribute("cx")), Number(this.drag.getAttribute("cy")));
    else if (!this.drag) this.refine();
    this.drag = null;
  }
}

// One question -------------------------------------------------------------------------------------

/** Show what both pages tell of a question. */
function showFacts(question) {
  $("what").innerHTML = question.title;
  $("sentence").innerHTML = question.sentence;
  $("numbers").replaceChildren(...question.numbers.flatMap(([name, value]) => {
    const cell = element("dd");
    cell.innerHTML = value;
    return [element("dt", {}, name), cell];
  }));
  $("view").style.display = question.look ? "" : "none";
  $("no-scan").hidden = Boolean(question.look);
  $("no-scan").textContent = texts.no_scan;
  document.querySelector(".tools").hidden = !question.look;
}

async function busy(work) {
  // A key while the last answer is still being written would be an answer to a question not yet seen.
  if (state.busy) return;
  state.busy = true;
  document.body.dataset.busy = "1";
  try { await work(); } catch (error) { failed(error); } finally { state.busy = false; delete document.body.dataset.busy; }
}

function hideMarks() {
  const isBare = $("view").classList.toggle("bare");
  $("hide").setAttribute("aria-pressed", String(isBare));
}
