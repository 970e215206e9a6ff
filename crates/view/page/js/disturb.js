// Acts on the arena as a whole: a jammed disc, the lamps, the offset Φ. Each can be done by numbers, and two by a drag.

import { $, el, set } from "./dom.js";
import { fixed } from "./format.js";
import { mayAct, on, store } from "./state.js";
import { begin, setMode } from "./acts.js";
import { jam, moveLamp } from "./pointer.js";

const number = (id, label, unit, value) => {
	const input = el("input", { type: "number", id, step: "any", "data-testid": id, value: value ?? "" });
	return [el("label", { className: "inline", for: id }, label, " ", input, unit ? ` ${unit}` : ""), input];
};

let controls = [];
let jamButton = null;
let lampButton = null;

function form(title, hint, run, ...parts) {
	const node = el("form", { className: "disturb", "aria-label": title }, el("h3", {}, title), el("p", { className: "hint" }, hint), el("div", { className: "acts" }, ...parts));
	node.addEventListener("submit", (event) => {
		event.preventDefault();
		run();
	});
	return node;
}

const finite = (...inputs) => {
	for (const input of inputs) {
		if (input.value !== "" && Number.isFinite(Number(input.value))) continue;
		input.focus();
		return false;
	}
	return true;
};

function build() {
	const { hello, field } = store;
	if (!hello || !field) return;
	const [xLabel, x] = number("jam-x", "x", "m", fixed(hello.width_m / 2, 2));
	const [yLabel, y] = number("jam-y", "y", "m", fixed(hello.height_m / 2, 2));
	const [rLabel, r] = number("jam-r", "radius", "m", fixed(Math.min(hello.width_m, hello.height_m) / 8, 2));
	jamButton = el("button", { type: "button", "data-testid": "mode-jam", "aria-pressed": "false", onclick: () => setMode("jam") }, "Draw on the arena");
	const [phiLabel, phi] = number("phi", "Φ", "counts", String(field.offset));
	const lamps = (field.lamps ?? []).map((lamp, k) => {
		const [lx, ix] = number(`lamp-${k}-x`, "x", "m", fixed(lamp.position_m[0], 3).replace("−", "-"));
		const [ly, iy] = number(`lamp-${k}-y`, "y", "m", fixed(lamp.position_m[1], 3).replace("−", "-"));
		return form(`Lamp ${k}`, "", () => finite(ix, iy) && moveLamp(k, [Number(ix.value), Number(iy.value)]), lx, ly, el("button", { "data-testid": `lamp-${k}-move` }, "Move"));
	});
	lampButton = el("button", { type: "button", "data-testid": "mode-lamps", "aria-pressed": "false", onclick: () => setMode("lamps") }, "Drag lamps on the arena");
	const parts = [
		form("Jam a disc", "No packet is heard in it, until the fault is ended.", () => finite(x, y, r) && jam([Number(x.value), Number(y.value)], Number(r.value)), xLabel, yLabel, rLabel, el("button", { "data-testid": "jam-begin" }, "Jam"), jamButton),
		form("Offset of the light", "A larger Φ spreads the robots, a smaller one packs them.", () => finite(phi) && begin(`Set Φ to ${phi.value}`, { kind: "field", offset: Number(phi.value) }), phiLabel, el("button", { "data-testid": "phi-set" }, "Set Φ")),
	];
	if (lamps.length) parts.push(el("div", { className: "disturb" }, el("h3", {}, "Lamps"), el("div", { className: "acts" }, lampButton)), ...lamps);
	$("disturb").replaceChildren(el("p", { className: "hint", id: "may-not", hidden: true }, "This run cannot be acted on from here."), ...parts);
	controls = [...$("disturb").querySelectorAll("input, button")];
	allow();
}

function allow() {
	const may = mayAct();
	for (const control of controls) set(control, "disabled", !may);
	if ($("may-not")) $("may-not").hidden = may;
}

export function startDisturb() {
	for (const name of ["hello", "field"])
		on(name, () => {
			// Numbers that somebody is typing stay.
			if (!$("disturb").contains(document.activeElement) || !controls.length || name === "hello") build();
		});
	on("state", allow);
	on("connected", allow);
	on("mode", (mode) => {
		jamButton?.setAttribute("aria-pressed", String(mode === "jam"));
		lampButton?.setAttribute("aria-pressed", String(mode === "lamps"));
	});
}
