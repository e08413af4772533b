// Colours that colour-blind people tell apart (Okabe and Ito), in light and dark; numbers always stand beside them.
const LIGHT = ["#0072b2", "#d55e00", "#007a5a", "#a8467f", "#8a6d00", "#2f7fb5", "#5b4bb0", "#4c5b63"];
const DARK = ["#56b4e9", "#ff8c42", "#2fd0a2", "#e894c3", "#f0e442", "#9ad4f5", "#b3a6ff", "#c3d0d8"];

export function dark() {
  return document.documentElement.dataset.theme === "dark";
}

export function vehicleColour(index) {
  const colours = dark() ? DARK : LIGHT;
  return colours[index % colours.length];
}

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// Makes a canvas as sharp as the screen; returns its context and size in CSS pixels.
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { width, height } = canvas.getBoundingClientRect();
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

// A round step (1, 2 or 5 times a power of ten) of at least this size.
export function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= least * 0.999);
}
