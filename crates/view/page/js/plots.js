// Mean estimated error, cost H and live robots over virtual time. What is not known is a gap, never a zero.

import { $, atMost, el, setText } from "./dom.js";
import { short, whole } from "./format.js";
import { on, store } from "./state.js";
import { colors } from "./theme.js";

const MOST_POINTS = 12_000;
const REDRAW_MS = 400;

const KINDS = [
	{ key: "mean_error_m", name: "mean estimated error", label: "ê (m)", text: (v) => (v === null ? "–" : `${short(v)} m`) },
	{ key: "cost_h", name: "cost", label: "H", text: (v) => short(v) },
	{ key: "alive", name: "robots alive", label: "robots", text: (v) => whole(v), step: true },
];

let times = [];
let values = KINDS.map(() => []);
let plots = [];
const readings = [];

export const plotPoints = () => times.length;

const known = (v) => (typeof v === "number" && Number.isFinite(v) ? v : null);

function take({ points, replace }) {
	if (replace) {
		times = [];
		values = KINDS.map(() => []);
	}
	for (const point of points) {
		if (times.length && point.time_s <= times[times.length - 1]) continue;
		times.push(point.time_s);
		KINDS.forEach((kind, k) => values[k].push(known(point[kind.key])));
	}
	if (times.length > MOST_POINTS) {
		// Every second point of the older half goes: the picture has not so many columns.
		const half = times.length >> 1;
		const keep = (_, i) => i >= half || i % 2 === 0;
		times = times.filter(keep);
		values = values.map((v) => v.filter(keep));
	}
	refresh();
}

const refresh = atMost(REDRAW_MS, () => {
	plots.forEach((plot, k) => plot.setData([times, values[k]]));
	read(null);
});

/** Says the value under the cursor, or the newest. */
function read(index) {
	KINDS.forEach((kind, k) => {
		const at = index ?? times.length - 1;
		const value = at >= 0 && at < times.length ? values[k][at] : null;
		setText(readings[k], index === null ? kind.text(value) : `${kind.text(value)} at ${short(times[at])} s`);
	});
}

function options(kind, k, width, height, last) {
	const axis = { stroke: () => colors().axis, grid: { stroke: () => colors().grid, width: 1 }, ticks: { stroke: () => colors().grid, width: 1, size: 4 }, font: "11px system-ui, sans-serif", labelFont: "11px system-ui, sans-serif", gap: 3 };
	return {
		width,
		height,
		padding: [6, 10, last ? 0 : 2, 0],
		legend: { show: false },
		cursor: { sync: { key: "lamplight" }, y: false, points: { size: 6 }, drag: { x: true, y: false } },
		scales: { x: { time: false, range: (u, min, max) => (min === null || max <= min ? [0, Math.max(store.hello?.duration_s ?? 1, 1e-3)] : [min, max]) }, y: { range: (u, min, max) => span(min, max, kind.step) } },
		axes: [
			{ ...axis, size: last ? 34 : 20, space: 54, label: last ? "virtual time (s)" : undefined, labelSize: 14, values: (u, ticks) => ticks.map((v) => (v === null ? "" : String(Number(v.toPrecision(6))))) },
			{ ...axis, size: 46, space: 24, label: kind.label, labelSize: 14, values: (u, ticks) => ticks.map((v) => (v === null ? "" : compact(v))) },
		],
		series: [{}, { stroke: () => colors().series[k], width: 1.5, spanGaps: false, points: { show: false }, paths: kind.step ? uPlot.paths.stepped({ align: 1 }) : undefined }],
		hooks: { setCursor: [(u) => read(u.cursor.left >= 0 && u.cursor.idx !== null && u.cursor.idx !== undefined ? u.cursor.idx : null)] },
	};
}

function compact(v) {
	const size = Math.abs(v);
	if (size !== 0 && (size >= 1e5 || size < 1e-3)) return v.toExponential(0);
	return String(Number(v.toPrecision(4)));
}

function span(min, max, counts) {
	if (min === null || max === null) return [0, 1];
	if (counts) return [0, Math.max(1, max * 1.08)];
	const pad = (max - min || Math.abs(max) || 1) * 0.08;
	return [min >= 0 ? Math.max(0, min - pad) : min - pad, max + pad];
}

function make() {
	const host = $("plots");
	host.replaceChildren();
	plots = KINDS.map((kind, k) => {
		readings[k] = el("span", { className: "reading", "data-testid": `plot-${kind.key}` }, "–");
		const place = el("div", { className: "place" });
		host.append(el("figure", { className: "plot", role: "group", "aria-label": kind.name }, el("figcaption", {}, el("span", {}, kind.name), readings[k]), place));
		return new uPlot(options(kind, k, 300, 100, k === KINDS.length - 1), [times, values[k]], place);
	});
}

function resize() {
	const host = $("plots");
	const places = host.querySelectorAll(".place");
	plots.forEach((plot, k) => {
		const { clientWidth: w, clientHeight: h } = places[k];
		if (w > 40 && h > 40 && (plot.width !== w || plot.height !== h)) plot.setSize({ width: w, height: h });
	});
}

export function startPlots() {
	make();
	new ResizeObserver(resize).observe($("plots"));
	on("message:series", take);
	on("hello", () => take({ points: [], replace: true }));
	on("theme", () => plots.forEach((plot) => plot.redraw(false, true)));
}
