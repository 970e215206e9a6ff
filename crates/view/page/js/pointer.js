// Pointer and keys on the arena: select, tooltip, pan, zoom, and what a drag does in the modes "jam", "lamps" and "link".

import { $ } from "./dom.js";
import { degrees, fixed } from "./format.js";
import { emit, mayAct, on, select, STATUS, store } from "./state.js";
import { begin, setMode } from "./acts.js";
import { camera, drawing, places, redraw, redrawAll } from "./scene.js";

const canvas = $("arena");
const tooltip = $("tooltip");
const REACH_PX = 12;
const CLICK_PX = 4;
const PAN_KEY_PX = 60;
export const ZOOM_STEP = 1.3;

const pointers = new Map();
let drag = null; // { kind, x, y, moved, lamp }
let pinch = null;

const at = (event) => {
	const box = canvas.getBoundingClientRect();
	return [event.clientX - box.left, event.clientY - box.top];
};
const inArena = (px, py) => {
	const { width_m: w, height_m: h } = store.hello ?? { width_m: 1, height_m: 1 };
	return [Math.min(w, Math.max(0, camera.fromX(px))), Math.min(h, Math.max(0, camera.fromY(py)))];
};

/** The robot at a point of the canvas, or null. */
export function robotAt(px, py) {
	const { x, y } = places();
	const r = Math.max(REACH_PX, (store.hello?.radius_m ?? 0) * camera.scale);
	let best = null;
	let least = r * r;
	for (let i = 0; i < x.length; i += 1) {
		const dx = camera.toX(x[i]) - px;
		const dy = camera.toY(y[i]) - py;
		const d = dx * dx + dy * dy;
		if (d < least) [least, best] = [d, i];
	}
	return best;
}

function lampAt(px, py) {
	const lamps = store.field?.lamps ?? [];
	let best = null;
	let least = 22 * 22;
	lamps.forEach((lamp, k) => {
		const d = (camera.toX(lamp.position_m[0]) - px) ** 2 + (camera.toY(lamp.position_m[1]) - py) ** 2;
		if (d < least) [least, best] = [d, k];
	});
	return best;
}

function hover(px, py) {
	const robot = robotAt(px, py);
	const frame = store.frame;
	canvas.style.cursor = store.mode === "jam" ? "crosshair" : store.mode === "lamps" ? (lampAt(px, py) === null ? "default" : "grab") : robot === null ? "grab" : "pointer";
	if (robot === null || !frame || robot >= frame.n) {
		tooltip.hidden = true;
		return;
	}
	const error = frame.error?.[robot];
	const differ = frame.global?.disagreement[robot];
	const lines = [
		`robot ${robot}, ${STATUS[frame.status[robot]] ?? "unknown"}`,
		`x ${fixed(frame.x[robot], 3)} m, y ${fixed(frame.y[robot], 3)} m, heading ${degrees(frame.heading[robot])}`,
	];
	if (frame.error) lines.push(`estimated error ${fixed(error, 3)}${Number.isFinite(error) ? " m" : ""}`);
	if (frame.global && store.layers.global) lines.push(`cells differ by ${Number.isFinite(differ) ? `${fixed(differ * 100, 1)} %` : "–"}`);
	tooltip.replaceChildren(...lines.map((text) => Object.assign(document.createElement("div"), { textContent: text })));
	tooltip.hidden = false;
	const { offsetWidth: w, offsetHeight: h } = tooltip;
	tooltip.style.left = `${Math.max(4, Math.min(camera.width - w - 4, px + 14))}px`;
	tooltip.style.top = `${py + 16 + h > camera.height ? Math.max(4, py - h - 10) : py + 16}px`;
}

function down(event) {
	if (event.button > 0) return;
	canvas.focus({ preventScroll: true });
	canvas.setPointerCapture(event.pointerId);
	const [px, py] = at(event);
	pointers.set(event.pointerId, [px, py]);
	tooltip.hidden = true;
	if (pointers.size === 2) {
		pinch = spread();
		drag = null;
		drawing.draft = null;
		return;
	}
	drag = { kind: "pan", x: px, y: py, moved: false, lamp: null };
	if (store.mode === "jam") {
		drag.kind = "jam";
		drawing.draft = { center_m: inArena(px, py), radius_m: 0 };
	} else if (store.mode === "lamps") {
		const lamp = lampAt(px, py);
		if (lamp !== null) Object.assign(drag, { kind: "lamp", lamp });
	}
}

function spread() {
	const [a, b] = [...pointers.values()];
	return { d: Math.hypot(a[0] - b[0], a[1] - b[1]), x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2 };
}

