// Shortcuts of one key, and the dialog that lists them. They can be turned off, for those whom single keys get in the way of.

import { $, el } from "./dom.js";
import { select, store } from "./state.js";
import { setMode } from "./acts.js";
import { toggleLayer } from "./legend.js";
import { fitView, ZOOM_STEP, zoomBy } from "./pointer.js";
import { openTab } from "./tabs.js";
import { changeSpeed, pauseOrResume, stepOnce } from "./topbar.js";

const dialog = $("help-dialog");
const focusOn = (id) => $(id).focus();

const SHORTCUTS = [
	[" ", "space", "pause or resume the run", pauseOrResume],
	[".", ".", "step by one tick", stepOnce],
	["[", "[", "slower", () => changeSpeed(-1)],
	["]", "]", "faster", () => changeSpeed(1)],
	["+", "+", "zoom in", () => zoomBy(ZOOM_STEP)],
	["=", null, null, () => zoomBy(ZOOM_STEP)],
	["-", "-", "zoom out", () => zoomBy(1 / ZOOM_STEP)],
	["0", "0", "show the whole arena", fitView],
	["f", "f", "φ on or off", () => toggleLayer("field")],
	["t", "t", "trails on or off", () => toggleLayer("trails")],
	["c", "c", "local cells on or off", () => toggleLayer("cells")],
	["m", "m", "centroids on or off", () => toggleLayer("centroids")],
	["g", "g", "global cells on or off", () => toggleLayer("global")],
	["h", "h", "hearing graph on or off", () => toggleLayer("edges")],
	["a", "a", "to the arena", () => focusOn("arena")],
	["r", "r", "to the number of the robot", () => focusOn("robot-number")],
	["/", "/", "filter agents", () => (openTab("agents"), focusOn("agents-filter"))],
	["l", "l", "to the ledger", () => (openTab("ledger"), focusOn("ledger-scroll"))],
	["d", "d", "disturb: jam, light, lamps", () => openTab("disturb", true)],
	["j", "j", "draw a jammed disc", () => setMode("jam")],
	["Escape", "Esc", "leave a mode, or deselect the robot", () => (store.mode ? setMode(null) : select(null))],
	["?", "?", "this list", () => dialog.showModal()],
];
const IN_PLACE = [
	["← →", "on the arena: the robot before or after"],
	["shift + arrows", "on the arena: move the view"],
	["Enter", "on the arena or in the table: to the robot's details"],
];

const takesKeys = (node) => node.closest("input:not([type=checkbox]):not([type=range]), select, textarea, [contenteditable]");
const pressable = (node) => node.closest("button, a, summary, input, [role=tab]");

function key(event) {
	if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || dialog.open) return;
	if (event.key === "Escape") {
		if (takesKeys(event.target)) return void event.target.blur();
	} else if (!$("keys-on").checked || takesKeys(event.target) || (event.key === " " && pressable(event.target))) return;
	const shortcut = SHORTCUTS.find(([k]) => k === event.key);
	if (!shortcut) return;
	event.preventDefault();
	shortcut[3]();
}

export function startKeys() {
	const row = (keys, what) => el("tr", {}, el("td", {}, el("kbd", {}, keys)), el("td", {}, what));
	$("help-keys").tBodies[0].append(...SHORTCUTS.filter(([, name]) => name).map(([, name, what]) => row(name, what)), ...IN_PLACE.map(([keys, what]) => row(keys, what)));
	document.addEventListener("keydown", key);
	$("help").addEventListener("click", () => dialog.showModal());
}
