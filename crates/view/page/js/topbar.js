// The bar at the top: what runs, how far it is, and the buttons that pause, step and speed it.

import { $, el, set, setText } from "./dom.js";
import { fixed, micros, seconds, UNKNOWN, whole } from "./format.js";
import { mayDrive, on, store } from "./state.js";
import { act, saveScenario } from "./acts.js";

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
const speed = $("speed");

const speedText = (factor) => (factor === null ? "full speed" : `${factor}× speed`);

export const pauseOrResume = () => {
	if (!mayDrive()) return;
	if (store.state?.paused) act("Resume", { do: "resume" });
	else act("Pause", { do: "pause" });
};
export const stepOnce = () => mayDrive() && act("Step", { do: "step", ticks: 1 });

/** Slower (-1) or faster (+1) by one entry of the list. */
export function changeSpeed(by) {
	if (!mayDrive()) return;
	const now = store.state?.speed ?? null;
	const list = [...SPEEDS, null];
	const at = now === null ? list.length - 1 : Math.max(0, SPEEDS.findLastIndex((s) => s <= now));
	const next = list[Math.max(0, Math.min(list.length - 1, at + by))];
	if (next !== now) setSpeed(next);
}

const setSpeed = (factor) => act(`Set ${speedText(factor)}`, { do: "speed", factor });

/** How many decimals a time needs to tell one tick from the next. */
export const timeDecimals = () => {
	const step = store.hello?.step_s ?? 0.1;
	return Math.max(1, Math.min(4, Math.ceil(-Math.log10(step) - 1e-9)));
};

function tell() {
	const { hello, state } = store;
	const may = mayDrive();
	for (const id of ["pause", "step", "speed"]) set($(id), "disabled", !may);
	set($("save"), "disabled", !(hello?.can_act && store.connected));
	if (!hello || !state) return;
	const phase = !store.connected ? (store.ended ? "over" : "no connection") : state.phase === "running" && state.paused ? "paused" : state.phase;
	setText($("phase"), phase);
	set($("phase"), "className", `chip ${phase.replace(" ", "-")}`);
	const gathering = state.phase === "gathering";
	const d = timeDecimals();
	setText($("time"), `${fixed(state.time_s, d)} / ${seconds(hello.duration_s, d > 1 ? 1 : d)}`);
	set($("progress"), "value", hello.duration_s > 0 ? Math.min(1, state.time_s / hello.duration_s) : 0);
	setText($("tick"), `${whole(state.tick)} / ${whole(state.ticks)}`);
	setText($("rtf"), state.real_time_factor === null ? UNKNOWN : `${fixed(state.real_time_factor, state.real_time_factor < 10 ? 2 : 1)}×`);
	setText($("alive"), gathering ? `${whole(state.joined)} of ${whole(state.robots)} joined` : `${whole(state.metrics?.robots_alive)} of ${whole(state.robots)}`);
	setText($("dropped"), whole(state.frames_dropped));
	setText($("tick-us"), state.tick_us ? `${micros(state.tick_us.p50)} / ${micros(state.tick_us.p99)}` : UNKNOWN);
	setText($("pause"), state.paused ? "Resume" : "Pause");
	showSpeed(state.speed ?? null);
}

function showSpeed(factor) {
	if (document.activeElement === speed) return;
	const value = factor === null ? "" : String(factor);
	if (![...speed.options].some((o) => o.value === value)) speed.append(el("option", { value, textContent: speedText(factor) }));
	set(speed, "value", value);
}

export function startTopbar() {
	speed.append(...[null, ...SPEEDS].map((s) => el("option", { value: s === null ? "" : String(s), textContent: speedText(s) })));
	speed.addEventListener("change", () => setSpeed(speed.value === "" ? null : Number(speed.value)));
	$("pause").addEventListener("click", pauseOrResume);
	$("step").addEventListener("click", stepOnce);
	$("save").addEventListener("click", saveScenario);
	on("hello", (hello) => {
		setText($("run"), hello.run);
		const kind = hello.source === "recording" ? "recording" : hello.mode === "realtime" ? "live, real time" : "live, lock-step";
		const text = [hello.scenario, kind, hello.engine, hello.can_act || hello.source === "recording" ? "" : "watch only"].filter(Boolean).join(" · ");
		setText($("scenario"), text);
		$("scenario").title = text;
		$("run").title = hello.run;
		document.title = `${hello.run} · Lamplight`;
		tell();
	});
	on("state", tell);
	on("connected", tell);
	tell();
}
