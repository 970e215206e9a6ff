// The picture of the arena, in three canvases on top of each other: what hardly changes (φ, walls), what comes with a frame
// (cells, packets), and robots, which are also drawn between frames. Drawn only when something has changed.

import { $ } from "./dom.js";
import { emit, isActive, on, store } from "./state.js";
import { send } from "./stream.js";
import { makeCamera } from "./camera.js";
import { heatMap } from "./heatmap.js";
import { colors } from "./theme.js";
import { bySquares } from "./order.js";
import { makePace } from "./pace.js";
import { Trails } from "./trails.js";
import { inBatches, lamp, paint, roundLength, shape } from "./glyphs.js";
import { drawCells, drawEdges, drawGlobal, drawMarks, drawSelectedCell, MARKS_ABOVE_PX } from "./overlays.js";

const calm = matchMedia("(prefers-reduced-motion: reduce)");
const SLOW_FRAME_MS = 45; // frames that come faster than this need nothing between them
const LONGEST_GLIDE_MS = 1000;
const FPS_WINDOW_MS = 2000;
const BODIES = 48; // robots in a path

export const camera = makeCamera();

const stage = $("stage");
const canvases = ["c-base", "c-data", "arena"].map($);
const [base, data, top] = canvases.map((c) => c.getContext("2d"));

let ratio = 1;
let heat = null;
let trails = null;
let dirty = { base: true, data: true, top: true };
let requested = false;
let undrawn = 0; // frames that came since the last drawing
let before = null; // poses to glide from: { x, y }
let shown = { x: new Float32Array(0), y: new Float32Array(0) };
let arrived = 0;
let glideMs = 0;
const drawnAt = [];
const pace = makePace();
let restTimer = 0;
let inked = null; // the colors of the last drawing

export const cellsEvery = () => pace.every;
export const drawing = { frames: 0, fps: 0, edgesOneOf: 1, draft: null /* disc or lamp being dragged */ };

/** Asks for a drawing of the parts that have changed. */
export function redraw(...parts) {
	for (const part of parts) dirty[part] = true;
	if (requested) return;
	requested = true;
	requestAnimationFrame(draw);
}

export const redrawAll = () => redraw("base", "data", "top");

/** Where robots are drawn now, in meters. */
export const places = () => shown;

function draw(now) {
	requested = false;
	pace.begin();
	const c = colors();
	// The system's choice of light or dark may have changed without its event having come yet.
	if (inked && inked !== c) emit("theme");
	inked = c;
	if (dirty.base) drawBase(c);
	const frame = store.frame;
	if (frame) {
		glide(now, frame);
		if (dirty.data) drawData(c, frame);
		if (dirty.top) drawTop(c, frame);
		if (undrawn > 0) {
			drawing.frames += 1;
			drawnAt.push(now);
			// Each frame is answered, also one that a newer one has overtaken: the server counts those under way.
			for (; undrawn > 0; undrawn -= 1) send({ type: "drawn" });
		}
	} else top.clearRect(0, 0, camera.width, camera.height);
	dirty = { base: false, data: false, top: false };
	if (before) redraw("top");
}

export function measureFps() {
	const from = performance.now() - FPS_WINDOW_MS;
	while (drawnAt.length && drawnAt[0] < from) drawnAt.shift();
	drawing.fps = drawnAt.length / (FPS_WINDOW_MS / 1000);
	return drawing.fps;
}

/** Poses between the last two frames, if these come slowly; headings and cells are the newer frame's. */
function glide(now, frame) {
	const n = frame.n;
	if (shown.x.length !== n) shown = { x: new Float32Array(n), y: new Float32Array(n) };
	const t = before && glideMs > 0 ? Math.min(1, (now - arrived) / glideMs) : 1;
	if (t >= 1) {
		before = null;
		shown.x.set(frame.x);
		shown.y.set(frame.y);
		return;
	}
	for (let i = 0; i < n; i += 1) {
		shown.x[i] = before.x[i] + (frame.x[i] - before.x[i]) * t;
		shown.y[i] = before.y[i] + (frame.y[i] - before.y[i]) * t;
	}
	dirty.top = true;
}

function takeFrame(frame) {
	const old = store.frame;
	const now = performance.now();
	const follows = old && old.n === frame.n && frame.tick >= old.tick && frame.timeS - old.timeS < 5;
	const gap = now - arrived;
	if (!trails || trails.n !== frame.n || !follows) newTrails(frame.n);
	before = null;
	if (follows && frame.tick !== old.tick && gap > SLOW_FRAME_MS && pace.mayGlide && !calm.matches && shown.x.length === frame.n) {
		before = { x: shown.x.slice(), y: shown.y.slice() };
		glideMs = gap > 1.5 * LONGEST_GLIDE_MS ? 200 : Math.min(gap, LONGEST_GLIDE_MS);
	}
	arrived = now;
	store.frame = frame;
	frame.order = bySquares(frame, store.hello?.width_m ?? 1, store.hello?.height_m ?? 1);
	trails.add(frame);
	undrawn += 1;
	emit("frame", frame);
	const whole = pace.due();
	clearTimeout(restTimer);
	if (!whole) restTimer = setTimeout(() => redraw("data"), 120);
	redraw(...(whole ? ["data", "top"] : ["top"]));
}

