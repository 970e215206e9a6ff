// Puts the page together: messages go into what is known of the run (state.js), and every part shows its share of that.

import { emit, isActive, on, put, store } from "./state.js";
import { setText, $ } from "./dom.js";
import { fixed } from "./format.js";
import { connect } from "./stream.js";
import { cellsEvery, drawing, measureFps, places, startScene } from "./scene.js";
import { startActs } from "./acts.js";
import { startAgents } from "./agents.js";
import { startDisturb } from "./disturb.js";
import { startInspector } from "./inspector.js";
import { startKeys } from "./keys.js";
import { show, startLegend } from "./legend.js";
import { startLedger } from "./ledger.js";
import { startNotices } from "./notices.js";
import { startPackets } from "./packets.js";
import { plotPoints, startPlots } from "./plots.js";
import { startPointer } from "./pointer.js";
import { startTabs } from "./tabs.js";
import { startTimeline } from "./timeline.js";
import { startTheme } from "./theme.js";
import { startTopbar } from "./topbar.js";

on("message:hello", (hello) => {
	Object.assign(store, { hello, state: null, events: [], faults: hello.faults ?? [], agents: [], robot: null, ended: false });
	if (store.selected !== null && store.selected >= hello.robots) store.selected = null;
	emit("hello", hello);
	put("field", hello.field);
	emit("faults", store.faults);
	emit("agents", store.agents);
	emit("events");
	show();
});
on("message:field", ({ field }) => put("field", field));
on("message:state", (state) => {
	if (state.phase === "over" && store.hello?.source === "live") store.ended = true;
	put("state", state);
});
on("message:agents", ({ agents }) => put("agents", agents));
on("message:faults", ({ faults }) => put("faults", faults));
on("message:events", () => setTimeout(() => emit("events")));
on("message:robot", (robot) => {
	if (robot.robot === store.selected) put("robot", robot);
});

startScene();
startLegend();
startTopbar();
startTimeline();
startPlots();
startPackets();
startAgents();
startInspector();
startLedger();
startDisturb();
startNotices();
startPointer();
startTabs();
startKeys();
startActs();
startTheme();

setInterval(() => {
	const fps = measureFps();
	if (store.connected) setText($("link"), `connected, ${fixed(fps, 0)} frames/s drawn${cellsEvery() > 1 ? `, cells with every ${cellsEvery() === 2 ? "2nd" : "4th"}` : ""}`);
}, 1000);

// For tests, and for who is curious.
window.lamplight = {
	get frames() {
		return drawing.frames;
	},
	get robots() {
		return store.frame?.n ?? 0;
	},
	get fps() {
		return measureFps();
	},
	get state() {
		return store.state;
	},
	get selected() {
		return store.selected;
	},
	get plotPoints() {
		return plotPoints();
	},
	get activeFaults() {
		return store.faults.filter(isActive).map((fault) => fault.index);
	},
	/** Where a robot is drawn, in meters. */
	place(robot) {
		const { x, y } = places();
		return robot < x.length ? [x[robot], y[robot]] : null;
	},
};

connect();
