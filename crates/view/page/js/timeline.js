// The time axis: windows of faults as bars, events as ticks, and where the run is. In a recording one can go to a time.

import { $, set, setText, svg } from "./dom.js";
import { many, seconds } from "./format.js";
import { isActive, mayDrive, on, store } from "./state.js";
import { act } from "./acts.js";

const axis = $("axis");
const seek = $("seek");
const SIDE = 10; // as far as the thumb of the slider reaches beyond its ends
const LANES = 3;
const LANE_H = 7;
const TOP = 8; // the marker of the time reaches into it
const EVENT_Y = TOP + LANES * LANE_H + 1;
const LINE_Y = EVENT_Y + 7;
const HEIGHT = LINE_Y + 16;

let now = null;
let done = null;
let seeking = false;

const duration = () => Math.max(store.hello?.duration_s ?? 1, store.state?.time_s ?? 0, 1e-9);
let width = 600;
const X = (t) => SIDE + ((width - 2 * SIDE) * Math.min(t, duration())) / duration();

function roundStep(span, most) {
	const rough = span / most;
	const power = 10 ** Math.floor(Math.log10(rough));
	return [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough) ?? 10 * power;
}

function build() {
	width = Math.max(200, axis.clientWidth || 600);
	axis.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
	axis.setAttribute("height", HEIGHT);
	const all = duration();
	const parts = [svg("rect", { class: "rail", x: SIDE, y: LINE_Y - 1, width: width - 2 * SIDE, height: 2 })];
	done = svg("rect", { class: "done", x: SIDE, y: LINE_Y - 1, width: 0, height: 2 });
	parts.push(done);
	const step = roundStep(all, Math.max(2, width / 90));
	const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
	for (let t = 0; t <= all + 1e-9; t += step) {
		const x = X(t);
		parts.push(svg("line", { class: "mark", x1: x, x2: x, y1: LINE_Y - 3, y2: LINE_Y + 3 }));
		parts.push(svg("text", { class: "label", x, y: HEIGHT - 2, "text-anchor": t === 0 ? "start" : x > width - 30 ? "end" : "middle" }, `${t.toFixed(decimals)} s`));
	}
	const ends = new Array(LANES).fill(-Infinity);
	for (const fault of store.faults) {
		const from = X(fault.from_s ?? 0);
		const to = Math.max(from + 3, X(fault.until_s ?? all));
		let lane = ends.findIndex((end) => end <= from);
		if (lane < 0) lane = ends.indexOf(Math.min(...ends));
		ends[lane] = to + 2;
		const fired = fault.fired_tick !== null && fault.fired_tick !== undefined;
		const bar = svg("rect", { class: `bar ${isActive(fault) ? "active" : fired ? "past" : "planned"}`, x: from, y: TOP + lane * LANE_H, width: to - from, height: LANE_H - 2, rx: 1 });
		bar.append(svg("title", {}, `fault ${fault.index}: ${fault.kind}, ${fault.whom}, ${seconds(fault.from_s)} to ${fault.until_s === null ? "the end" : seconds(fault.until_s)}`));
		parts.push(bar);
	}
	const taken = new Set();
	for (const event of store.events) {
		const x = Math.round(X(event.time_s));
		const key = `${event.kind}${x}`;
		if (taken.has(key)) continue;
		taken.add(key);
		parts.push(svg("line", { class: `event ${event.kind}`, x1: x, x2: x, y1: EVENT_Y, y2: LINE_Y - 1 }));
	}
	now = svg("path", { class: "now", d: `M -5 0 H 5 L 0 6 Z M -0.75 5 H 0.75 V ${LINE_Y + 4} H -0.75 Z` });
	parts.push(now);
	axis.replaceChildren(...parts);
	place();
}

function place() {
	const t = seeking ? Number(seek.value) : (store.state?.time_s ?? 0);
	if (!now) return;
	now.setAttribute("transform", `translate(${X(t).toFixed(1)} 0)`);
	done.setAttribute("width", Math.max(0, X(t) - SIDE).toFixed(1));
	if (!seeking) set(seek, "value", String(t));
}

function describe() {
	const active = store.faults.filter(isActive);
	setText(
		$("axis-text"),
		`Time axis from 0 to ${seconds(duration())}. ${many(store.faults.length, "fault")}, ${active.length} active. ${many(store.events.length, "event")} so far.`,
	);
}

let shape = "";

export function startTimeline() {
	new ResizeObserver(build).observe($("timeline"));
	for (const name of ["hello", "faults", "events"]) on(name, build);
	on("hello", (hello) => {
		seek.hidden = hello.source !== "recording";
		seek.max = String(hello.duration_s);
		seek.step = String(hello.step_s ?? 0.1);
	});
	on("state", () => {
		// Bars turn active or past as time goes on.
		const next = store.faults.map((f) => (isActive(f) ? "a" : "-")).join("") + duration();
		if (next !== shape) {
			shape = next;
			build();
			describe();
		} else place();
		seek.disabled = !mayDrive();
	});
	on("events", describe);
	seek.addEventListener("input", () => {
		seeking = true;
		seek.setAttribute("aria-valuetext", seconds(Number(seek.value)));
		place();
	});
	seek.addEventListener("change", async () => {
		const t = Number(seek.value);
		await act(`Go to ${seconds(t)}`, { do: "seek", time_s: t });
		seeking = false;
	});
	build();
}
