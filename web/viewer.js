// A tile viewer on a canvas: pans, zooms, draws a layer's tiles and whatever the page adds on top.

import { degrees, metresAcross } from "/page/mercator.js";

const TILE = 512;
const KEPT = 400;
const MAX_LOADING = 8;

export class Viewer {
  constructor(map, canvas) {
    this.map = map;
    this.canvas = canvas;
    this.centre = [0.5, 0.5];
    this.zoom = 1;
    this.layer = null;
    this.grid = false;
    this.images = new Map();
    this.loading = 0;
    this.overlays = () => {};
    this.onclick = () => {};
    this.onmove = () => {};
    this.onfail = () => {};
    new ResizeObserver(() => this.draw()).observe(map);
    this.listen();
  }

  // layer: name, min_zoom, base_zoom, and its extent on the world [west, north, east, south], east perhaps beyond 1.
  show(layer) {
    this.layer = layer;
    this.images.clear();
    this.whole();
  }

  whole() {
    if (this.layer) this.fit(this.layer.extent);
  }

  fit([west, north, east, south]) {
    const { clientWidth: w, clientHeight: h } = this.map;
    this.centre = [(west + east) / 2, (north + south) / 2];
    this.setZoom(Math.log2(Math.min(w / (east - west), h / (south - north)) * 0.9 / TILE));
  }

  setZoom(zoom) {
    const last = this.layer ? this.layer.base_zoom + 4 : 24;
    this.zoom = Math.min(Math.max(zoom, 0), last);
    this.draw();
  }

  get size() { return TILE * 2 ** this.zoom; }

  screen([x, y]) {
    const { clientWidth: w, clientHeight: h } = this.map;
    return [w / 2 + (x - this.centre[0]) * this.size, h / 2 + (y - this.centre[1]) * this.size];
  }

  place(sx, sy) {
    const { clientWidth: w, clientHeight: h } = this.map;
    return [this.centre[0] + (sx - w / 2) / this.size, this.centre[1] + (sy - h / 2) / this.size];
  }

