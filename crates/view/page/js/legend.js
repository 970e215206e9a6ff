// Layer toggles and the legend beneath the arena: what is drawn, in which color, shape and unit.

import { $, el, setText } from "./dom.js";
import { many, short } from "./format.js";
import { emit, LAYERS, on, STATUS, store } from "./state.js";
import { send } from "./stream.js";
import { drawing, heatOf } from "./scene.js";
import { colors, FATES } from "./theme.js";
import { lamp, paint, plus, shape } from "./glyphs.js";

const NAMES = { field: "φ", trails: "trails", cells: "cells", centroids: "centroids", global: "global cells", edges: "packets" };
const TITLES = {
	field: "φ, the light, as a heat map (f)",
	trails: "where robots have been (t)",
	cells: "local cells, V+ filled (c)",
	centroids: "centroids that robots move to (m)",
	global: "cells by the places of all robots; highlighted where the local cell differs (g)",
	edges: "the hearing graph of the last neighbor cycle (h)",
};
const boxes = {};

/** Tells the server which sections of a frame are wanted. */
export function show() {
	const { cells, centroids, global, edges } = store.layers;
	send({ type: "show", cells: cells || centroids || store.selected !== null, global, edges });
}

export function toggleLayer(name) {
	store.layers[name] = !store.layers[name];
	boxes[name].checked = store.layers[name];
	show();
	emit("layers", store.layers);
}

function swatch(draw, width = 22) {
	const canvas = el("canvas", { "aria-hidden": "true", className: "swatch" });
	const ratio = Math.min(2, devicePixelRatio || 1);
	canvas.width = width * ratio;
	canvas.height = 16 * ratio;
	canvas.style.width = `${width}px`;
	canvas.style.height = "16px";
	const context = canvas.getContext("2d");
	context.scale(ratio, ratio);
	draw(context, width, 16);
	return canvas;
}

const item = (draw, text, width) => el("span", { className: "item" }, swatch(draw, width), text);

const robotItem = (status, c) =>
	item((g) => {
		const path = new Path2D();
		shape(path, status, 11, 8, 4.5);
		paint(g, path, status, c, 4.5);
	}, STATUS[status].replace("-", " "));

const lineItem = (color, dash, text, width = 1.5) =>
	item(
		(g, w, h) => {
			g.strokeStyle = color;
			g.lineWidth = width;
			g.setLineDash(dash);
			g.beginPath();
			g.moveTo(1, h / 2);
			g.lineTo(w - 1, h / 2);
			g.stroke();
		},
		text,
		30,
	);

const boxItem = (fill, stroke, text, dash = []) =>
	item((g, w, h) => {
		g.fillStyle = fill;
		g.fillRect(3, 3, w - 6, h - 6);
		g.strokeStyle = stroke;
		g.setLineDash(dash);
		g.strokeRect(3.5, 3.5, w - 7, h - 7);
	}, text);

function heatItem() {
	const heat = heatOf();
	if (!heat) return null;
	const bar = swatch((g, w, h) => {
		for (let x = 0; x < w; x += 1) {
			const k = 3 * Math.min(255, Math.round((255 * x) / (w - 1)));
			g.fillStyle = `rgb(${heat.rgb[k]},${heat.rgb[k + 1]},${heat.rgb[k + 2]})`;
			g.fillRect(x, 2, 1, h - 4);
		}
		g.strokeStyle = colors().soft;
		g.strokeRect(0.5, 2.5, w - 1, h - 5);
	}, 84);
	const unit = store.field?.lamps?.length ? "counts" : "";
	return el("span", { className: "item" }, `φ ${short(heat.least)}`, bar, `${short(heat.most)} ${unit}`.trim());
}

