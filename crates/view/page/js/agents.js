// The table of agents: sorted, filtered, and drawn only as far as it is seen, so that thousands of rows stay smooth.

import { $, el, set, setText } from "./dom.js";
import { fixed, UNKNOWN, whole } from "./format.js";
import { on, select, STATUS, store } from "./state.js";

const ROW_H = 24;
const BEYOND = 6; // rows drawn above and below what is seen
const text = (v) => (v === null || v === undefined ? UNKNOWN : String(v));
const cycle = (v) => (v < 100 ? fixed(v, 1) : whole(v));
const COLUMNS = [
	{ key: "robot", name: "robot", num: true },
	{ key: "life", name: "life", num: true, title: "lives before this one: 0 is the first" },
	{ key: "controller", name: "controller" },
	{ key: "pid", name: "pid", num: true, title: "process number" },
	{ key: "state", name: "state" },
	{ key: "cycle_last_us", name: "last µs", num: true, title: "last cycle, in microseconds", show: cycle },
	{ key: "cycle_p99_us", name: "p99 µs", num: true, title: "cycle, 99th percentile, in microseconds", show: cycle },
	{ key: "cpu", name: "CPU %", num: true, title: "share of a core, in percent", show: (v) => fixed(v === null ? null : v * 100, v < 0.1 ? 2 : 0) },
	{ key: "refused", name: "refused", num: true, title: "commands refused" },
	{ key: "missed_deadlines", name: "missed", num: true, title: "deadlines missed (real time)" },
];
const RANK = { down: 0, paused: 1, "left-out": 2, "not-joined": 3, present: 4 };

let sortKey = "robot";
let upward = true;
let rows = []; // filtered and sorted
let cursor = 0;
const pool = [];
const headers = {};
const scroll = $("agents-scroll");
const body = $("agents-body");
const above = el("tr", { className: "space", "aria-hidden": "true" }, el("td", { colSpan: COLUMNS.length }));
const below = el("tr", { className: "space", "aria-hidden": "true" }, el("td", { colSpan: COLUMNS.length }));

function matcher() {
	const wanted = $("agents-state").value;
	const words = $("agents-filter").value.trim().toLowerCase().split(/[\s,]+/).filter(Boolean);
	const numbers = words.filter((w) => /^\d+(-\d+)?$/.test(w)).map((w) => w.split("-").map(Number));
	const names = words.filter((w) => !/^\d+(-\d*)?$/.test(w));
	return (agent) =>
		(!wanted || agent.state === wanted) &&
		(!numbers.length || numbers.some(([from, to = from]) => agent.robot >= from && agent.robot <= to)) &&
		names.every((name) => agent.controller?.toLowerCase().includes(name) || agent.state.includes(name));
}

function compare(a, b) {
	let x = a[sortKey];
	let y = b[sortKey];
	if (sortKey === "state") [x, y] = [RANK[x] ?? 9, RANK[y] ?? 9];
	// What is not known comes last, either way.
	const noX = x === null || x === undefined;
	const noY = y === null || y === undefined;
	if (noX || noY) return noX && noY ? a.robot - b.robot : noX ? 1 : -1;
	const order = typeof x === "string" ? x.localeCompare(y) : x - y;
	return order === 0 ? a.robot - b.robot : upward ? order : -order;
}

function arrange() {
	const at = rows[cursor]?.robot;
	rows = store.agents.filter(matcher()).sort(compare);
	const again = at === undefined ? -1 : rows.findIndex((r) => r.robot === at);
	cursor = again >= 0 ? again : Math.max(0, Math.min(cursor, rows.length - 1));
	setText($("agents-count"), rows.length === store.agents.length ? `${whole(rows.length)}` : `${whole(rows.length)} of ${whole(store.agents.length)}`);
	scroll.setAttribute("aria-rowcount", String(rows.length + 1));
	draw();
}

