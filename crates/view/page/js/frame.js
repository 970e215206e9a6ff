// A binary frame as typed arrays that look into the buffer as it came; nothing is copied.

export const VERSION = 1;
const CELLS = 1;
const EDGES = 2;
const GLOBAL = 4;
const ERRORS = 8;
const HEADER = 32;

export class FrameError extends Error {}

const aligned = (length) => (length + 3) & ~3;

/** Reads a frame, or throws a FrameError whose message is a sentence to show. */
export function decode(buffer) {
	if (buffer.byteLength < HEADER) throw new FrameError("The server sent a frame that is too short to read.");
	const view = new DataView(buffer);
	const version = view.getUint32(0, true);
	if (version !== VERSION)
		throw new FrameError(`This page reads frames of version ${VERSION}, and the server sends version ${version}. Reload the page; if that does not help, page and server are of different releases.`);
	const flags = view.getUint32(4, true);
	const n = view.getUint32(24, true);
	const e = view.getUint32(28, true);
	let at = HEADER;
	const take = (Type, count) => {
		const bytes = count * Type.BYTES_PER_ELEMENT;
		if (at + bytes > buffer.byteLength) throw new FrameError("The server sent a frame that ends too early; it is not shown.");
		const array = new Type(buffer, at, count);
		at += aligned(bytes);
		return array;
	};
	const frame = {
		tick: view.getFloat64(8, true),
		timeS: view.getFloat64(16, true),
		n,
		x: take(Float32Array, n),
		y: take(Float32Array, n),
		heading: take(Float32Array, n),
		status: take(Uint8Array, n),
		cells: null,
		edges: null,
		global: null,
		error: null,
	};
	if (flags & CELLS) {
		const cx = take(Float32Array, n);
		const cy = take(Float32Array, n);
		const corners = take(Uint8Array, n);
		const positive = take(Uint8Array, n);
		// For each robot its cell, then its V+.
		const starts = new Uint32Array(n);
		let sum = 0;
		for (let i = 0; i < n; i += 1) {
			starts[i] = sum;
			sum += 2 * (corners[i] + positive[i]);
		}
		frame.cells = { cx, cy, corners, positive, starts, xy: take(Float32Array, sum) };
	}
	if (flags & EDGES) frame.edges = { count: e, sender: take(Uint32Array, e), receiver: take(Uint32Array, e), fate: take(Uint8Array, e) };
	if (flags & GLOBAL) {
		const disagreement = take(Float32Array, n);
		const corners = take(Uint8Array, n);
		const starts = new Uint32Array(n);
		let sum = 0;
		for (let i = 0; i < n; i += 1) {
			starts[i] = sum;
			sum += 2 * corners[i];
		}
		frame.global = { disagreement, corners, starts, xy: take(Float32Array, sum) };
	}
	if (flags & ERRORS) frame.error = take(Float32Array, n);
	return frame;
}
