// The page: asks its own service, and draws the answers. It contacts no other address.

import { metresAcross, world } from "/page/mercator.js";
import { Viewer } from "/page/viewer.js";

const $ = (id) => document.getElementById(id);
const viewer = new Viewer($("map"), $("canvas"));
const state = { layers: [], coverage: [], position: null, candidates: null, highlighted: null, fix: null };

async function send(path, options) {
  try {
    return await fetch(path, options);
  } catch {
    throw { detail: "the service does not answer; is it still running?" };
  }
}

// All requests that need the token wait for one dialog. The service exchanges the token for a cookie; the page does not keep it.
let entering = null;

function enter() {
  entering ??= new Promise((entered) => {
    const form = $("entry").querySelector("form");
    form.onsubmit = async (e) => {
      e.preventDefault();
      const headers = { authorization: `Bearer ${form.elements.token.value.trim()}` };
      const reply = await send("/v1/session", { method: "POST", headers }).catch((problem) => problem);
      $("refused").textContent = reply.ok ? "" : reply.detail || "That is not the token.";
      if (!reply.ok) return;
      form.reset();
      $("entry").close();
      entered();
    };
    $("entry").oncancel = (e) => e.preventDefault();
    $("entry").showModal();
  }).finally(() => { entering = null; });
  return entering;
}

async function ask(path, options) {
  let reply = await send(path, options);
  while (reply.status === 401) {
    await enter();
    reply = await send(path, options);
  }
  const body = await reply.json();
  if (!reply.ok) throw body;
  return body;
}

function element(tag, text, cls) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (cls) made.className = cls;
  return made;
}

function list(pairs) {
  const made = element("dl");
  for (const [name, value] of pairs) made.append(element("dt", name), element("dd", value));
  return made;
}

function complain(where, form, problem) {
  where.replaceChildren(element("p", problem.detail || "the answer cannot be read", "error"));
  form.elements[problem.parameter]?.classList?.add("wrong");
}

const round = (value, digits) => Number(value.toFixed(digits)).toString();
const percent = (p) => p >= 0.0005 ? `${(100 * p).toFixed(p < 0.0995 ? 2 : 1)} %` : "< 0.05 %";

// ---- layers

async function start() {
  try {
    const store = await ask("/v1/store");
    $("service").textContent = `${store.service}, version ${store.program_version}`;
    $("digest").textContent = `digest ${store.digest.slice(0, 12)}`;
    $("digest").title = store.digest;
    const mission = [store.name, store.serial === null ? null : `serial ${store.serial}`, store.valid_until && `valid until ${store.valid_until}`];
    $("mission").textContent = mission.filter(Boolean).join(", ");
    state.layers = store.layers.filter((l) => l.complete).map(withExtent);
    $("layer").replaceChildren(...state.layers.map((l) => new Option(l.name, l.name)));
    if (state.layers.some((l) => l.name === "ortho")) $("layer").value = "ortho";
    chooseLayer();
    state.coverage = (await ask("/v1/coverage")).features;
    viewer.draw();
  } catch (problem) {
    $("about").replaceChildren(element("span", problem.detail || String(problem), "error"));
  }
}

function withExtent(layer) {
  const [west, south, east, north] = layer.bounds_deg;
  const [x0, y0] = world(west, north), [x1, y1] = world(east, south);
  return { ...layer, extent: [x0, y0, x1 <= x0 ? x1 + 1 : x1, y1] };
}

const layer = () => state.layers.find((l) => l.name === $("layer").value);

function chooseLayer() {
  const chosen = layer();
  if (!chosen) return;
  viewer.show(chosen);
  const gsd = metresAcross((chosen.extent[1] + chosen.extent[3]) / 2) / 2 ** chosen.base_zoom / 512;
  const acquired = chosen.acquired ? (chosen.acquired[0] === chosen.acquired[1] ? chosen.acquired[0] : chosen.acquired.join(" to ")) : "date unknown";
  $("about").textContent = `${chosen.base_tiles} tiles of zoom ${chosen.base_zoom}, about ${round(gsd, gsd < 1 ? 3 : 2)} m per pixel, ${acquired}`;
  // Defaults that suit any layer: an image of about one tile, uncertain by about half a tile.
  const edge = gsd * 512;
  const size = Number(edge.toPrecision(2));
  const defaults = { across_m: size, along_m: Number((edge * 0.75).toPrecision(2)), drift_m: Number((edge / 2).toPrecision(1)), inaccuracy_m: Number((gsd * 10).toPrecision(1)), sigma_east_m: Number((edge / 3).toPrecision(1)), sigma_north_m: Number((edge / 3).toPrecision(1)) };
  for (const [name, value] of Object.entries(defaults)) suggest($("question").elements[name], value);
  suggest($("fix").elements.gsd_m_per_px, Number((gsd).toPrecision(3)));
  clear();
}

