// Small helpers for the document: find, make and change elements. Text is always text, never markup.

export const $ = (id) => document.getElementById(id);

/** Makes an element; props are properties or attributes, children are nodes or text. */
export function el(tag, props = {}, ...children) {
	const node = document.createElement(tag);
	for (const [name, value] of Object.entries(props)) {
		if (value === null || value === undefined) continue;
		if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
		else if (name in node && typeof value !== "string") node[name] = value;
		else if (name === "className" || name === "textContent") node[name] = value;
		else node.setAttribute(name, value);
	}
	node.append(...children);
	return node;
}

const SVG = "http://www.w3.org/2000/svg";

/** Makes an SVG element. */
export function svg(tag, attributes = {}, text) {
	const node = document.createElementNS(SVG, tag);
	for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
	if (text !== undefined) node.textContent = text;
	return node;
}

/** Changes a node's text only if it differs, so that nothing is laid out again in vain. */
export function setText(node, text) {
	if (node.textContent !== text) node.textContent = text;
}

/** Changes a property only if it differs. */
export function set(node, name, value) {
	if (node[name] !== value) node[name] = value;
}

/** Calls `run` at most once per `ms`, the last call for certain. */
export function atMost(ms, run) {
	let last = 0;
	let timer = 0;
	return () => {
		if (timer) return;
		const wait = Math.max(0, last + ms - performance.now());
		timer = setTimeout(() => {
			timer = 0;
			last = performance.now();
			run();
		}, wait);
	};
}