function newTrails(n) {
	trails = new Trails(n, Math.max(1e-4, 0.35 * (store.hello?.radius_m ?? 0.05)));
}

function clear(context, c) {
	context.setTransform(ratio, 0, 0, ratio, 0, 0);
	if (c) {
		context.fillStyle = c.page;
		context.fillRect(0, 0, camera.width, camera.height);
	} else context.clearRect(0, 0, camera.width, camera.height);
}

function drawBase(c) {
	clear(base, c);
	const hello = store.hello;
	if (!hello) return;
	const { width_m: w, height_m: h } = hello;
	const x = camera.toX(0);
	const y = camera.toY(h);
	if (store.layers.field && store.field) {
		heat ??= heatMap(store.field, w, h, c.heat);
		base.imageSmoothingEnabled = true;
		base.imageSmoothingQuality = "high";
		base.drawImage(heat.image, x, y, w * camera.scale, h * camera.scale);
		const path = new Path2D();
		const s = heat.contours;
		for (let k = 0; k + 3 < s.length; k += 4) {
			path.moveTo(camera.toX(s[k]), camera.toY(s[k + 1]));
			path.lineTo(camera.toX(s[k + 2]), camera.toY(s[k + 3]));
		}
		base.strokeStyle = c.contour;
		base.lineWidth = 1;
		base.stroke(path);
	}
	base.strokeStyle = c.wall;
	base.lineWidth = 2;
	base.strokeRect(x - 1, y - 1, w * camera.scale + 2, h * camera.scale + 2);
}

function drawScale(c) {
	const [meters, label] = roundLength(Math.min(140, camera.width / 3) / camera.scale);
	const long = meters * camera.scale;
	const x = 14;
	const y = camera.height - 10;
	top.font = "12px system-ui, sans-serif";
	const bar = new Path2D();
	bar.moveTo(x, y - 5);
	bar.lineTo(x, y);
	bar.lineTo(x + long, y);
	bar.lineTo(x + long, y - 5);
	top.lineJoin = "round";
	for (const [color, width] of [[c.page, 4.5], [c.text, 1.5]]) {
		top.strokeStyle = color;
		top.lineWidth = width;
		top.stroke(bar);
		if (width > 2) top.strokeText(label, x + 8, y - 6);
	}
	top.fillStyle = c.text;
	top.textAlign = "left";
	top.fillText(label, x + 8, y - 6);
}

function drawData(c, frame) {
	clear(data);
	if (store.layers.global && frame.global) drawGlobal(data, camera, frame, c);
	if (frame.cells && (store.layers.cells || store.layers.centroids)) drawCells(data, camera, frame, c, store.layers, radiusPx());
	if (pace.every > 1) drawTrails(data, c, frame);
	if (store.layers.edges && frame.edges) {
		const oneOf = drawEdges(data, camera, frame, c, store.selected);
		if (oneOf !== drawing.edgesOneOf) {
			drawing.edgesOneOf = oneOf;
			emit("edges-one-of", oneOf);
		}
	}
	if (store.selected !== null) drawSelectedCell(data, camera, frame, c, store.selected);
}

function drawJams(c) {
	const discs = store.faults.filter((f) => f.region && isActive(f)).map((f) => f.region);
	if (drawing.draft?.radius_m > 0) discs.push(drawing.draft);
	for (const disc of discs) {
		const path = new Path2D();
		path.arc(camera.toX(disc.center_m[0]), camera.toY(disc.center_m[1]), disc.radius_m * camera.scale, 0, 2 * Math.PI);
		top.fillStyle = c.jamFill;
		top.fill(path);
		top.strokeStyle = c.jam;
		top.lineWidth = 1.5;
		top.setLineDash([6, 4]);
		top.stroke(path);
		top.setLineDash([]);
	}
}

/** A robot on the screen, never too small to be seen. */
const radiusPx = () => Math.max(1.6, (store.hello?.radius_m ?? 0.05) * camera.scale);

const visible = (x, y) => {
	const far = 20 + radiusPx();
	const px = camera.toX(x);
	const py = camera.toY(y);
	return px > -far && py > -far && px < camera.width + far && py < camera.height + far;
};

/** Trails end at the robots as drawn; where drawing is slow they are among what is drawn less often. */
function drawTrails(context, c, frame) {
	if (store.layers.trails && trails) trails.draw(context, camera, c.trail, shown.x, shown.y, visible, frame.order);
}

