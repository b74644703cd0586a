// Densities over time as a picture with axes: time, frequency, and a scale of decibels.
import { ink, make } from "./make.js";

const STOPS = [[13, 8, 65], [84, 2, 163], [157, 23, 128], [213, 74, 76], [249, 149, 64], [252, 253, 191]];

function shade(value) {
  const place = (value / 255) * (STOPS.length - 1), k = Math.min(STOPS.length - 2, Math.floor(place)), part = place - k;
  return STOPS[k].map((low, i) => Math.round(low + part * (STOPS[k + 1][i] - low)));
}

function steps(low, high, most) {
  const raw = (high - low) / most, size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * size).find((s) => s >= raw);
  const found = [];
  for (let at = Math.ceil(low / step) * step; at <= high + 1e-9; at += step) found.push(+at.toPrecision(9));
  return found;
}

export function spectrogram(home, picture, { shift, unit, rotor }) {
  const width = home.clientWidth || 320, height = 250, scale = devicePixelRatio;
  const canvas = make("canvas", { "aria-label": "spectrogram" });
  canvas.width = width * scale;
  canvas.height = height * scale;
  canvas.style.cssText = `width:${width}px;height:${height}px;display:block`;
  home.append(canvas);
  const ctx = canvas.getContext("2d");
  ctx.scale(scale, scale);
  const left = 46, bottom = 36, right = 72, top = 8, wide = width - left - right, tall = height - top - bottom;
  const rows = picture.shade.length, columns = picture.shade[0].length;
  const small = new OffscreenCanvas(columns, rows), pixels = new ImageData(columns, rows);
  picture.shade.forEach((row, r) => row.forEach((value, c) => pixels.data.set([...shade(value), 255], 4 * ((rows - 1 - r) * columns + c))));
  small.getContext("2d").putImageData(pixels, 0, 0);
  ctx.imageSmoothingEnabled = false;
  ctx.drawImage(small, left, top, wide, tall);
  ctx.font = "11.5px system-ui, sans-serif";
  ctx.fillStyle = ink("soft");
  const [t0, t1] = picture.time.map((t) => t + shift), [f0, f1] = picture.frequency;
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  for (const t of steps(t0, t1, Math.max(2, wide / 80))) ctx.fillText(String(t), left + ((t - t0) / (t1 - t0 || 1)) * wide, top + tall + 4);
  ctx.fillText("time [s]", left + wide / 2, top + tall + 20);
  ctx.textAlign = "right";
  ctx.textBaseline = "middle";
  for (const f of steps(f0, f1, 5)) ctx.fillText(String(f), left - 5, top + tall - ((f - f0) / (f1 - f0)) * tall);
  ctx.save();
  ctx.translate(9, top + tall / 2);
  ctx.rotate(-Math.PI / 2);
  ctx.textAlign = "center";
  ctx.fillText("frequency [Hz]", 0, 0);
  ctx.restore();
  // The scale: decibels of unit²/Hz.
  for (let y = 0; y < tall; y++) {
    ctx.fillStyle = `rgb(${shade(255 * (1 - y / tall)).join(",")})`;
    ctx.fillRect(width - right + 8, top + y, 10, 1.5);
  }
  ctx.fillStyle = ink("soft");
  ctx.textAlign = "left";
  for (const share of [0, 0.5, 1]) {
    const y = top + tall * (1 - share);
    ctx.textBaseline = share === 1 ? "top" : share === 0 ? "bottom" : "middle";
    ctx.fillText(`${(picture.floor + share * (picture.top - picture.floor)).toFixed(0)} dB`, width - right + 22, y);
  }
  ctx.strokeStyle = "#ffffffa0";
  ctx.setLineDash([4, 4]);
  for (const { frequency } of rotor.harmonics) {
    const y = top + tall - ((frequency - f0) / (f1 - f0)) * tall;
    ctx.beginPath();
    ctx.moveTo(left, y);
    ctx.lineTo(left + wide, y);
    ctx.stroke();
  }
  canvas.title = `0 dB is 1 (${unit || "1"})²/Hz`;
}
