// Keeps drawing in time: where a drawing keeps the page busy for long, what lies under the robots (cells, packets) is drawn
// with every second or fourth frame only, and robots do not glide between frames. Robots are drawn with each frame, and the
// last frame before a rest is drawn in whole.

const SLOW_MS = 30;
const QUICK_MS = 10;
const ROUGH_MS = 22; // drawings that take longer than this make gliding look rough
const MOST = 4;
const SETTLE_MS = 1000;

export function makePace() {
	let every = 1;
	let count = 0;
	let meanMs = 8;
	let judged = 0;
	const after = new MessageChannel();
	let began = 0;
	// What is posted while a picture is drawn comes when the browser has painted it.
	after.port1.onmessage = () => {
		const now = performance.now();
		meanMs += 0.12 * (Math.min(200, now - began) - meanMs);
		if (now - judged < SETTLE_MS) return;
		if (meanMs > SLOW_MS && every < MOST) every *= 2;
		else if (meanMs < QUICK_MS && every > 1) every /= 2;
		else return;
		judged = now;
	};
	return {
		/** With every how many-th frame cells are drawn. */
		get every() {
			return every;
		},
		/** Whether there is time to draw between frames. */
		get mayGlide() {
			return meanMs < ROUGH_MS;
		},
		/** A drawing begins. */
		begin() {
			began = performance.now();
			after.port2.postMessage(0);
		},
		/** Whether cells are due with this frame. */
		due() {
			count += 1;
			return count % every === 0;
		},
	};
}
