// The live page: takes frames from the run, keeps what has been, and draws.
import { drawErrors } from "./chart.js";
import { Link } from "./link.js";
import { vehicleColour } from "./palette.js";
import { View } from "./view.js";

const byId = (id) => document.getElementById(id);
const KEPT_EVENTS = 200;

let run = null;
let frame = null;
let chosen = null;
let trails = [];
let errors = [];
let times = [];
let phases = [];
let pace = { paused: false };
let rate = null;
let fresh = false;

const view = new View(byId("view"), choose, () => showFit());
const link = new Link({ run: begin, past: replay, frame: take, result: showResult, connection: showConnection });

function begin(message) {
  run = message;
  trails = Array.from({ length: run.vehicles }, () => []);
  errors = Array.from({ length: run.vehicles }, () => []);
  [times, phases, rate] = [[], [], null];
  byId("events").replaceChildren();
  byId("result").hidden = true;
  byId("title").textContent = run.title;
  byId("facts").textContent =
    `${run.scenario} · ${run.vehicles} vehicles · ${run.shape} · ${run.mcu === "avr" ? "ATmega2560 images" : "native firmware"} · seed ${run.seed}`;
  document.title = `${run.scenario} – Shoal live`;
  byId("pause").hidden = byId("speeds").hidden = !run.paced;
  makeTable();
  fresh = true;
}

function replay(message) {
  for (const past of message.frames) remember(past);
  for (const event of message.events) showEvent(event);
  frame = message.frames[message.frames.length - 1] ?? null;
  fresh = true;
}

function take(message) {
  const wall = performance.now() / 1000;
  if (!rate || message.t < rate.t || wall - rate.wall > 2) {
    if (rate && message.t > rate.t) rate.value = (message.t - rate.t) / (wall - rate.wall);
    rate = { t: message.t, wall, value: rate?.value };
  }
  pace = { paused: message.paused, speed: message.speed };
  for (const event of message.events) showEvent(event);
  if (!frame || message.t > frame.t) remember(message);
  frame = message;
  fresh = true;
}

function remember(message) {
  times.push(message.t);
  if (phases[phases.length - 1]?.phase !== message.phase) phases.push({ phase: message.phase, t: message.t });
  message.vehicles.forEach((vehicle, i) => {
    trails[i].push(vehicle.at);
    errors[i].push(vehicle.error);
  });
}

function choose(index) {
  chosen = index === chosen ? null : index;
  fresh = true;
}

function makeTable() {
  byId("vehicles").replaceChildren(...Array.from({ length: run.vehicles }, (_, i) => {
    const row = document.createElement("tr");
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = i + 1;
    button.setAttribute("aria-label", `Vehicle ${i + 1}: show its sensing range`);
    button.onclick = () => choose(i);
    row.insertCell().append(button);
    for (let k = 0; k < 7; k++) row.insertCell();
    return row;
  }));
}

