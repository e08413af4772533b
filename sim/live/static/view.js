// The top view: north up, east right, metres; it keeps the whole swim in sight until the viewer moves it.
import { colour, prepare, roundStep, vehicleColour } from "./palette.js";

const LEAST_HULL_PX = 20;
const MARGIN_PX = 50;

export class View {
  constructor(canvas, onChoose, onMoved) {
    this.canvas = canvas;
    this.onChoose = onChoose;
    this.onMoved = onMoved;
    this.centre = [0, 0];
    this.scale = 12;
    this.fitted = true;
    this.listen();
  }

  listen() {
    const { canvas } = this;
    let from = null;
    let moved = false;
    canvas.addEventListener("pointerdown", (event) => {
      from = [event.offsetX, event.offsetY];
      moved = false;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return;
      const [dx, dy] = [event.offsetX - from[0], event.offsetY - from[1]];
      if (!moved && Math.hypot(dx, dy) < 4) return;
      moved = true;
      from = [event.offsetX, event.offsetY];
      this.pan(dx, dy);
    });
    canvas.addEventListener("pointerup", (event) => {
      if (from && !moved) this.choose(event.offsetX, event.offsetY);
      from = null;
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * 0.0015), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[event.key];
      if (!step) return;
      event.preventDefault();
      this.pan(...step);
    });
  }

  pan(dx, dy) {
    this.centre = [this.centre[0] + dy / this.scale, this.centre[1] - dx / this.scale];
    this.moved();
  }

  zoom(factor, x, y) {
    const { width, height } = this.canvas.getBoundingClientRect();
    const at = this.place(x ?? width / 2, y ?? height / 2, width, height);
    this.scale = Math.min(400, Math.max(0.5, this.scale * factor));
    const after = this.place(x ?? width / 2, y ?? height / 2, width, height);
    this.centre = [this.centre[0] + at[0] - after[0], this.centre[1] + at[1] - after[1]];
    this.moved();
  }

  moved() {
    this.fitted = false;
    this.onMoved();
  }

  place(x, y, width, height) {
    return [this.centre[0] - (y - height / 2) / this.scale, this.centre[1] + (x - width / 2) / this.scale];
  }

  choose(x, y) {
    const near = (this.drawn ?? []).map(([px, py], i) => [Math.hypot(px - x, py - y), i]).sort((a, b) => a[0] - b[0])[0];
    this.onChoose(near && near[0] < 26 ? near[1] : null);
  }

  // Everything that has been or will be swum, within the margins.
  fit(run, frame, trails, width, height) {
    const all = [...frame.points, ...run.path, ...frame.vehicles.map((v) => v.at)];
    for (const trail of trails) for (let k = 0; k < trail.length; k += 8) all.push(trail[k]);
    const [north, east] = [0, 1].map((axis) => all.map((p) => p[axis]));
    const [low, high] = [[Math.min(...north), Math.min(...east)], [Math.max(...north), Math.max(...east)]];
    this.centre = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    this.scale = Math.min(
      60, (width - 2 * MARGIN_PX) / Math.max(high[1] - low[1], 4), (height - 2 * MARGIN_PX) / Math.max(high[0] - low[0], 4));
  }

  draw(run, frame, trails, chosen) {
    const { context, width, height } = prepare(this.canvas);
    if (!run || !frame || width < 2) return;
    if (this.fitted) this.fit(run, frame, trails, width, height);
    const at = ([north, east]) => [
      width / 2 + (east - this.centre[1]) * this.scale, height / 2 - (north - this.centre[0]) * this.scale];
    this.grid(context, width, height, at);
    this.path(context, run.path.map(at));
    trails.forEach((trail, i) => this.trail(context, trail, at, i, chosen));
    frame.points.forEach((point, i) => this.point(context, at(point), i, frame.vehicles.some((v) => v.point === i)));
    this.drawn = frame.vehicles.map((v) => at(v.at));
    frame.vehicles.forEach((v, i) => this.tie(context, v, frame.points, at, i));
    if (chosen !== null && frame.vehicles[chosen]) this.range(context, this.drawn[chosen], run.range_m, chosen);
    frame.vehicles.forEach((v, i) => this.hull(context, run.hull_m, v, this.drawn[i], i, i === chosen));
    this.compass(context, frame.current);
    this.ruler(context, height);
  }

  grid(context, width, height, at) {
    const step = roundStep(60 / this.scale);
    context.strokeStyle = colour("grid");
    context.fillStyle = colour("soft");
    context.lineWidth = 1;
    context.font = "11px system-ui, sans-serif";
    const [top, left] = this.place(0, 0, width, height);
    const [bottom, right] = this.place(width, height, width, height);
    context.beginPath();
    for (let north = Math.ceil(bottom / step) * step; north <= top; north += step) {
      const y = Math.round(at([north, 0])[1]) + 0.5;
      context.moveTo(0, y);
      context.lineTo(width, y);
    }
    for (let east = Math.ceil(left / step) * step; east <= right; east += step) {
      const x = Math.round(at([0, east])[0]) + 0.5;
      context.moveTo(x, 0);
      context.lineTo(x, height);
    }
    context.stroke();
  }

  path(context, corners) {
    context.save();
    context.strokeStyle = colour("soft");
    context.globalAlpha = 0.6;
    context.setLineDash([3, 6]);
    context.lineWidth = 1.5;
    context.beginPath();
    corners.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.stroke();
    context.restore();
  }

  trail(context, trail, at, i, chosen) {
    if (trail.length < 2) return;
    context.save();
    context.strokeStyle = vehicleColour(i);
    context.globalAlpha = chosen === null || chosen === i ? 0.75 : 0.25;
    context.lineWidth = chosen === i ? 2.2 : 1.4;
    context.lineJoin = "round";
    context.beginPath();
    trail.forEach((p, k) => (k ? context.lineTo(...at(p)) : context.moveTo(...at(p))));
    context.stroke();
    context.restore();
  }

  point(context, [x, y], i, held) {
    context.save();
    context.strokeStyle = colour("ink");
    context.globalAlpha = held ? 0.9 : 0.55;
    context.lineWidth = 1.6;
    if (!held) context.setLineDash([3, 3]);
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.moveTo(x - 3, y);
    context.lineTo(x + 3, y);
    context.moveTo(x, y - 3);
    context.lineTo(x, y + 3);
    context.stroke();
    context.fillStyle = colour("soft");
    context.font = "10px system-ui, sans-serif";
    context.fillText(String.fromCharCode(65 + (i % 26)), x + 9, y + 11);
    context.restore();
  }

  // A thin line from a vehicle to the point that it holds.
  tie(context, vehicle, points, at, i) {
    if (vehicle.point === null || !points[vehicle.point]) return;
    context.save();
    context.strokeStyle = vehicleColour(i);
    context.globalAlpha = 0.6;
    context.setLineDash([2, 4]);
    context.beginPath();
    context.moveTo(...at(vehicle.at));
    context.lineTo(...at(points[vehicle.point]));
    context.stroke();
    context.restore();
  }

  hull(context, [length, beam], vehicle, [x, y], i, chosen) {
    const long = Math.max(LEAST_HULL_PX, length * this.scale);
    const wide = Math.max(LEAST_HULL_PX * 0.34, beam * this.scale);
    context.save();
    context.translate(x, y);
    context.rotate(vehicle.yaw);
    context.beginPath();
    context.moveTo(0, -long / 2);
    context.bezierCurveTo(wide * 0.75, -long / 4, wide * 0.6, long / 4, wide * 0.2, long / 2);
    context.lineTo(-wide * 0.2, long / 2);
    context.bezierCurveTo(-wide * 0.6, long / 4, -wide * 0.75, -long / 4, 0, -long / 2);
    context.fillStyle = vehicleColour(i);
    context.strokeStyle = chosen ? colour("ink") : colour("panel");
    context.lineWidth = chosen ? 2.5 : 1.5;
    context.fill();
    context.stroke();
    context.restore();
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    context.lineWidth = 3;
    context.strokeStyle = colour("water");
    context.strokeText(`${i + 1}`, x + 15, y - 11);
    context.fillStyle = vehicleColour(i);
    context.fillText(`${i + 1}`, x + 15, y - 11);
    context.textAlign = "start";
  }

  range(context, [x, y], range, i) {
    context.save();
    context.strokeStyle = context.fillStyle = vehicleColour(i);
    context.beginPath();
    context.arc(x, y, range * this.scale, 0, 2 * Math.PI);
    context.globalAlpha = 0.06;
    context.fill();
    context.globalAlpha = 0.7;
    context.setLineDash([6, 5]);
    context.stroke();
    context.restore();
  }

  compass(context, [north, east]) {
    context.save();
    context.translate(42, 46);
    context.fillStyle = context.strokeStyle = colour("soft");
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    context.beginPath();
    context.arc(0, 0, 24, 0, 2 * Math.PI);
    context.stroke();
    context.fillText("N", 0, -28);
    const speed = Math.hypot(north, east);
    if (speed > 0.002) {
      context.save();
      context.rotate(Math.atan2(east, north));
      context.strokeStyle = context.fillStyle = colour("accent");
      context.lineWidth = 2.5;
      context.beginPath();
      context.moveTo(0, 17);
      context.lineTo(0, -10);
      context.stroke();
      context.beginPath();
      context.moveTo(0, -19);
      context.lineTo(6, -8);
      context.lineTo(-6, -8);
      context.fill();
      context.restore();
    }
    context.font = "11px system-ui, sans-serif";
    context.fillText(speed > 0.002 ? `current ${speed.toFixed(2)} m/s` : "no current", 8, 41);
    context.restore();
  }

  ruler(context, height) {
    const step = roundStep(80 / this.scale);
    const long = step * this.scale;
    context.strokeStyle = context.fillStyle = colour("ink");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(18, height - 22);
    context.lineTo(18, height - 16);
    context.lineTo(18 + long, height - 16);
    context.lineTo(18 + long, height - 22);
    context.stroke();
    context.font = "11px system-ui, sans-serif";
    context.fillText(`${step} m`, 24, height - 22);
  }
}
