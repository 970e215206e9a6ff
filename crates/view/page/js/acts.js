// What the reader does to the run: an act is sent, and its answer is said in the foot of the page, which is read aloud.

import { $ } from "./dom.js";
import { emit, on, store } from "./state.js";
import { send } from "./stream.js";

const PATIENCE_MS = 5000;
const waiting = new Map();
let next = 1;

/** Does an act; `label` is what the answer is said about. Returns the answer once there is one. */
export function act(label, body) {
	const id = next++;
	if (!send({ type: "act", id, act: body })) {
		say(`${label}: not sent, there is no connection`, "bad");
		return Promise.resolve({ ok: false });
	}
	return new Promise((resolve) => {
		const timer = setTimeout(() => say(`${label}: sent, no answer yet`, "wait"), PATIENCE_MS);
		waiting.set(id, { label, resolve, timer });
	});
}

/** Says what an act has come to. */
export function say(text, kind = "good") {
	const answer = $("answer");
	answer.className = kind;
	answer.textContent = text;
}

export const begin = (label, fault) => act(label, { do: "begin", fault });
export const end = (fault) => act(`End fault ${fault.index} (${fault.kind})`, { do: "end", fault: fault.index });

function answered(message) {
	const entry = waiting.get(message.id);
	if (!entry) return;
	waiting.delete(message.id);
	clearTimeout(entry.timer);
	if (message.ok) {
		const parts = [];
		if (message.tick !== null && message.tick !== undefined) parts.push(`tick ${message.tick}`);
		if (message.fault !== null && message.fault !== undefined) parts.push(`fault ${message.fault}`);
		say(`${entry.label}: done${parts.length ? `, ${parts.join(", ")}` : ""}`);
	} else say(`${entry.label}: refused. ${message.error ?? "The server gave no reason."}`, "bad");
	entry.resolve(message);
}

/** Asks for the scenario with what was done, and lets the browser save it. */
export async function saveScenario() {
	const answer = await act("Save as scenario", { do: "save" });
	if (!answer.ok || typeof answer.text !== "string") return;
	const url = URL.createObjectURL(new Blob([answer.text], { type: "application/toml" }));
	const link = document.createElement("a");
	link.href = url;
	link.download = `${(store.hello?.run ?? "run").replace(/[^A-Za-z0-9._-]+/g, "-")}.toml`;
	link.click();
	setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export function startActs() {
	on("message:done", answered);
	on("connected", (connected) => {
		if (connected) return;
		for (const [id, entry] of waiting) {
			clearTimeout(entry.timer);
			waiting.delete(id);
			say(`${entry.label}: not answered, the connection was lost`, "bad");
			entry.resolve({ ok: false });
		}
	});
}

/** What a drag on the arena does: null, "jam", "lamps" or "link". */
export function setMode(mode) {
	store.mode = store.mode === mode ? null : mode;
	emit("mode", store.mode);
}