  zoomAt(sx, sy, by) {
    const before = this.place(sx, sy);
    this.setZoom(this.zoom + by);
    const after = this.place(sx, sy);
    this.moveTo([this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]]);
  }

  moveTo([x, y]) {
    this.centre = [((x % 1) + 1) % 1, Math.min(Math.max(y, 0), 1)];
    this.draw();
  }

  listen() {
    const at = (e) => { const r = this.canvas.getBoundingClientRect(); return [e.clientX - r.left, e.clientY - r.top]; };
    const held = new Map();
    let travelled = 0;
    this.canvas.addEventListener("pointerdown", (e) => {
      held.set(e.pointerId, at(e));
      if (held.size === 1) travelled = 0;
      this.canvas.setPointerCapture(e.pointerId);
    });
    this.canvas.addEventListener("pointermove", (e) => {
      const now = at(e);
      this.onmove(degrees(this.place(...now)));
      const last = held.get(e.pointerId);
      if (!last) return;
      const others = [...held].filter(([id]) => id !== e.pointerId).map(([, p]) => p);
      if (others.length === 1) {
        const spread = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]);
        const middle = [(now[0] + others[0][0]) / 2, (now[1] + others[0][1]) / 2];
        this.zoomAt(...middle, Math.log2(Math.max(spread(now), 1) / Math.max(spread(last), 1)));
        travelled = 99;
      }
      travelled += Math.hypot(now[0] - last[0], now[1] - last[1]);
      held.set(e.pointerId, now);
      if (travelled > 4) {
        this.canvas.classList.add("moving");
        const share = 1 / held.size;
        this.moveTo([this.centre[0] - (now[0] - last[0]) * share / this.size, this.centre[1] - (now[1] - last[1]) * share / this.size]);
      }
    });
    const release = (e) => {
      const still = held.delete(e.pointerId) && travelled <= 4 && e.type === "pointerup" && e.button === 0;
      if (held.size === 0) this.canvas.classList.remove("moving");
      if (still) this.onclick(degrees(this.place(...at(e))));
    };
    this.canvas.addEventListener("pointerup", release);
    this.canvas.addEventListener("pointercancel", release);
    this.canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      const lines = e.deltaMode === 1 ? 16 : 1;
      this.zoomAt(...at(e), -Math.max(-200, Math.min(200, e.deltaY * lines)) / 200);
    }, { passive: false });
    this.map.addEventListener("keydown", (e) => {
      const step = 80 / this.size;
      const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
      if (moves[e.key]) this.moveTo([this.centre[0] + moves[e.key][0], this.centre[1] + moves[e.key][1]]);
      else if (e.key === "+" || e.key === "=") this.setZoom(this.zoom + 0.5);
      else if (e.key === "-") this.setZoom(this.zoom - 0.5);
      else if (e.key === "0") this.whole();
      else return;
      e.preventDefault();
    });
  }

  draw() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => { this.due = false; this.paint(); });
  }

  paint() {
    const { clientWidth: w, clientHeight: h } = this.map;
    const ratio = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(w * ratio) || this.canvas.height !== Math.round(h * ratio)) {
      this.canvas.width = Math.round(w * ratio);
      this.canvas.height = Math.round(h * ratio);
    }
    const g = this.canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, w, h);
    this.wanted = [];
    if (this.layer) this.paintTiles(g, ratio);
    this.overlays(g, this);
    this.load();
    this.showScale();
  }

  // The world is drawn once for each turn about it that is in view.
  turns() {
    const [west, east] = [this.place(0, 0)[0], this.place(this.map.clientWidth, 0)[0]];
    const all = [];
    for (let turn = Math.floor(west); turn <= Math.floor(east); turn++) all.push(turn);
    return all;
  }

  paintTiles(g, ratio) {
    const { min_zoom, base_zoom, extent } = this.layer;
    const z = Math.min(Math.max(Math.ceil(this.zoom + Math.log2(ratio) - 0.3), min_zoom), base_zoom);
    const n = 2 ** z;
    const upper = this.place(0, 0), lower = this.place(this.map.clientWidth, this.map.clientHeight);
    for (const turn of [-1, ...this.turns(), 1].filter((t, i, a) => a.indexOf(t) === i)) {
      const first = Math.floor(Math.max(upper[0] - turn, extent[0]) * n + 1e-9), last = Math.ceil(Math.min(lower[0] - turn, extent[2]) * n - 1e-9);
      const top = Math.floor(Math.max(upper[1], extent[1]) * n + 1e-9), bottom = Math.ceil(Math.min(lower[1], extent[3]) * n - 1e-9);
      for (let y = Math.max(top, 0); y < Math.min(bottom, n); y++) {
        for (let x = first; x < last; x++) this.paintTile(g, z, x, y, turn, n);
      }
    }
  }

  paintTile(g, z, x, y, turn, n) {
    const [left, top] = this.screen([x / n + turn, y / n]), [right, bottom] = this.screen([(x + 1) / n + turn, (y + 1) / n]);
    const column = ((x % n) + n) % n;
    const whole = this.image(z, column, y);
    g.imageSmoothingEnabled = right - left < TILE * 3;
    if (whole && whole.ready) {
      g.drawImage(whole.element, left, top, right - left, bottom - top);
    } else if (!whole || !whole.missing) {
      for (let up = 1; z - up >= this.layer.min_zoom; up++) {
        const parent = this.images.get(`${z - up}/${column >> up}/${y >> up}`);
        if (!parent || !parent.ready) continue;
        const part = TILE / 2 ** up;
        g.drawImage(parent.element, (column % 2 ** up) * part, (y % 2 ** up) * part, part, part, left, top, right - left, bottom - top);
        break;
      }
    }
    if (this.grid && right - left > 40) {
      g.strokeStyle = "#ffffff66";
      g.lineWidth = 1;
      g.strokeRect(left, top, right - left, bottom - top);
      if (right - left > 120) {
        g.fillStyle = "#ffffffcc";
        g.font = "11px system-ui, sans-serif";
        g.fillText(`${z}/${column}/${y}`, left + 5, top + 14);
      }
    }
  }

  image(z, x, y) {
    const key = `${z}/${x}/${y}`;
    const found = this.images.get(key);
    if (found) {
      this.images.delete(key);
      this.images.set(key, found);
    } else {
      this.wanted.push(key);
    }
    return found;
  }

  load() {
    const layer = this.layer;
    while (this.wanted.length && this.loading < MAX_LOADING) {
      const key = this.wanted.shift();
      const entry = { element: new Image(), ready: false, missing: false };
      this.images.set(key, entry);
      this.loading++;
      const done = (ready) => {
        this.loading--;
        entry.ready = ready;
        entry.missing = !ready;
        if (!ready) this.onfail();
        if (layer === this.layer) this.draw();
      };
      entry.element.onload = () => done(true);
      entry.element.onerror = () => done(false);
      entry.element.src = `/v1/tiles/${layer.name}/${key}`;
    }
    for (const key of this.images.keys()) {
      if (this.images.size <= KEPT) break;
      this.images.delete(key);
    }
  }

  // Traces rings of (longitude, latitude) turned to world positions; the page strokes or fills.
  trace(g, rings) {
    g.beginPath();
    for (const turn of this.turns()) {
      for (const ring of rings) {
        ring.forEach(([x, y], i) => {
          const p = this.screen([x + turn, y]);
          if (i) g.lineTo(...p); else g.moveTo(...p);
        });
        g.closePath();
      }
    }
  }

  showScale() {
    const bar = this.map.querySelector("#scale");
    const perPixel = metresAcross(this.centre[1]) / this.size;
    const largest = perPixel * 120;
    const power = 10 ** Math.floor(Math.log10(largest));
    const length = [5, 2, 1].map((k) => k * power).find((l) => l <= largest);
    bar.style.width = `${length / perPixel}px`;
    bar.firstElementChild.textContent = length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : `${Math.round(length * 100)} cm`;
  }
}
