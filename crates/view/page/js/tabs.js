// The tabs above the tables, by the usual pattern: arrow keys move between them.

import { $ } from "./dom.js";
import { toNewest } from "./ledger.js";

const NAMES = ["agents", "ledger", "faults", "disturb"];

export function openTab(name, focus = false) {
	for (const other of NAMES) {
		const chosen = other === name;
		const tab = $(`tab-${other}`);
		tab.setAttribute("aria-selected", String(chosen));
		tab.tabIndex = chosen ? 0 : -1;
		$(`pane-${other}`).hidden = !chosen;
		if (chosen && focus) tab.focus();
	}
	if (name === "ledger") toNewest();
}

export function startTabs() {
	NAMES.forEach((name, k) => {
		$(`tab-${name}`).addEventListener("click", () => openTab(name));
		$(`tab-${name}`).addEventListener("keydown", (event) => {
			const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
			const to = event.key === "Home" ? 0 : event.key === "End" ? NAMES.length - 1 : by ? (k + by + NAMES.length) % NAMES.length : null;
			if (to === null) return;
			event.preventDefault();
			openTab(NAMES[to], true);
		});
	});
}
