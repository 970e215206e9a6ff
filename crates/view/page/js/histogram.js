// A small histogram of a robot's cycles, as SVG with a text alternative.

import { svg } from "./dom.js";
import { micros, whole } from "./format.js";

const W = 300;
const H = 64;
const FOOT = 14;

/** Draws the bins into an `svg` element. */
export function histogram(node, bins) {
	const filled = bins.filter((bin) => bin.count > 0);
	node.setAttribute("viewBox", `0 0 ${W} ${H}`);
	if (!filled.length) {
		node.replaceChildren();
		return;
	}
	const first = bins.indexOf(filled[0]);
	const last = bins.indexOf(filled[filled.length - 1]);
	const seen = bins.slice(Math.max(0, first), last + 1);
	const most = Math.max(...seen.map((bin) => bin.count));
	const wide = W / seen.length;
	const parts = seen.map((bin, k) => {
		const h = bin.count > 0 ? Math.max(1.5, ((H - FOOT - 2) * bin.count) / most) : 0;
		const from = first + k > 0 ? bins[first + k - 1].up_to_us : 0;
		const bar = svg("rect", { class: "bin", x: (k * wide + 0.5).toFixed(2), y: (H - FOOT - h).toFixed(2), width: Math.max(1, wide - 1).toFixed(2), height: h.toFixed(2) });
		bar.append(svg("title", {}, `${micros(from)} to ${micros(bin.up_to_us)}: ${whole(bin.count)}`));
		return bar;
	});
	parts.push(
		svg("line", { class: "mark", x1: 0, x2: W, y1: H - FOOT, y2: H - FOOT }),
		svg("text", { class: "label", x: 0, y: H - 2 }, micros(first > 0 ? bins[first - 1].up_to_us : 0)),
		svg("text", { class: "label", x: W, y: H - 2, "text-anchor": "end" }, micros(seen[seen.length - 1].up_to_us)),
	);
	node.replaceChildren(...parts);
	node.setAttribute("aria-label", `Cycles: ${filled.length} bins, most (${whole(most)}) up to ${micros(seen.find((b) => b.count === most).up_to_us)}`);
}
