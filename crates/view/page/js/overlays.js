// What a frame says beyond poses: local cells with V+ and centroids, global cells, the hearing graph.

import { BATCH, inBatches, plus, polygon } from "./glyphs.js";
import { FATES } from "./theme.js";

export const MOST_EDGES = 12_000;
const FEW = 600;
const CLEAR_DISAGREEMENT = [0.02, 0.1, 0.3]; // shares of the global cell's area, from which on it is highlighted

const near = (camera, x, y, m) => {
  const px = camera.toX(x);
  const py = camera.toY(y);
  return px > -m && py > -m && px < camera.width + m && py < camera.height + m;
};

/** From this size of a robot on, marks of centroids are drawn over the robots, which would hide them. */
export const MARKS_ABOVE_PX = 4;

export function drawCells(context, camera, frame, c, layers, radiusPx) {
  const { cx, cy, corners, positive, starts, xy } = frame.cells;
  const margin = 2 * camera.scale;
  const seen = [];
  for (let i = 0; i < frame.n; i += 1) if (near(camera, frame.x[i], frame.y[i], margin)) seen.push(i);
  if (layers.cells) {
    context.fillStyle = c.positive;
    inBatches(seen.length, BATCH, (path, k) => polygon(path, camera, xy, starts[seen[k]] + 2 * corners[seen[k]], positive[seen[k]]), (path) => context.fill(path));
    context.strokeStyle = c.cell;
    context.lineWidth = 1;
    inBatches(seen.length, BATCH, (path, k) => polygon(path, camera, xy, starts[seen[k]], corners[seen[k]]), (path) => context.stroke(path));
  }
  if (layers.centroids) {
    const way = (path, k) => {
      const i = seen[k];
      if (!Number.isFinite(cx[i])) return;
      path.moveTo(camera.toX(frame.x[i]), camera.toY(frame.y[i]));
      path.lineTo(camera.toX(cx[i]), camera.toY(cy[i]));
    };
    context.strokeStyle = c.toCentroid;
    context.lineWidth = 1;
    inBatches(seen.length, 4 * BATCH, way, (path) => context.stroke(path));
    if (radiusPx < MARKS_ABOVE_PX) drawMarks(context, camera, frame, c, camera.scale > 25 ? 2 : 1.2);
  }
}

/** Crosses at the centroids. */
export function drawMarks(context, camera, frame, c, size) {
  const { cx, cy } = frame.cells;
  const add = (path, i) => {
    if (Number.isFinite(cx[i]) && near(camera, cx[i], cy[i], 5)) plus(path, camera.toX(cx[i]), camera.toY(cy[i]), size);
  };
  const stroke = (color, width) => {
    context.strokeStyle = color;
    context.lineWidth = width;
    inBatches(frame.n, 4 * BATCH, add, (path) => context.stroke(path));
  };
  if (size > 3) stroke(c.page, 4);
  stroke(c.centroid, size > 3 ? 1.8 : 1);
}

export function drawGlobal(context, camera, frame, c) {
  const { disagreement, corners, starts, xy } = frame.global;
  const margin = 2 * camera.scale;
  const seen = [];
  for (let i = 0; i < frame.n; i += 1) if (near(camera, frame.x[i], frame.y[i], margin)) seen.push(i);
  const add = (path, i) => polygon(path, camera, xy, starts[i], corners[i]);
  CLEAR_DISAGREEMENT.forEach((from, band) => {
    const below = CLEAR_DISAGREEMENT[band + 1] ?? Infinity;
    const differ = seen.filter((i) => disagreement[i] >= from && disagreement[i] < below);
    context.fillStyle = c.differ[band];
    inBatches(differ.length, BATCH, (path, k) => add(path, differ[k]), (path) => context.fill(path));
  });
  context.strokeStyle = c.global;
  context.lineWidth = 1;
  // Dashes cost time with each of their pieces: where cells are small, lines are whole.
  if (seen.length < FEW) context.setLineDash([4, 3]);
  inBatches(seen.length, BATCH, (path, k) => add(path, seen[k]), (path) => context.stroke(path));
  context.setLineDash([]);
}

/** Each packet is drawn over the half of its way next to who should hear it. Returns how many were too many to draw. */
export function drawEdges(context, camera, frame, c, selected) {
  const { count, sender, receiver, fate } = frame.edges;
  const { x, y, n } = frame;
  const lines = FATES.map(() => []);
  let drawn = 0;
  let leftOut = 0;
  for (let k = 0; k < count; k += 1) {
    const s = sender[k];
    const r = receiver[k];
    if (s >= n || r >= n) continue;
    if (selected !== null && s !== selected && r !== selected) continue;
    const x1 = camera.toX(x[r]);
    const y1 = camera.toY(y[r]);
    const x0 = (camera.toX(x[s]) + x1) / 2;
    const y0 = (camera.toY(y[s]) + y1) / 2;
    if ((x1 < 0 && x0 < 0) || (y1 < 0 && y0 < 0) || (x1 > camera.width && x0 > camera.width) || (y1 > camera.height && y0 > camera.height)) continue;
    if (drawn >= MOST_EDGES) {
      leftOut += 1;
      continue;
    }
    drawn += 1;
    lines[Math.min(fate[k], FATES.length - 1)].push(x0, y0, x1, y1);
  }
  lines.forEach((list, f) => {
    context.strokeStyle = c.edge[f];
    // A line of at most one pixel is drawn without being turned into an outline first.
    context.lineWidth = f === 0 || drawn > 4 * FEW ? 1 : 1.4;
    context.setLineDash(FATES[f].dash);
    const add = (path, k) => {
      path.moveTo(list[4 * k], list[4 * k + 1]);
      path.lineTo(list[4 * k + 2], list[4 * k + 3]);
    };
    inBatches(list.length / 4, f === 0 ? 4 * BATCH : BATCH, add, (path) => context.stroke(path));
  });
  context.setLineDash([]);
  return leftOut;
}

export function drawSelectedCell(context, camera, frame, c, i) {
  if (!frame.cells || i >= frame.n) return;
  const { cx, cy, corners, positive, starts, xy } = frame.cells;
  const part = new Path2D();
  polygon(part, camera, xy, starts[i] + 2 * corners[i], positive[i]);
  context.fillStyle = c.selectFill;
  context.fill(part);
  const cell = new Path2D();
  polygon(cell, camera, xy, starts[i], corners[i]);
  context.strokeStyle = c.select;
  context.lineWidth = 1.6;
  context.stroke(cell);
  if (!Number.isFinite(cx[i])) return;
  const mark = new Path2D();
  mark.moveTo(camera.toX(frame.x[i]), camera.toY(frame.y[i]));
  mark.lineTo(camera.toX(cx[i]), camera.toY(cy[i]));
  plus(mark, camera.toX(cx[i]), camera.toY(cy[i]), 5);
  context.stroke(mark);
}
