// Light or dark: what the system prefers, or what the reader chose. Also the colors that the canvas draws with.

import { emit } from "./state.js";
import { $ } from "./dom.js";

const KEY = "lamplight.theme";
const dark = matchMedia("(prefers-color-scheme: dark)");
const CHOICES = ["system", "light", "dark"];
let choice = "system";

// After Okabe and Ito: told apart by people who see fewer colors. Kinds differ in dash or shape as well.
const LIGHT = {
	dark: false,
	page: "#ffffff",
	wall: "#2b2f36",
	text: "#1c1f24",
	soft: "#5b626d",
	grid: "rgba(30,35,45,.10)",
	contour: "rgba(120,70,0,.22)",
	robot: "#0a5a96",
	robotEdge: "#ffffff",
	paused: "#a34700",
	down: "#3d434d",
	trail: "10,90,150",
	cell: "rgba(25,55,90,.50)",
	positive: "rgba(0,114,178,.15)",
	centroid: "#00664c",
	toCentroid: "rgba(0,102,76,.55)",
	global: "#7a3b8f",
	differ: ["rgba(150,40,140,.14)", "rgba(150,40,140,.30)", "rgba(150,40,140,.50)"],
	edge: ["rgba(0,110,80,.55)", "#c04a00", "#6a3fa0", "#101318", "#8a6400", "#5b626d"],
	select: "#c2006b",
	selectFill: "rgba(194,0,107,.12)",
	lamp: "#a86a00",
	lampFill: "#ffd36b",
	jam: "#b3261e",
	jamFill: "rgba(179,38,30,.10)",
	series: ["#0a5a96", "#a34700", "#00664c"],
	axis: "#5b626d",
	heat: { light: [0.985, 0.8], chroma: [0.006, 0.135], hue: [95, 72] },
};
const DARK = {
	dark: true,
	page: "#14161a",
	wall: "#c9ced6",
	text: "#e6e8ec",
	soft: "#a0a7b3",
	grid: "rgba(220,225,235,.09)",
	contour: "rgba(255,200,140,.16)",
	robot: "#7cc4f5",
	robotEdge: "#0e1013",
	paused: "#ffb454",
	down: "#b4bac4",
	trail: "124,196,245",
	cell: "rgba(190,210,235,.42)",
	positive: "rgba(110,190,245,.15)",
	centroid: "#5fe0b0",
	toCentroid: "rgba(95,224,176,.55)",
	global: "#d9a0ee",
	differ: ["rgba(225,120,235,.16)", "rgba(225,120,235,.32)", "rgba(225,120,235,.52)"],
	edge: ["rgba(80,210,165,.50)", "#ff9a5c", "#c3a4ff", "#f4f5f7", "#f2d05e", "#a0a7b3"],
	select: "#ff7ec2",
	selectFill: "rgba(255,126,194,.16)",
	lamp: "#ffcf66",
	lampFill: "#6b4e0c",
	jam: "#ff8a80",
	jamFill: "rgba(255,138,128,.13)",
	series: ["#7cc4f5", "#ffb454", "#5fe0b0"],
	axis: "#a0a7b3",
	heat: { light: [0.19, 0.52], chroma: [0.012, 0.115], hue: [285, 420] },
};

// By fate, as on the wire. Dashes in CSS pixels.
export const FATES = [
	{ name: "heard", dash: [] },
	{ name: "collided", dash: [5, 3] },
	{ name: "lost at random", dash: [1.5, 2.5] },
	{ name: "lost to a fault", dash: [9, 3, 2, 3] },
	{ name: "receiver was sending", dash: [3, 5] },
	{ name: "occluded", dash: [8, 6] },
];

export const isDark = () => (choice === "system" ? dark.matches : choice === "dark");
export const colors = () => (isDark() ? DARK : LIGHT);

function apply() {
	if (choice === "system") delete document.documentElement.dataset.theme;
	else document.documentElement.dataset.theme = choice;
	$("theme").setAttribute("aria-label", `Theme: ${choice}`);
	$("theme").title = `Theme: ${choice}. Press to change.`;
	$("theme").textContent = { system: "◐", light: "○", dark: "●" }[choice];
	emit("theme");
}

export function startTheme() {
	try {
		const stored = localStorage.getItem(KEY);
		if (CHOICES.includes(stored)) choice = stored;
	} catch {
		// A browser that stores nothing keeps the system's choice.
	}
	dark.addEventListener("change", apply);
	$("theme").addEventListener("click", nextTheme);
	apply();
}

export function nextTheme() {
	choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length];
	try {
		localStorage.setItem(KEY, choice);
	} catch {
		// Then it holds until the page is left.
	}
	apply();
}
