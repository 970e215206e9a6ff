// Notices over the arena: no connection, a frame that cannot be read, who is waited for, gathering, what a drag does.

import { $, set, setText } from "./dom.js";
import { fixed, many } from "./format.js";
import { on, store } from "./state.js";
import { connect } from "./stream.js";
import { setMode } from "./acts.js";

const WORTH_SAYING_S = 0.5;
const MOST_NAMED = 6;
const LINGER_MS = 1500;

const MODES = {
	jam: "Drag a disc on the arena: no packet is heard in it.",
	lamps: "Drag a lamp to its new place.",
	link: "Click the other robot: packets between the two are dropped.",
};

/** Says something to a screen reader, once. */
const announce = (text) => setText($("said"), text);

function notice(name, text) {
	const node = $(`notice-${name}`);
	set(node, "hidden", !text);
	if (text) setText(node.firstElementChild, text);
}

function link({ state, reason, againS }) {
	const foot = { open: "connected", closed: "not connected", refused: "refused", ended: "ended", garbled: "connected" }[state];
	setText($("link"), foot);
	$("reconnect").hidden = state === "open" || state === "closed";
	if (state !== "open" && state !== "garbled") {
		// Nobody knows any more who is waited for.
		notice("waiting", null);
		announce(`No connection to the run: ${reason}.`);
	}
	if (state === "open") notice("stream", null);
	else if (state === "closed") notice("stream", `No connection to the run: ${reason}. Connecting again in ${fixed(againS, 1)} s. What you see is the last picture.`);
	else if (state === "refused") notice("stream", `The server refuses this page: ${reason}. Open the address that lamplight view printed.`);
	else if (state === "ended") notice("stream", `The server has ended: ${reason}. What you see is the last picture.`);
	else if (state === "garbled") notice("frame", "The server sent a message that cannot be read; it was left out.");
}

let told = "";
let lastWaiting = -Infinity;

function state(now) {
	const gathering = now.phase === "gathering";
	const waiting = now.waiting;
	notice("gathering", gathering ? `Gathering: ${now.joined} of ${many(now.robots, "robot")} ${now.joined === 1 ? "has" : "have"} joined.` : null);
	const joined = $("joined");
	set(joined, "max", Math.max(1, now.robots));
	set(joined, "value", now.joined);
	let text = null;
	if (waiting && waiting.count > 0 && (gathering || waiting.longest_s >= WORTH_SAYING_S)) {
		const names = waiting.robots.slice(0, MOST_NAMED).map((r) => `${r.robot}${r.life ? ` (life ${r.life})` : ""} for ${fixed(r.for_s, 1)}\u00a0s${r.state ? `, ${r.state}` : ""}`);
		const more = waiting.count - names.length;
		text = `Waiting for ${waiting.what === "join" ? `${many(waiting.count, "robot")} to join` : `${many(waiting.count, "answer")}`}, the longest for ${fixed(waiting.longest_s, 1)} s: robot ${names.join("; ")}${more > 0 ? `; and ${more} more` : ""}.`;
	}
	if (text) lastWaiting = performance.now();
	// What is over in a moment stays long enough to be read, and does not flicker.
	if (text || performance.now() - lastWaiting > LINGER_MS) notice("waiting", text);
	// Said once when it begins, not with every number.
	const key = text ? `${waiting.what} ${waiting.robots[0]?.robot}` : "";
	if (key !== told) {
		told = key;
		if (text) announce(text);
	}
	if (now.phase === "over") {
		if (!over) {
			over = true;
			announce("The run is over.");
			notice("over", `The run is over. ${now.summary?.text ?? ""}`.trim());
		}
	} else {
		over = false;
		notice("over", null);
	}
}

let over = false;

export function startNotices() {
	$("reconnect").addEventListener("click", () => {
		store.ended = false;
		connect();
	});
	$("dismiss-over").addEventListener("click", () => notice("over", null));
	$("mode-leave").addEventListener("click", () => setMode(null));
	on("link", link);
	on("bad-frame", (text) => notice("frame", text));
	on("frame", () => notice("frame", null));
	on("hello", () => notice("frame", null));
	on("state", state);
	on("mode", (mode) => notice("mode", mode ? MODES[mode] : null));
}