function move(event) {
	const [px, py] = at(event);
	if (!pointers.has(event.pointerId)) {
		hover(px, py);
		return;
	}
	const [ox, oy] = pointers.get(event.pointerId);
	pointers.set(event.pointerId, [px, py]);
	if (pointers.size === 2 && pinch) {
		const now = spread();
		camera.pan(now.x - pinch.x, now.y - pinch.y);
		camera.zoom(now.d / Math.max(1, pinch.d), now.x, now.y);
		pinch = now;
		redrawAll();
		return;
	}
	if (!drag) return;
	if (Math.hypot(px - drag.x, py - drag.y) > CLICK_PX) drag.moved = true;
	if (drag.kind === "jam") {
		const [cx, cy] = drawing.draft.center_m;
		drawing.draft.radius_m = Math.hypot(camera.fromX(px) - cx, camera.fromY(py) - cy);
		redraw("top");
	} else if (drag.kind === "lamp") {
		drawing.draft = { lamp: drag.lamp, position_m: inArena(px, py) };
		redraw("top");
	} else if (drag.moved) {
		canvas.style.cursor = "grabbing";
		camera.pan(px - ox, py - oy);
		redrawAll();
	}
}

const round3 = (v) => Math.round(v * 1000) / 1000;

function up(event) {
	if (!pointers.delete(event.pointerId)) return;
	if (pointers.size < 2) pinch = null;
	const mine = drag;
	drag = null;
	const draft = drawing.draft;
	drawing.draft = null;
	redraw("top");
	if (!mine || event.type === "pointercancel") return;
	if (mine.kind === "jam") {
		if (draft?.radius_m > 0 && mine.moved) {
			jam(draft.center_m, draft.radius_m);
			setMode(null);
		}
	} else if (mine.kind === "lamp") {
		if (draft && mine.moved) moveLamp(mine.lamp, draft.position_m);
	} else if (!mine.moved) {
		const robot = robotAt(mine.x, mine.y);
		if (store.mode === "link") {
			if (robot !== null && robot !== store.selected) emit("link-partner", robot);
		} else select(robot);
	}
}

export const jam = ([x, y], radius) =>
	begin(`Jam a disc of ${fixed(radius, 2)} m`, { kind: "jam", region: { center_m: [round3(x), round3(y)], radius_m: round3(radius) } });
export const moveLamp = (lamp, [x, y]) => begin(`Move lamp ${lamp}`, { kind: "field", lamp, position_m: [round3(x), round3(y)] });

function step(by) {
	const n = store.hello?.robots ?? 0;
	if (!n) return;
	const from = store.selected === null ? (by > 0 ? -1 : n) : store.selected;
	select((from + by + n) % n);
	const { x, y } = places();
	if (store.selected < x.length) {
		camera.reveal(x[store.selected], y[store.selected]);
		redrawAll();
	}
}

function key(event) {
	if (event.ctrlKey || event.metaKey || event.altKey) return;
	const way = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
	if (way && event.shiftKey) {
		camera.pan(way[0] * PAN_KEY_PX, way[1] * PAN_KEY_PX);
		redrawAll();
	} else if (way) step(event.key === "ArrowRight" || event.key === "ArrowDown" ? 1 : -1);
	else if (event.key === "Home") select(0);
	else if (event.key === "End") select((store.hello?.robots ?? 1) - 1);
	else if (event.key === "Enter") {
		if (store.selected === null) step(1);
		$("inspector-title").focus();
	} else return;
	event.preventDefault();
}

export function zoomBy(factor, px, py) {
	camera.zoom(factor, px, py);
	redrawAll();
}

export function fitView() {
	camera.fit();
	redrawAll();
}

export function startPointer() {
	canvas.addEventListener("pointerdown", down);
	canvas.addEventListener("pointermove", move);
	canvas.addEventListener("pointerup", up);
	canvas.addEventListener("pointercancel", up);
	canvas.addEventListener("pointerleave", () => (tooltip.hidden = true));
	canvas.addEventListener("keydown", key);
	canvas.addEventListener(
		"wheel",
		(event) => {
			event.preventDefault();
			const lines = event.deltaMode === 1 ? 16 : 1;
			zoomBy(Math.exp(Math.max(-0.5, Math.min(0.5, -event.deltaY * lines * 0.0016))), ...at(event));
		},
		{ passive: false },
	);
	$("zoom-in").addEventListener("click", () => zoomBy(ZOOM_STEP));
	$("zoom-out").addEventListener("click", () => zoomBy(1 / ZOOM_STEP));
	$("zoom-fit").addEventListener("click", fitView);
	on("mode", (mode) => {
		drawing.draft = null;
		if (mode && !mayAct()) setMode(null);
	});
}
