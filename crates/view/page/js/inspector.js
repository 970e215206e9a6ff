// Everything about the selected robot, and what can be done to it.

import { $, el, set, setText } from "./dom.js";
import { degrees, fixed, hex, micros, percent, short, UNKNOWN, whole } from "./format.js";
import { isActive, mayAct, on, select, STATUS, store } from "./state.js";
import { send } from "./stream.js";
import { begin, end, setMode } from "./acts.js";
import { histogram } from "./histogram.js";

const NEIGHBOR_COLUMNS = ["robot", "range m", "bearing", "turned", "age", "payload"];
const values = {};
let buttons = {};
let neighbors = null;
let notes = null;
let striking = null;
let bins = null;
const rows = [];

const strikes = (fault, robot) => isActive(fault) && Array.isArray(fault.robots) && fault.robots.includes(robot);
const faultOf = (kinds, robot) => store.faults.findLast((fault) => kinds.includes(fault.kind) && strikes(fault, robot));

function field(name, label, title) {
	values[name] = el("dd", { "data-testid": `robot-${name}` }, UNKNOWN);
	return el("div", { title: title ?? null }, el("dt", {}, label), values[name]);
}

function button(name, text, title, run, kind = "") {
	buttons[name] = el("button", { type: "button", "data-testid": `act-${name}`, className: kind, title, onclick: run }, text);
	return buttons[name];
}

function heading(text, ...more) {
	return el("h3", {}, text, ...more);
}

function build() {
	const me = () => store.selected;
	const partner = el("input", { type: "number", min: "0", step: "1", id: "link-partner", "data-testid": "link-partner", "aria-label": "The other robot" });
	const both = el("input", { type: "checkbox", id: "link-both", checked: true });
	const dropLink = () => {
		const other = partner.value === "" ? null : Number(partner.value);
		if (other === null || other === me() || !(other >= 0 && other < store.hello.robots)) {
			partner.focus();
			partner.setCustomValidity(`Another robot, 0 to ${store.hello.robots - 1}`);
			partner.reportValidity();
			return;
		}
		partner.setCustomValidity("");
		const links = [`${me()}${both.checked ? "<->" : "->"}${other}`];
		begin(`Drop packets ${both.checked ? "between" : "from"} robot ${me()} ${both.checked ? "and" : "to"} ${other}`, { kind: "loss", probability: 1, links });
	};
	partner.addEventListener("input", () => partner.setCustomValidity(""));
	on("link-partner", (robot) => {
		partner.value = String(robot);
		setMode(null);
		dropLink();
	});
	const endOf = (kinds) => () => {
		const fault = faultOf(kinds, me());
		if (fault) end(fault);
	};
	const neighborBody = el("tbody");
	neighbors = { count: el("span", { className: "count" }), body: neighborBody, none: el("p", { className: "hint" }, "It knows no neighbor.") };
	notes = { head: heading("Notes of its controller"), list: el("dl", { className: "pairs notes", "data-testid": "robot-notes" }) };
	bins = { head: heading("Its cycles"), line: el("p", { className: "note" }), plot: document.createElementNS("http://www.w3.org/2000/svg", "svg") };
	bins.plot.setAttribute("class", "histogram");
	bins.plot.setAttribute("role", "img");
	$("inspector-full").replaceChildren(
		el(
			"div",
			{ className: "acts", role: "group", "aria-label": "Act on this robot" },
			button("kill", "Kill", "SIGKILL: its process dies; Restart begins a new life without memory", () => begin(`Kill robot ${me()}`, { kind: "kill", robots: [me()] }), "danger"),
			button("restart", "Restart", "begins a new life: ends the fault that killed it", endOf(["kill"])),
			button("stop", "Stop", "SIGSTOP: its process pauses", () => begin(`Stop robot ${me()}`, { kind: "pause", robots: [me()] })),
			button("continue", "Continue", "SIGCONT: ends the fault that stopped it", endOf(["pause"])),
			button("drop", "Drop packets", "all that it sends and all that is sent to it", () => begin(`Drop packets of robot ${me()}`, { kind: "loss", probability: 1, robots: [me()] })),
			button("pass", "Pass packets", "ends the loss that strikes it", endOf(["loss"])),
		),
		el(
			"div",
			{ className: "acts link-acts", role: "group", "aria-label": "Drop packets between two robots" },
			el("label", { className: "inline", for: "link-partner" }, "packets between it and robot"),
			partner,
			button("pick", "Pick", "choose the other robot on the arena", () => setMode("link")),
			el("label", { className: "inline" }, both, "both ways"),
			button("link", "Drop", "all packets between this robot and the other one", dropLink),
		),
		(striking = el("ul", { className: "striking", "data-testid": "robot-faults", "aria-label": "Faults that strike this robot" })),
		el(
			"dl",
			{ className: "pairs" },
			field("state", "state"),
			field("life", "life", "0 is the first life"),
			field("controller", "controller"),
			field("pid", "pid", "process number"),
			field("place", "place", "x, y in the arena"),
			field("heading", "heading", "in the arena, counterclockwise from x"),
			field("light", "light", "what its light sensor reads"),
			field("bump", "bump skirt"),
			field("velocity", "velocity", "commanded last, in its body frame: forward, left"),
			field("error", "estimated error", "ê, as it says in its command"),
			field("cell", "cell", "area of its local cell"),
			field("positive", "V+", "area of the part of its cell where it estimates light"),
			field("centroid", "centroid", "in the arena"),
			field("cpu", "CPU", "share of a core"),
		),
		el("div", { className: "payload" }, el("span", { className: "dt" }, "payload"), (values.payload = el("code", { "data-testid": "robot-payload" }, UNKNOWN))),
		heading("Neighbors it knows ", neighbors.count),
		el("table", { className: "neighbors", "data-testid": "robot-neighbors" }, el("thead", {}, el("tr", {}, ...NEIGHBOR_COLUMNS.map((name, k) => el("th", { scope: "col", className: k < 5 ? "num" : "", title: ["", "", "where it is, from this robot's nose", "its heading, from this robot's", "neighbor cycles since it was heard", ""][k] || null }, name)))), neighborBody),
		neighbors.none,
		notes.head,
		notes.list,
		bins.head,
		bins.line,
		bins.plot,
	);
}

