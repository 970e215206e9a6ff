// What a frame says beyond poses: local cells with V+ and centroids, global cells, the hearing graph.

import { BATCH, inBatches, plus, polygon } from "./glyphs.js";
import { FATES } from "./theme.js";

const MOST_EDGES = 12_000;
const FEW = 600;
const CLEAR_DISAGREEMENT = [0.02, 0.1, 0.3]; // shares of the global cell's area, from which on it is highlighted

const near = (camera, x, y, m) => {
	const px = camera.toX(x);
	const py = camera.toY(y);
	return px > -m && py > -m && px < camera.width + m && py < camera.height + m;
};

const coarse = new OffscreenCanvas(1, 1);

/**
 * Fills the polygons of many robots. Faint areas of many are filled at half the resolution: that takes half the time, and
 * their outlines are drawn in full anyway.
 */
function fillMany(context, camera, color, who, add) {
	const paintOn = (target) => {
		target.fillStyle = color;
		inBatches(who.length, BATCH, (path, k) => add(path, who[k]), (path) => target.fill(path));
	};
	if (who.length < FEW) {
		paintOn(context);
		return;
	}
	const width = Math.ceil(camera.width / 2);
	const height = Math.ceil(camera.height / 2);
	if (coarse.width !== width || coarse.height !== height) [coarse.width, coarse.height] = [width, height];
	const half = coarse.getContext("2d");
	half.setTransform(0.5, 0, 0, 0.5, 0, 0);
	half.clearRect(0, 0, 2 * width, 2 * height);
	paintOn(half);
	context.drawImage(coarse, 0, 0, 2 * width, 2 * height);
}

/** From this size of a robot on, marks of centroids are drawn over the robots, which would hide them. */
export const MARKS_ABOVE_PX = 4;

export function drawCells(context, camera, frame, c, layers, radiusPx) {
	const { cx, cy, corners, positive, starts, xy } = frame.cells;
	const margin = 2 * camera.scale;
	const seen = [];
	for (const i of frame.order) if (near(camera, frame.x[i], frame.y[i], margin)) seen.push(i);
	if (layers.cells) {
		fillMany(context, camera, c.positive, seen, (path, i) => polygon(path, camera, xy, starts[i] + 2 * corners[i], positive[i]));
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
		// Where crosses would only blur the picture, the end of the line is the centroid.
		if (radiusPx < MARKS_ABOVE_PX && seen.length < 2 * FEW) drawMarks(context, camera, frame, c, 2);
	}
}

/** Crosses at the centroids. */
export function drawMarks(context, camera, frame, c, size) {
	const { cx, cy } = frame.cells;
	const add = (path, k) => {
		const i = frame.order[k];
		if (Number.isFinite(cx[i]) && near(camera, cx[i], cy[i], 5)) plus(path, camera.toX(cx[i]), camera.toY(cy[i]), size);
	};
	const stroke = (color, width) => {
		context.strokeStyle = color;
		context.lineWidth = width;
		inBatches(frame.n, 4 * BATCH, add, (path) => context.stroke(path));
	};
	if (size > 3) stroke(c.page, 3.6);
	stroke(c.centroid, size > 3 ? 1.8 : 1);
}

export function drawGlobal(context, camera, frame, c) {
	const { disagreement, corners, starts, xy } = frame.global;
	const margin = 2 * camera.scale;
	const seen = [];
	for (const i of frame.order) if (near(camera, frame.x[i], frame.y[i], margin)) seen.push(i);
	const add = (path, i) => polygon(path, camera, xy, starts[i], corners[i]);
	CLEAR_DISAGREEMENT.forEach((from, band) => {
		const below = CLEAR_DISAGREEMENT[band + 1] ?? Infinity;
		const differ = seen.filter((i) => disagreement[i] >= from && disagreement[i] < below);
		fillMany(context, camera, c.differ[band], differ, add);
	});
	context.strokeStyle = c.global;
	context.lineWidth = 1;
	// Dashes cost time with each of their pieces: where cells are small, lines are whole.
	if (seen.length < FEW) context.setLineDash([4, 3]);
	inBatches(seen.length, BATCH, (path, k) => add(path, seen[k]), (path) => context.stroke(path));
	context.setLineDash([]);
}

/**
 * Each packet is drawn over the half of its way next to who should hear it. Where too many are to be seen, one of so many
 * is drawn, evenly; returns of how many.
 */
export function drawEdges(context, camera, frame, c, selected) {
	const { count, sender, receiver, fate } = frame.edges;
	const { x, y, n } = frame;
	const seen = [];
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
		seen.push(k);
	}
	const oneOf = Math.max(1, Math.ceil(seen.length / MOST_EDGES));
	const drawn = seen.length / oneOf;
	const lines = FATES.map(() => []);
	for (let q = 0; q < seen.length; q += oneOf) {
		const k = seen[q];
		const x1 = camera.toX(x[receiver[k]]);
		const y1 = camera.toY(y[receiver[k]]);
		lines[Math.min(fate[k], FATES.length - 1)].push((camera.toX(x[sender[k]]) + x1) / 2, (camera.toY(y[sender[k]]) + y1) / 2, x1, y1);
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
	return oneOf;
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
