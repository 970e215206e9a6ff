// Robots in the order of small squares of the arena, so that those drawn in one path are near each other: a path that
// reaches over the whole picture is slow to fill, however few parts it has.

const ROBOTS_IN_A_SQUARE = 16;

/** The numbers of a frame's robots, square by square; squares of every other row run backward. */
export function bySquares({ n, x, y }, width, height) {
	const side = Math.max(1, Math.min(128, Math.round(Math.sqrt(n / ROBOTS_IN_A_SQUARE))));
	const square = new Uint16Array(n);
	const starts = new Uint32Array(side * side + 1);
	const clamp = (v) => (v >= 0 ? Math.min(side - 1, Math.floor(v)) : 0);
	for (let i = 0; i < n; i += 1) {
		const row = clamp((y[i] / height) * side);
		const column = clamp((x[i] / width) * side);
		square[i] = row * side + (row % 2 ? side - 1 - column : column);
		starts[square[i] + 1] += 1;
	}
	for (let k = 0; k < side * side; k += 1) starts[k + 1] += starts[k];
	const order = new Uint32Array(n);
	for (let i = 0; i < n; i += 1) {
		order[starts[square[i]]] = i;
		starts[square[i]] += 1;
	}
	return order;
}
