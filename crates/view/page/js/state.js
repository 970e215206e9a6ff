// What the page knows of the run, and who wants to hear of changes. Everything else reads from here.

const listeners = new Map();

export const LAYERS = ["field", "trails", "cells", "centroids", "global", "edges"];
export const STATUS = ["present", "paused", "down", "left-out", "not-joined"];

export const store = {
	hello: null,
	field: null,
	state: null,
	faults: [],
	events: [],
	agents: [],
	robot: null, // the inspector's last message
	frame: null, // the newest frame
	selected: null,
	mode: null, // what a drag on the arena does: null (pan), "jam", "lamps", "link"
	layers: { field: true, trails: true, cells: true, centroids: true, global: false, edges: false },
	connected: false,
	ended: false, // the run is over, or the server said goodbye
};

/** Asks to be told of changes of `name`. */
export function on(name, tell) {
	if (!listeners.has(name)) listeners.set(name, []);
	listeners.get(name).push(tell);
}

/** Tells everybody who asked. */
export function emit(name, value) {
	for (const tell of listeners.get(name) ?? []) tell(value);
}

/** Changes what is known and tells. */
export function put(name, value) {
	store[name] = value;
	emit(name, value);
}

/** Selects a robot, or none. */
export function select(robot) {
	const n = store.hello?.robots ?? 0;
	const next = robot === null || !(robot >= 0 && robot < n) ? null : Math.trunc(robot);
	if (next === store.selected) return;
	store.robot = null;
	put("selected", next);
}

/** Whether a fault strikes now. */
export function isActive(fault) {
	const now = store.state?.time_s ?? store.frame?.timeS ?? 0;
	return fault.fired_tick !== null && fault.fired_tick !== undefined && (fault.until_s === null || fault.until_s > now + 1e-9);
}

/** Whether the page may disturb the run. */
export const mayAct = () => Boolean(store.hello?.can_act && store.connected && store.state?.phase !== "over");

/** Whether the page may pause, step and seek: a recording always may. */
export const mayDrive = () => Boolean(store.connected && (store.hello?.source === "recording" || mayAct()));
