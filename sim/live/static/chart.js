// Tracking errors over time on a logarithmic scale, with the phases behind them and the limit across.
import { colour, prepare, vehicleColour } from "./palette.js";

const [LOW, HIGH] = [0.03, 30];
const TICKS = [0.1, 0.3, 1, 3, 10];

export function drawErrors(canvas, run, times, errors, phases, chosen) {
  const { context, width, height } = prepare(canvas);
  if (!run || times.length < 2) return;
  const [left, right, top, bottom] = [38, width - 8, 6, height - 20];
  const [begin, end] = [times[0], Math.max(times[times.length - 1], times[0] + 10)];
  const x = (t) => left + ((t - begin) / (end - begin)) * (right - left);
  const y = (e) => {
    const share = Math.log(Math.min(HIGH, Math.max(LOW, e)) / LOW) / Math.log(HIGH / LOW);
    return bottom - share * (bottom - top);
  };
  context.font = "11px system-ui, sans-serif";
  phases.forEach(({ phase, t }, k) => {
    const until = phases[k + 1]?.t ?? end;
    context.fillStyle = colour("accent");
    context.globalAlpha = k % 2 ? 0.11 : 0.04;
    context.fillRect(x(t), top, x(until) - x(t), bottom - top);
    context.globalAlpha = 1;
    context.fillStyle = colour("soft");
    if (x(until) - x(t) > context.measureText(phase).width + 8) context.fillText(phase, x(t) + 4, bottom - 5);
  });
  context.lineWidth = 1;
  for (const tick of TICKS) {
    context.strokeStyle = colour("line");
    context.beginPath();
    context.moveTo(left, y(tick));
    context.lineTo(right, y(tick));
    context.stroke();
    context.fillStyle = colour("soft");
    context.textAlign = "right";
    context.fillText(`${tick} m`, left - 4, y(tick) + 4);
  }
  context.textAlign = "center";
  const step = [5, 10, 20, 30, 60, 120, 300, 600].find((s) => (s / (end - begin)) * (right - left) > 52) ?? 1800;
  for (let t = Math.ceil(begin / step) * step; t <= end; t += step) context.fillText(`${t} s`, Math.min(x(t), right - 12), height - 5);
  context.textAlign = "start";
  if (run.tracking_limit_m) {
    context.strokeStyle = colour("bad");
    context.setLineDash([5, 4]);
    context.beginPath();
    context.moveTo(left, y(run.tracking_limit_m));
    context.lineTo(right, y(run.tracking_limit_m));
    context.stroke();
    context.setLineDash([]);
  }
  errors.forEach((series, i) => {
    context.strokeStyle = vehicleColour(i);
    context.globalAlpha = chosen === null || chosen === i ? 1 : 0.25;
    context.lineWidth = chosen === i ? 2.2 : 1.3;
    context.beginPath();
    let pen = false;
    series.forEach((error, k) => {
      if (error === null) pen = false;
      else if (pen) context.lineTo(x(times[k]), y(error));
      else context.moveTo(x(times[k]), y(error));
      pen = error !== null;
    });
    context.stroke();
  });
  context.globalAlpha = 1;
}