function build() {
	const c = colors();
	const { layers } = store;
	const items = [];
	if (layers.field) items.push(heatItem());
	const seen = new Set([0, 1, 2]);
	for (const status of store.frame?.status ?? []) seen.add(status);
	for (const status of [0, 1, 2, 3, 4]) if (seen.has(status)) items.push(robotItem(status, c));
	if (store.field?.lamps?.length) items.push(item((g) => lamp(g, 11, 8, c, 3.5), "lamp"));
	if (layers.trails) items.push(lineItem(`rgba(${c.trail},.62)`, [], "trail", 1.4));
	if (layers.cells) items.push(boxItem("transparent", c.cell, "local cell"), boxItem(c.positive, "transparent", "V+"));
	if (layers.centroids)
		items.push(
			item((g) => {
				const path = new Path2D();
				plus(path, 11, 8, 4);
				g.strokeStyle = c.centroid;
				g.lineWidth = 1.6;
				g.stroke(path);
			}, "centroid"),
		);
	if (layers.global)
		items.push(boxItem("transparent", c.global, "global cell", [3, 2]), ...["2–10 %", "10–30 %", "over 30 %"].map((text, k) => boxItem(c.differ[k], "transparent", k === 0 ? `differs by ${text}` : text)));
	if (layers.edges) {
		const of = store.selected === null ? "" : ` (robot ${store.selected})`;
		FATES.forEach((fate, k) => items.push(lineItem(c.edge[k], fate.dash, k === 0 ? `packet heard${of}` : fate.name)));
		items.push(el("span", { className: "item note" }, "drawn over the half of its way next to the receiver"));
		if (drawing.edgesOneOf > 1) items.push(el("span", { className: "item warn-text" }, `one packet of ${drawing.edgesOneOf} is drawn: zoom in or select a robot`));
	}
	if (store.selected !== null)
		items.push(
			item((g) => {
				g.strokeStyle = c.select;
				g.lineWidth = 1.2;
				g.beginPath();
				g.arc(11, 8, 4.5, 0, 7);
				g.stroke();
			}, "a neighbor, where the selected robot believes it"),
		);
	$("legend").replaceChildren(...items.filter(Boolean));
}

let lastSeen = "";

/** The picture in words, for who cannot see it. */
export function describe() {
	const { frame, hello } = store;
	if (!frame || !hello) return;
	const counts = [0, 0, 0, 0, 0];
	for (const status of frame.status) counts[status] += 1;
	const seen = counts.map((count) => (count > 0 ? 1 : 0)).join("");
	if (seen !== lastSeen) {
		lastSeen = seen;
		build();
	}
	const states = counts.map((count, k) => (count ? `${count} ${STATUS[k].replace("-", " ")}` : "")).filter(Boolean);
	const middle = (values) => values.reduce((sum, v) => sum + v, 0) / Math.max(1, values.length);
	const metrics = store.state?.metrics;
	const text = [
		`At ${short(frame.timeS)} seconds, ${many(frame.n, "robot")} in an arena of ${short(hello.width_m)} by ${short(hello.height_m)} meters: ${states.join(", ")}.`,
		`Their mean place is x ${short(middle(frame.x))}, y ${short(middle(frame.y))} meters.`,
		`${many(store.field?.lamps?.length ?? 0, "lamp")}.`,
		metrics && metrics.mean_error_m !== null ? `Mean estimated error ${short(metrics.mean_error_m)} meters.` : "",
		store.selected === null ? "No robot is selected." : `Robot ${store.selected} is selected.`,
	];
	setText($("summary"), text.filter(Boolean).join(" "));
}

export function startLegend() {
	$("layers").replaceChildren(
		...LAYERS.map((name) => {
			boxes[name] = el("input", { type: "checkbox", id: `layer-${name}`, "data-testid": `layer-${name}`, checked: store.layers[name], onchange: () => toggleLayer(name) });
			return el("label", { title: TITLES[name] }, boxes[name], ` ${NAMES[name]}`);
		}),
	);
	for (const name of ["heat", "layers", "selected", "hello", "edges-one-of"]) on(name, build);
	on("selected", show);
	setInterval(describe, 2000);
}