function draw() {
	const head = $("agents-head").offsetHeight || ROW_H;
	const first = Math.max(0, Math.floor((scroll.scrollTop - head) / ROW_H) - BEYOND);
	const last = Math.min(rows.length, Math.ceil((scroll.scrollTop + scroll.clientHeight) / ROW_H) + BEYOND);
	const count = Math.max(0, last - first);
	while (pool.length < count) pool.push(makeRow(pool.length));
	above.firstChild.style.height = `${first * ROW_H}px`;
	below.firstChild.style.height = `${Math.max(0, rows.length - last) * ROW_H}px`;
	for (let k = 0; k < pool.length; k += 1) {
		const { node, cells } = pool[k];
		const agent = k < count ? rows[first + k] : null;
		if (!agent) {
			node.remove();
			continue;
		}
		if (node.parentNode !== body) body.insertBefore(node, below);
		node.dataset.robot = agent.robot;
		set(node, "className", `${agent.robot === store.selected ? "chosen" : ""}${first + k === cursor ? " cursor" : ""}`.trim());
		node.setAttribute("aria-selected", String(agent.robot === store.selected));
		node.setAttribute("aria-rowindex", String(first + k + 2));
		COLUMNS.forEach((column, c) => setText(cells[c], (column.show ?? text)(agent[column.key] ?? null)));
		set(cells[4], "className", `state-${agent.state}`);
		cells[2].title = agent.controller ?? "";
	}
	const under = pool.find((p) => p.node.parentNode === body && p.node.classList.contains("cursor"));
	if (under) scroll.setAttribute("aria-activedescendant", under.node.id);
	else scroll.removeAttribute("aria-activedescendant");
}

function makeRow(k) {
	const cells = COLUMNS.map((column) => el("td", { role: "gridcell", className: column.num ? "num" : "" }));
	const node = el("tr", { role: "row", id: `agent-row-${k}` }, ...cells);
	node.addEventListener("click", () => {
		const robot = Number(node.dataset.robot);
		cursor = rows.findIndex((r) => r.robot === robot);
		select(robot);
		draw();
	});
	return { node, cells };
}

function toCursor() {
	const head = $("agents-head").offsetHeight || ROW_H;
	const top = cursor * ROW_H;
	if (top < scroll.scrollTop) scroll.scrollTop = top;
	else if (top + ROW_H + head > scroll.scrollTop + scroll.clientHeight) scroll.scrollTop = top + ROW_H + head - scroll.clientHeight;
	draw();
}

function key(event) {
	if (event.target !== scroll || event.ctrlKey || event.metaKey || event.altKey) return;
	const page = Math.max(1, Math.floor(scroll.clientHeight / ROW_H) - 2);
	const by = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -rows.length, End: rows.length }[event.key];
	if (by !== undefined) cursor = Math.max(0, Math.min(rows.length - 1, cursor + by));
	else if (event.key === "Enter" && rows[cursor]) select(rows[cursor].robot);
	else return;
	event.preventDefault();
	toCursor();
}

function sortBy(column) {
	if (sortKey === column.key) upward = !upward;
	// Numbers that tell of trouble are wanted with the largest first.
	else [sortKey, upward] = [column.key, !column.num || column.key === "robot" || column.key === "pid"];
	for (const c of COLUMNS) headers[c.key].setAttribute("aria-sort", c.key === sortKey ? (upward ? "ascending" : "descending") : "none");
	arrange();
}

export function startAgents() {
	for (const column of COLUMNS) {
		headers[column.key] = el(
			"th",
			{ role: "columnheader", scope: "col", className: column.num ? "num" : "", "aria-sort": column.key === sortKey ? "ascending" : "none" },
			el("button", { type: "button", "data-testid": `sort-${column.key}`, title: column.title ?? null, onclick: () => sortBy(column) }, column.name),
		);
		$("agents-head").append(headers[column.key]);
	}
	$("agents-state").append(el("option", { value: "" }, "every state"), ...STATUS.map((s) => el("option", { value: s }, s.replace("-", " "))));
	body.append(above, below);
	$("agents-filter").addEventListener("input", arrange);
	$("agents-state").addEventListener("change", arrange);
	scroll.addEventListener("scroll", draw, { passive: true });
	scroll.addEventListener("keydown", key);
	new ResizeObserver(draw).observe(scroll);
	on("agents", arrange);
	on("selected", (robot) => {
		const at = rows.findIndex((r) => r.robot === robot);
		if (at >= 0) {
			cursor = at;
			toCursor();
		} else draw();
	});
}