const metres = (value, digits = 2) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)} m`);

function showTable() {
  frame.vehicles.forEach((vehicle, i) => {
    const row = byId("vehicles").rows[i];
    const cells = [
      vehicle.point === null ? "–" : String.fromCharCode(65 + (vehicle.point % 26)),
      metres(vehicle.error),
      metres(vehicle.at[2]),
      `${vehicle.speed.toFixed(2)} m/s`,
      metres(vehicle.nearest),
      typeof vehicle.battery === "number" ? `${vehicle.battery.toFixed(1)} V` : "–",
      vehicle.link || "–",
    ];
    cells.forEach((text, k) => { if (row.cells[k + 1].textContent !== text) row.cells[k + 1].textContent = text; });
    row.cells[5].className = vehicle.nearest !== null && vehicle.nearest < 2 * run.separation_limit_m ? "warn" : "";
    row.cells[7].className = vehicle.link && vehicle.link !== "ready" ? "warn" : "";
    row.className = i === chosen ? "chosen" : "";
    const button = row.cells[0].firstChild;
    button.style.borderColor = vehicleColour(i);
    button.setAttribute("aria-pressed", i === chosen);
  });
}

function showClock() {
  byId("phase").textContent = byId("phase").dataset.phase = frame.phase;
  const minutes = Math.floor(frame.t / 60);
  byId("time").textContent = `${minutes}:${String(Math.floor(frame.t % 60)).padStart(2, "0")}`;
  byId("progress").value = frame.t / run.duration_s;
  byId("rate").textContent = pace.paused ? "paused" : rate?.value ? `${rate.value.toFixed(1)} × real time` : "";
  byId("pause").textContent = pace.paused ? "Go on" : "Pause";
  byId("pause").setAttribute("aria-pressed", pace.paused);
  for (const button of byId("speeds").children) {
    const mine = button.dataset.speed === (pace.speed === null ? "max" : String(pace.speed ?? ""));
    button.setAttribute("aria-checked", mine);
    button.tabIndex = mine ? 0 : -1;
  }
}

function showEvent({ t, vehicle, text }) {
  const item = document.createElement("li");
  const who = document.createElement("b");
  who.textContent = vehicle ? `${vehicle} ` : "";
  item.append(`${t.toFixed(1)} s  `, who, text);
  byId("events").prepend(item);
  while (byId("events").children.length > KEPT_EVENTS) byId("events").lastChild.remove();
}

function showResult(message) {
  const box = byId("result");
  const head = document.createElement("h2");
  head.textContent = message.success ? "✓ The run meets its criteria" : "✗ The run does not meet its criteria";
  const list = document.createElement("ul");
  list.append(...message.verdicts.map((verdict) => {
    const item = document.createElement("li");
    item.textContent = `${verdict.holds ? "✓" : "✗"} ${verdict.name}: ${verdict.measured} (${verdict.required})`;
    if (!verdict.holds) item.className = "warn";
    return item;
  }));
  box.replaceChildren(head, list);
  box.classList.toggle("failed", !message.success);
  box.hidden = false;
  fresh = true;
}

function showConnection(text, lost) {
  byId("connection").textContent = text;
  byId("connection").className = lost ? "lost" : "";
}

function showFit() {
  byId("fit").setAttribute("aria-pressed", view.fitted);
  fresh = true;
}

function fit() {
  view.fitted = true;
  showFit();
}

function setSpeed(text) {
  link.send({ speed: text === "max" ? null : Number(text) });
}

function togglePause() {
  link.send({ paused: !pace.paused });
}

function toggleTheme() {
  const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  document.documentElement.dataset.theme = next;
  localStorage.setItem("theme", next);
  fresh = true;
}

function draw() {
  if (fresh && run) {
    fresh = false;
    view.draw(run, frame, trails, chosen);
    drawErrors(byId("errors"), run, times, errors, phases, chosen);
    if (frame) {
      showTable();
      showClock();
    }
  }
  requestAnimationFrame(draw);
}

const wished = localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
document.documentElement.dataset.theme = wished;
byId("pause").onclick = togglePause;
byId("theme").onclick = toggleTheme;
byId("fit").onclick = fit;
byId("closer").onclick = () => view.zoom(1.3);
byId("farther").onclick = () => view.zoom(1 / 1.3);
for (const button of byId("speeds").children) button.onclick = () => setSpeed(button.dataset.speed);
byId("speeds").addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const all = [...byId("speeds").children];
  const next = all[(all.indexOf(document.activeElement) + step + all.length) % all.length];
  next.focus();
  setSpeed(next.dataset.speed);
});
const resized = new ResizeObserver(() => { fresh = true; });
for (const canvas of document.querySelectorAll("canvas")) resized.observe(canvas);
window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const onButton = event.target instanceof HTMLButtonElement;
  const speed = { 1: "1", 2: "4", 3: "8", 4: "max" }[event.key];
  if (event.key === " " && !onButton) togglePause();
  else if (speed) setSpeed(speed);
  else if (event.key === "f" || event.key === "F") fit();
  else if (event.key === "+" || event.key === "=") view.zoom(1.3);
  else if (event.key === "-") view.zoom(1 / 1.3);
  else if (event.key === "Escape") choose(chosen);
  else return;
  event.preventDefault();
});
requestAnimationFrame(draw);
