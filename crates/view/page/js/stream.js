// The WebSocket to the server: messages in and out, and connecting again with growing pauses while the run may be alive.

import { emit, put, store } from "./state.js";
import { decode, FrameError } from "./frame.js";

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 8000;

let socket = null;
let wait = FIRST_WAIT_MS;
let timer = 0;
let refused = false;
let goodbye = null;

/** Sends a message, if connected; says whether it was. */
export function send(message) {
	if (socket?.readyState !== WebSocket.OPEN) return false;
	socket.send(JSON.stringify(message));
	return true;
}

/** Connects now. */
export function connect() {
	clearTimeout(timer);
	timer = 0;
	if (socket && socket.readyState <= WebSocket.OPEN) return;
	const scheme = location.protocol === "https:" ? "wss:" : "ws:";
	const mine = new WebSocket(`${scheme}//${location.host}/stream`);
	socket = mine;
	mine.binaryType = "arraybuffer";
	mine.onopen = () => {
		goodbye = null;
		refused = false;
		put("connected", true);
		emit("link", { state: "open" });
	};
	mine.onmessage = (event) => (typeof event.data === "string" ? text(event.data) : binary(event.data));
	mine.onclose = (event) => closed(mine, event);
}

function text(data) {
	let message;
	try {
		message = JSON.parse(data);
	} catch {
		emit("link", { state: "garbled" });
		return;
	}
	if (message.type === "hello") wait = FIRST_WAIT_MS;
	if (message.type === "goodbye") {
		goodbye = message.why || "it has ended";
		put("ended", true);
	}
	emit(`message:${message.type}`, message);
}

function binary(data) {
	try {
		emit("message:frame", decode(data));
	} catch (error) {
		if (!(error instanceof FrameError)) throw error;
		emit("bad-frame", error.message);
	}
}

function closed(which, event) {
	if (which !== socket) return;
	put("connected", false);
	if (event.code === 1008) refused = true;
	const reason = goodbye ?? (event.reason || (refused ? "the server refused this page" : codeText(event.code)));
	const again = !refused && !store.ended;
	if (again) {
		const pause = wait * (0.8 + 0.4 * Math.random());
		wait = Math.min(LONGEST_WAIT_MS, wait * 2);
		timer = setTimeout(connect, pause);
		emit("link", { state: "closed", reason, againS: pause / 1000 });
	} else emit("link", { state: refused ? "refused" : "ended", reason });
}

const codeText = (code) =>
	code === 1006 ? "the connection broke, or nobody listens there" : code === 1001 ? "the server is leaving" : code === 1000 ? "the server closed it" : `code ${code}`;

// A page that comes back from the background does not wait for its next attempt.
document.addEventListener("visibilitychange", () => {
	if (document.visibilityState === "visible" && timer) connect();
});