// Puts a value into a field, unless somebody has typed another one there.
function suggest(input, value) {
  if (input.value === "" || input.value === input.dataset.suggested) input.value = value;
  input.dataset.suggested = String(value);
}

// ---- candidates

function parameters() {
  const chosen = new URLSearchParams({ layer: layer().name });
  const hidden = $("kind").value === "drift" ? ["sigma_east_m", "sigma_north_m", "correlation"] : ["drift_m", "inaccuracy_m"];
  for (const [name, value] of new FormData($("question"))) {
    if (!hidden.includes(name) && value.trim() !== "") chosen.set(name, value.trim());
  }
  return chosen;
}

let question = 0;

async function askCandidates() {
  const form = $("question");
  form.querySelectorAll(".wrong").forEach((e) => e.classList.remove("wrong"));
  const mine = ++question;
  try {
    const answer = await ask(`/v1/candidates?${parameters()}`);
    if (mine !== question) return;
    state.candidates = answer;
    state.position = [Number(form.elements.longitude_deg.value), Number(form.elements.latitude_deg.value)];
    listCandidates(answer);
  } catch (problem) {
    if (mine !== question) return;
    state.candidates = null;
    complain($("candidates"), form, problem);
  }
  viewer.draw();
}

function listCandidates(answer) {
  const n = answer.tiles.length;
  const figures = list([
    ["Tiles to search", String(n)],
    ["Nominal count", round(answer.nominal_count, 2)],
    ["Containment", percent(answer.containment)],
    ["Estimated", `${round(answer.estimated_s, 2)} s`],
  ]);
  if (!n) {
    $("candidates").replaceChildren(figures, element("p", "The layer has no tile there.", "none"));
    return;
  }
  const table = element("table"), head = element("tr"), body = element("tbody");
  for (const name of ["Tile", "Probability", "Keypoints"]) head.append(element("th", name));
  for (const tile of answer.tiles.slice(0, 12)) {
    const row = element("tr");
    row.append(element("td", `${tile.z}/${tile.x}/${tile.y}`), element("td", percent(tile.probability)), element("td", String(tile.keypoints)));
    row.onmouseenter = () => { state.highlighted = tile; viewer.draw(); };
    row.onmouseleave = () => { state.highlighted = null; viewer.draw(); };
    body.append(row);
  }
  const top = element("thead");
  top.append(head);
  table.append(top, body);
  $("candidates").replaceChildren(figures, table, ...(n > 12 ? [element("p", `and ${n - 12} more`, "quiet")] : []));
}

function clear() {
  question++;
  Object.assign(state, { position: null, candidates: null, highlighted: null, fix: null });
  $("candidates").replaceChildren();
  $("answer").replaceChildren();
  viewer.draw();
}

// ---- fixes

async function locate(file) {
  const form = $("fix"), button = form.querySelector("button");
  form.querySelectorAll(".wrong").forEach((e) => e.classList.remove("wrong"));
  if (!file) {
    $("answer").replaceChildren(element("p", "Choose an image, or drop one on the map.", "error"));
    return;
  }
  if (form.elements.gsd_m_per_px.value.trim() === "") {
    complain($("answer"), form, { detail: "State how large a pixel is on the ground: Ground, m per px.", parameter: "gsd_m_per_px" });
    return;
  }
  const request = { layer: layer().name };
  for (const input of form.querySelectorAll("input[name]")) {
    const text = input.value.trim();
    if (text !== "") request[input.name] = Number(text);
    if (Number.isNaN(request[input.name])) {
      complain($("answer"), form, { detail: `${input.name}: ${text} is not a number`, parameter: input.name });
      return;
    }
  }
  if (request.sigma_m !== undefined) {
    request.latitude_deg = Number($("question").elements.latitude_deg.value || NaN);
    request.longitude_deg = Number($("question").elements.longitude_deg.value || NaN);
    if (Number.isNaN(request.latitude_deg + request.longitude_deg)) {
      complain($("answer"), form, { detail: "With a sigma, state a position: click the map first.", parameter: "sigma_m" });
      return;
    }
  }
  const body = new FormData();
  body.append("image", file);
  body.append("request", JSON.stringify(request));
  button.disabled = true;
  $("answer").replaceChildren(element("p", `Locating ${file.name}`, "quiet"));
  try {
    const answer = await ask("/v1/fixes", { method: "POST", body });
    state.fix = answer.status === "fix" ? answer : null;
    showAnswer(answer);
  } catch (problem) {
    state.fix = null;
    complain($("answer"), form, problem);
  }
  button.disabled = false;
  $("answer").scrollIntoView({ block: "nearest" });
  viewer.draw();
}