function buttonsOf() {
	tellFaults();
	if (store.selected === null) return;
	const may = mayAct();
	const i = store.selected;
	const status = store.frame ? STATUS[store.frame.status[i]] : store.robot?.state;
	const gone = status === "down" || status === "left-out" || status === "not-joined";
	const off = {
		kill: !may || gone,
		restart: !may || !faultOf(["kill"], i),
		stop: !may || gone || status === "paused",
		continue: !may || !faultOf(["pause"], i),
		drop: !may,
		pass: !may || !faultOf(["loss"], i),
		pick: !may,
		link: !may,
	};
	for (const [name, disabled] of Object.entries(off)) set(buttons[name], "disabled", disabled);
}

/** The faults that strike the robot now, each with a button that ends it. */
function tellFaults() {
	const list = store.selected === null ? [] : store.faults.filter((fault) => strikes(fault, store.selected));
	const key = `${list.map((fault) => fault.index).join(" ")} ${mayAct()}`;
	if (striking.dataset.key === key) return;
	striking.dataset.key = key;
	striking.replaceChildren(
		...list.map((fault) =>
			el("li", {}, el("span", {}, `fault ${fault.index}: ${fault.kind}, ${fault.whom}`), el("button", { type: "button", disabled: !mayAct(), "aria-label": `End fault ${fault.index}, ${fault.kind}`, onclick: () => end(fault) }, "End it")),
		),
	);
}