function drawTop(c, frame) {
	clear(top);
	const r = radiusPx();
	drawJams(c);
	if (pace.every === 1) drawTrails(top, c, frame);
	drawBodies(c, frame, r);
	if (store.layers.centroids && frame.cells && r >= MARKS_ABOVE_PX) drawMarks(top, camera, frame, c, Math.max(3.1, Math.min(4.5, r * 0.4)));
	const lamps = store.field?.lamps ?? [];
	for (let k = 0; k < lamps.length; k += 1) {
		const at = drawing.draft?.lamp === k ? drawing.draft.position_m : lamps[k].position_m;
		lamp(top, camera.toX(at[0]), camera.toY(at[1]), c, store.mode === "lamps" ? 8 : 6);
	}
	if (store.selected !== null && store.selected < frame.n) drawSelected(c, frame, r);
	drawScale(c);
}

function drawBodies(c, frame, r) {
	const { x, y } = shown;
	const of = [[], [], [], [], []];
	for (const i of frame.order) if (visible(x[i], y[i])) of[Math.min(4, frame.status[i])].push(i);
	const small = r < MARKS_ABOVE_PX;
	const from = small ? r * 0.6 : 0;
	const to = small ? r + 2.5 : r;
	for (const status of [4, 3, 2, 1, 0]) {
		const who = of[status];
		const body = (path, k) => shape(path, status, camera.toX(x[who[k]]), camera.toY(y[who[k]]), r);
		inBatches(who.length, BODIES, body, (path) => paint(top, path, status, c, r));
		if (status > 1) continue;
		const nose = (path, k) => {
			const i = who[k];
			const px = camera.toX(x[i]);
			const py = camera.toY(y[i]);
			const dx = Math.cos(frame.heading[i]);
			const dy = -Math.sin(frame.heading[i]);
			path.moveTo(px + dx * from, py + dy * from);
			path.lineTo(px + dx * to, py + dy * to);
		};
		top.strokeStyle = status === 1 ? c.paused : small ? c.robot : c.robotEdge;
		top.lineWidth = small ? 1 : Math.max(1.5, r * 0.22);
		inBatches(who.length, BODIES, nose, (path) => top.stroke(path));
	}
}

/** The selected robot: a ring, how far it hears, and where it believes its neighbors to be. */
function drawSelected(c, frame, r) {
	const i = store.selected;
	const px = camera.toX(shown.x[i]);
	const py = camera.toY(shown.y[i]);
	top.strokeStyle = c.select;
	top.lineWidth = 2.2;
	top.beginPath();
	top.arc(px, py, r + 3.5, 0, 2 * Math.PI);
	top.stroke();
	if (store.hello?.range_m) {
		top.lineWidth = 1;
		top.setLineDash([2, 4]);
		top.beginPath();
		top.arc(px, py, store.hello.range_m * camera.scale, 0, 2 * Math.PI);
		top.stroke();
		top.setLineDash([]);
	}
	const robot = store.robot;
	if (robot?.robot === i && robot.pose) {
		const marks = new Path2D();
		for (const neighbor of robot.neighbors ?? []) {
			const a = robot.pose.heading_rad + neighbor.bearing_rad;
			const nx = camera.toX(robot.pose.x_m + neighbor.range_m * Math.cos(a));
			const ny = camera.toY(robot.pose.y_m + neighbor.range_m * Math.sin(a));
			marks.moveTo(nx + r + 1.5, ny);
			marks.arc(nx, ny, r + 1.5, 0, 2 * Math.PI);
		}
		top.lineWidth = 1.2;
		top.stroke(marks);
	}
	top.font = "600 12px system-ui, sans-serif";
	top.textAlign = "left";
	const label = String(i);
	top.lineWidth = 3.5;
	top.strokeStyle = c.page;
	top.lineJoin = "round";
	top.strokeText(label, px + r + 6, py - r - 3);
	top.fillStyle = c.select;
	top.fillText(label, px + r + 6, py - r - 3);
}

/** The heat map's range and colors, for the legend. */
export const heatOf = () => heat;

export function startScene() {
	const resize = () => {
		const box = stage.getBoundingClientRect();
		if (box.width < 2 || box.height < 2) return;
		ratio = Math.min(2, devicePixelRatio || 1);
		for (const canvas of canvases) {
			canvas.width = Math.round(box.width * ratio);
			canvas.height = Math.round(box.height * ratio);
		}
		camera.resize(box.width, box.height);
		redrawAll();
	};
	new ResizeObserver(resize).observe(stage);
	on("hello", (hello) => {
		camera.arena = [hello.width_m, hello.height_m];
		camera.fit();
		heat = null;
		before = null;
		newTrails(hello.robots);
		store.frame = null;
		shown = { x: new Float32Array(0), y: new Float32Array(0) };
		clear(data);
		redrawAll();
	});
	const reheat = () => {
		heat = null;
		if (store.hello && store.field) heat = heatMap(store.field, store.hello.width_m, store.hello.height_m, colors().heat);
		emit("heat", heat);
		redrawAll();
	};
	on("field", reheat);
	on("theme", reheat);
	on("layers", redrawAll);
	on("selected", () => redraw("data", "top"));
	on("robot", () => redraw("top"));
	on("faults", () => redraw("top"));
	on("mode", () => redraw("top"));
	on("message:frame", takeFrame);
}