function showAnswer(answer) {
  const searched = [["Tiles searched", String(answer.tiles_searched)], ["Elapsed", `${round(answer.elapsed_ms, 0)} ms`]];
  if (answer.status !== "fix") {
    const reason = answer.reason.replaceAll("_", " ");
    $("answer").replaceChildren(element("p", `No fix: ${reason}`, "none"), element("p", answer.detail, "quiet"), list(searched));
    return;
  }
  const { major, minor } = ellipse(answer.covariance_m2);
  $("answer").replaceChildren(element("p", "Fix", "good"), list([
    ["Latitude, deg", answer.latitude_deg.toFixed(7)],
    ["Longitude, deg", answer.longitude_deg.toFixed(7)],
    ["Point", answer.position_of === "nadir" ? "below the camera" : "the image's centre"],
    ["Sigma", `${round(major, 2)} x ${round(minor, 2)} m`],
    ["Heading, deg", `${answer.heading_deg.toFixed(2)} ± ${round(answer.heading_sigma_deg, 2)}`],
    ["Ground, m per px", answer.gsd_m_per_px.toPrecision(4)],
    ["Score", round(answer.score, 1)],
    ["False with probability", answer.false_fix_probability.toExponential(1)],
    ...searched,
  ]));
  const [x, y] = world(answer.longitude_deg, answer.latitude_deg);
  const [sx, sy] = viewer.screen([x, y]);
  if (sx < 0 || sy < 0 || sx > viewer.map.clientWidth || sy > viewer.map.clientHeight) viewer.moveTo([x, y]);
}

// One standard deviation along both axes, and the turn of the longer one from east, counterclockwise.
function ellipse([[ee, en], [, nn]]) {
  const mean = (ee + nn) / 2, spread = Math.hypot((ee - nn) / 2, en);
  return { major: Math.sqrt(mean + spread), minor: Math.sqrt(Math.max(mean - spread, 0)), turn: Math.atan2(2 * en, ee - nn) / 2 };
}

// ---- drawing

const onWorld = (ring) => ring.map(([longitude, latitude]) => world(longitude, latitude));
const rings = (geometry) => (geometry.type === "Polygon" ? [geometry.coordinates] : geometry.coordinates).map((polygon) => onWorld(polygon[0]));

function tileRing({ bounds_deg: b }) {
  return onWorld([[b.west, b.south], [b.east, b.south], [b.east, b.north], [b.west, b.north]]);
}

viewer.overlays = (g) => {
  if ($("coverage").checked) {
    const chosen = state.coverage.find((f) => f.properties.layer === $("layer").value);
    if (chosen) {
      chosen.rings ??= rings(chosen.geometry);
      viewer.trace(g, chosen.rings);
      g.strokeStyle = "#35c2ffaa";
      g.lineWidth = 1.5;
      g.stroke();
    }
  }
  if (state.candidates) drawCandidates(g, state.candidates);
  if (state.position) cross(g, world(...state.position), "#fff");
  if (state.fix) drawFix(g, state.fix);
};

function drawCandidates(g, answer) {
  const most = answer.tiles[0]?.probability || 1;
  for (const tile of answer.tiles.slice(0, 4000).reverse()) {
    viewer.trace(g, [tileRing(tile)]);
    g.fillStyle = `rgb(255 150 20 / ${0.05 + 0.27 * tile.probability / most})`;
    g.fill();
    g.strokeStyle = tile === state.highlighted ? "#fff" : "#ffb02099";
    g.lineWidth = tile === state.highlighted ? 3 : 1;
    g.stroke();
    label(g, tile);
  }
  viewer.trace(g, rings(answer.region));
  g.strokeStyle = "#000a";
  g.lineWidth = 4;
  g.stroke();
  g.strokeStyle = "#ffe14d";
  g.lineWidth = 2;
  g.stroke();
}