function tell(robot) {
	if (store.selected === null || !robot || robot.robot !== store.selected) return;
	const put = (name, text) => setText(values[name], text);
	const command = robot.command;
	const cell = robot.cell;
	const pose = robot.pose;
	put("state", (robot.state ?? UNKNOWN).replace("-", " "));
	set(values.state, "className", `state-${robot.state}`);
	put("life", robot.life === null || robot.life === undefined ? UNKNOWN : String(robot.life));
	put("controller", robot.controller ?? UNKNOWN);
	put("pid", robot.pid === null || robot.pid === undefined ? UNKNOWN : String(robot.pid));
	put("place", pose ? `${fixed(pose.x_m, 3)}, ${fixed(pose.y_m, 3)} m` : UNKNOWN);
	put("heading", degrees(pose?.heading_rad));
	put("light", short(robot.light));
	put("bump", robot.bump ? "pressed" : "free");
	put("velocity", command ? `${fixed(command.velocity_m_per_s[0], 3)}, ${fixed(command.velocity_m_per_s[1], 3)} m/s` : UNKNOWN);
	put("error", typeof command?.estimated_error_m === "number" ? `${fixed(command.estimated_error_m, 4)} m` : UNKNOWN);
	put("cell", cell ? `${short(cell.area_m2)} m²` : UNKNOWN);
	put("positive", cell ? `${short(cell.positive_area_m2)} m²` : UNKNOWN);
	put("centroid", cell?.centroid_m ? `${fixed(cell.centroid_m[0], 3)}, ${fixed(cell.centroid_m[1], 3)} m` : UNKNOWN);
	put("cpu", percent(robot.cpu, 2));
	put("payload", hex(command?.payload_hex));
	tellNeighbors(robot.neighbors ?? []);
	tellNotes(robot.notes ?? []);
	tellCycles(robot.cycles);
	buttonsOf();
}

function tellNeighbors(list) {
	const sorted = [...list].sort((a, b) => a.range_m - b.range_m);
	setText(neighbors.count, String(sorted.length));
	set(neighbors.none, "hidden", sorted.length > 0);
	set(neighbors.body.parentNode, "hidden", sorted.length === 0);
	while (rows.length < sorted.length) {
		const cells = NEIGHBOR_COLUMNS.map((_, k) => el("td", { className: k < 5 ? "num" : "hex" }));
		const link = el("button", { type: "button", className: "plain", onclick: () => select(Number(link.textContent)) });
		cells[0].append(link);
		rows.push({ node: el("tr", {}, ...cells), cells, link });
	}
	rows.forEach((row, k) => {
		const neighbor = sorted[k];
		if (!neighbor) {
			row.node.remove();
			return;
		}
		if (row.node.parentNode !== neighbors.body) neighbors.body.append(row.node);
		setText(row.link, String(neighbor.robot));
		setText(row.cells[1], fixed(neighbor.range_m, 3));
		setText(row.cells[2], degrees(neighbor.bearing_rad));
		setText(row.cells[3], degrees(neighbor.orientation_rad));
		setText(row.cells[4], whole(neighbor.age_cycles));
		setText(row.cells[5], hex(neighbor.payload_hex));
		set(row.node, "className", neighbor.age_cycles > 1 ? "old" : "");
	});
}

function tellNotes(list) {
	set(notes.head, "hidden", !list.length);
	set(notes.list, "hidden", !list.length);
	const key = list.map((note) => note.name).join("\n");
	if (notes.list.dataset.key !== key) {
		notes.list.dataset.key = key;
		notes.list.replaceChildren(...list.map((note) => el("div", {}, el("dt", {}, note.name), el("dd", {}, UNKNOWN))));
	}
	list.forEach((note, k) => setText(notes.list.children[k].lastChild, short(note.value)));
}

function tellCycles(cycles) {
	for (const part of [bins.head, bins.line]) set(part, "hidden", !cycles);
	bins.plot.toggleAttribute("hidden", !cycles);
	if (!cycles) return;
	setText(bins.line, `last ${micros(cycles.last_us)}, 99th percentile ${micros(cycles.p99_us)}; a few each second are counted`);
	histogram(bins.plot, cycles.histogram ?? []);
}

function choose(robot) {
	const none = robot === null;
	send({ type: "select", robot });
	$("inspector-empty").hidden = !none;
	$("inspector-full").hidden = none;
	$("deselect").hidden = none;
	setText($("inspector-title"), none ? "Robot" : `Robot ${robot}`);
	const number = $("robot-number");
	if (document.activeElement !== number) number.value = none ? "" : String(robot);
	$("inspector-body").scrollTop = 0;
	for (const value of Object.values(values)) setText(value, UNKNOWN);
	tellNeighbors([]);
	tellNotes([]);
	tellCycles(null);
	set(neighbors.none, "hidden", true);
	buttonsOf();
}

export function startInspector() {
	build();
	$("robot-number").addEventListener("change", (event) => select(event.target.value === "" ? null : Number(event.target.value)));
	$("deselect").addEventListener("click", () => select(null));
	on("selected", choose);
	on("robot", tell);
	on("hello", () => choose(store.selected));
	for (const name of ["faults", "state", "connected"]) on(name, buttonsOf);
}
