// What became of packets: a bar for each fate, as a share of all that were due.

import { $, el, set, setText } from "./dom.js";
import { percent, whole } from "./format.js";
import { on, store } from "./state.js";

const FATES = [
	["heard", "heard", "reached a receiver in range"],
	["collided", "collided", "met another packet in the air"],
	["half_duplex", "half duplex", "the receiver was sending"],
	["lost_range", "out of range", "the receiver was too far away"],
	["lost_edge", "edge of range", "lost in the soft edge of the range"],
	["occluded", "occluded", "a body was in the way"],
	["lost_loss", "random loss", "lost by the channel's chance"],
	["lost_fault", "fault", "lost to a fault of the plan or of yours"],
	["over_bound", "over bound", "more deliveries than a percept holds"],
	["delayed", "delayed", "late by a fault; heard later, so counted again there"],
];
const rows = {};

function tell() {
	const packets = store.state?.packets;
	if (!packets) return;
	setText($("sent"), `${whole(packets.sent)} sent`);
	const all = FATES.reduce((sum, [key]) => sum + (key === "delayed" ? 0 : (packets[key] ?? 0)), 0);
	for (const [key] of FATES) {
		const row = rows[key];
		const count = packets[key] ?? null;
		const share = count !== null && all > 0 ? count / all : null;
		setText(row.count, whole(count));
		setText(row.share, percent(share));
		const width = `${((share ?? 0) * 100).toFixed(2)}%`;
		if (row.bar.style.width !== width) row.bar.style.width = width;
		set(row.node, "className", count > 0 ? "" : "none");
	}
}

export function startPackets() {
	$("packets").replaceChildren(
		el(
			"table",
			{},
			el("thead", { className: "sr" }, el("tr", {}, ...["fate", "share", "bar", "packets"].map((text) => el("th", { scope: "col" }, text)))),
			el(
				"tbody",
				{},
				...FATES.map(([key, name, title]) => {
					const bar = el("span", { className: `fill ${key === "heard" ? "ok" : key === "lost_fault" ? "by-fault" : ""}` });
					const share = el("td", { className: "num" }, "–");
					const count = el("td", { className: "num", "data-testid": `packets-${key}` }, "–");
					const node = el("tr", {}, el("th", { scope: "row", title }, name), el("td", { className: "bar", "aria-hidden": "true" }, el("span", { className: "track" }, bar)), share, count);
					rows[key] = { node, bar, share, count };
					return node;
				}),
			),
		),
	);
	on("state", tell);
}