function label(g, tile) {
  const b = tile.bounds_deg;
  const [left, top] = viewer.screen(world(b.west, b.north)), [right, bottom] = viewer.screen(world(b.east, b.south));
  if (right - left < 56) return;
  g.font = "600 12px system-ui, sans-serif";
  g.textAlign = "center";
  g.lineWidth = 3;
  g.strokeStyle = "#000b";
  const at = [(left + right) / 2, bottom - 8];
  g.strokeText(percent(tile.probability), ...at);
  g.fillStyle = "#fff";
  g.fillText(percent(tile.probability), ...at);
  g.textAlign = "left";
}

function cross(g, place, colour) {
  const [x, y] = viewer.screen(place);
  for (const [width, style] of [[4, "#000a"], [2, colour]]) {
    g.beginPath();
    g.moveTo(x - 9, y); g.lineTo(x + 9, y); g.moveTo(x, y - 9); g.lineTo(x, y + 9);
    g.lineWidth = width;
    g.strokeStyle = style;
    g.stroke();
  }
}

function drawFix(g, fix) {
  const place = world(fix.longitude_deg, fix.latitude_deg);
  const [x, y] = viewer.screen(place);
  const perMetre = viewer.size / metresAcross(place[1]);
  const { major, minor, turn } = ellipse(fix.covariance_m2);
  // The 95 % ellipse: 2.448 standard deviations in the plane.
  g.beginPath();
  g.ellipse(x, y, Math.max(2.448 * major * perMetre, 1), Math.max(2.448 * minor * perMetre, 1), -turn, 0, 2 * Math.PI);
  g.fillStyle = "#39e07555";
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = "#39e075";
  g.stroke();
  // An arrowhead along the heading, of constant size.
  g.save();
  g.translate(x, y);
  g.rotate(fix.heading_deg * Math.PI / 180);
  g.beginPath();
  g.moveTo(0, -18); g.lineTo(9, 10); g.lineTo(0, 4); g.lineTo(-9, 10);
  g.closePath();
  g.fillStyle = "#39e075";
  g.fill();
  g.lineWidth = 1.5;
  g.strokeStyle = "#06371a";
  g.stroke();
  g.restore();
}

// ---- wiring

viewer.onclick = ([longitude, latitude]) => {
  $("question").elements.longitude_deg.value = longitude.toFixed(6);
  $("question").elements.latitude_deg.value = latitude.toFixed(6);
  askCandidates();
};
// A tile that does not come is no trouble by itself; a service that is gone is.
viewer.onfail = async () => {
  try {
    await send("/readyz");
  } catch (problem) {
    $("about").replaceChildren(element("span", problem.detail, "error"));
  }
};
viewer.onmove = ([longitude, latitude]) => { $("cursor").textContent = `${latitude.toFixed(6)}, ${longitude.toFixed(6)}`; };
$("layer").onchange = chooseLayer;
$("coverage").onchange = () => viewer.draw();
$("grid").onchange = () => { viewer.grid = $("grid").checked; viewer.draw(); };
$("kind").onchange = () => {
  $("drift").hidden = $("kind").value !== "drift";
  $("covariance").hidden = $("kind").value === "drift";
};
$("question").onsubmit = (e) => { e.preventDefault(); askCandidates(); };
$("clear").onclick = clear;
$("fix").onsubmit = (e) => { e.preventDefault(); locate($("image").files[0]); };
$("image").onchange = () => locate($("image").files[0]);
$("closer").onclick = () => viewer.setZoom(viewer.zoom + 1);
$("farther").onclick = () => viewer.setZoom(viewer.zoom - 1);
$("whole").onclick = () => viewer.whole();
for (const kind of ["dragenter", "dragover"]) {
  document.addEventListener(kind, (e) => { e.preventDefault(); $("drop").hidden = false; });
}
document.addEventListener("dragleave", (e) => { if (!e.relatedTarget) $("drop").hidden = true; });
document.addEventListener("drop", (e) => {
  e.preventDefault();
  $("drop").hidden = true;
  const file = e.dataTransfer.files[0];
  if (!file) return;
  $("image").files = e.dataTransfer.files;
  locate(file);
});
start();
