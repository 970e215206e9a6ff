// The ledger: what happened, in time order, and the faults with their windows.

import { $, el, set, setText } from "./dom.js";
import { fixed, UNKNOWN, whole } from "./format.js";
import { isActive, mayAct, on, store } from "./state.js";
import { end } from "./acts.js";
import { timeDecimals } from "./topbar.js";

const MOST_SHOWN = 2000; // older lines leave the page, not the ledger
const NEAR_PX = 40;
const KINDS = ["fault", "incident", "act", "end"];

function line(event) {
	const kind = KINDS.includes(event.kind) ? event.kind : "act";
	return el(
		"li",
		{},
		el("span", { className: "when", title: `tick ${event.tick}` }, `${fixed(event.time_s, timeDecimals())} s`),
		el("span", { className: `kind ${kind}` }, event.kind),
		el("span", { className: "what" }, event.text),
	);
}

function append(events) {
	const scroll = $("ledger-scroll");
	const list = $("ledger");
	const atEnd = scroll.scrollHeight - scroll.scrollTop - scroll.clientHeight < NEAR_PX;
	list.append(...events.slice(-MOST_SHOWN).map(line));
	while (list.childElementCount > MOST_SHOWN) list.firstChild.remove();
	if (atEnd) scroll.scrollTop = scroll.scrollHeight;
	setText($("ledger-count"), store.events.length ? whole(store.events.length) : "");
	$("ledger-empty").hidden = store.events.length > 0;
}

/** Scrolls to the newest line, as when the ledger is opened. */
export const toNewest = () => {
	const scroll = $("ledger-scroll");
	scroll.scrollTop = scroll.scrollHeight;
};

const rows = new Map();

function faultRow() {
	const cells = Array.from({ length: 7 }, (_, k) => el("td", { className: [0, 3, 4, 5].includes(k) ? "num" : "" }));
	const state = el("span");
	const stop = el("button", { type: "button" }, "End it");
	cells[6].append(state, stop);
	const row = { node: el("tr", {}, ...cells), cells, state, stop, fault: null };
	stop.addEventListener("click", () => end(row.fault));
	return row;
}

function tellFaults() {
	const body = $("faults");
	let active = 0;
	for (const fault of store.faults) {
		if (!rows.has(fault.index)) {
			const row = faultRow();
			rows.set(fault.index, row);
			body.append(row.node);
		}
		const row = rows.get(fault.index);
		row.fault = fault;
		const on = isActive(fault);
		if (on) active += 1;
		const fired = fault.fired_tick !== null && fault.fired_tick !== undefined;
		const texts = [String(fault.index), fault.kind, fault.whom, fixed(fault.from_s, 1), fault.until_s === null ? "the end" : fixed(fault.until_s, 1), fired ? whole(fault.fired_tick) : UNKNOWN];
		texts.forEach((text, k) => setText(row.cells[k], text ?? UNKNOWN));
		setText(row.state, on ? "active" : fired ? "over" : "planned");
		set(row.state, "className", on ? "fault-active" : "");
		set(row.stop, "hidden", !on);
		set(row.stop, "disabled", !mayAct());
		row.stop.setAttribute("aria-label", `End fault ${fault.index}, ${fault.kind}, ${fault.whom}`);
		row.stop.dataset.testid = `end-${fault.index}`;
	}
	$("faults-empty").hidden = store.faults.length > 0;
	$("faults-empty").parentNode.querySelector("table").hidden = store.faults.length === 0;
	setText($("faults-count"), active ? `${active} active` : store.faults.length ? String(store.faults.length) : "");
}

export function startLedger() {
	on("message:events", ({ events, replace }) => {
		if (replace) {
			store.events = [];
			$("ledger").replaceChildren();
		}
		store.events.push(...events);
		append(events);
	});
	on("hello", () => {
		$("ledger").replaceChildren();
		rows.clear();
		$("faults").replaceChildren();
		append([]);
		tellFaults();
	});
	for (const name of ["faults", "state", "connected"]) on(name, tellFaults);
}
