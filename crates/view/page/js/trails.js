// Where robots have been: for each a ring of its last places. Its length is bounded by the number of robots.

import { inBatches } from "./glyphs.js";

const PLACES_IN_ALL = 36_000;
const LONGEST = 80;
const SHORTEST = 10;
const FEW = 200;
const AT_ONCE = 128; // trails in a path
const BANDS = 3; // the older a part of a trail, the fainter

export class Trails {
	constructor(robots, stepM) {
		this.n = robots;
		this.length = Math.max(SHORTEST, Math.min(LONGEST, Math.floor(PLACES_IN_ALL / Math.max(1, robots))));
		this.step2 = stepM * stepM;
		this.x = new Float32Array(robots * this.length);
		this.y = new Float32Array(robots * this.length);
		this.head = new Uint16Array(robots);
		this.count = new Uint16Array(robots);
	}

	clear() {
		this.count.fill(0);
	}

	/** Takes up a frame: a place is kept once a robot has moved by a step from the last one kept. */
	add(frame) {
		const { length, step2 } = this;
		for (let i = 0; i < Math.min(this.n, frame.n); i += 1) {
			const x = frame.x[i];
			const y = frame.y[i];
			const last = i * length + this.head[i];
			if (this.count[i] > 0) {
				const dx = x - this.x[last];
				const dy = y - this.y[last];
				if (dx * dx + dy * dy < step2) continue;
			}
			if (frame.status[i] === 4) continue;
			this.head[i] = (this.head[i] + 1) % length;
			this.count[i] = Math.min(length, this.count[i] + 1);
			this.x[i * length + this.head[i]] = x;
			this.y[i * length + this.head[i]] = y;
		}
	}

	/** Strokes the trails in bands of growing faintness. */
	draw(context, camera, rgb, x, y, visible, order) {
		const { length } = this;
		const band = Math.ceil(length / BANDS);
		context.lineWidth = this.n > FEW ? 1 : 1.2; // at most 1 is much quicker
		for (let b = BANDS - 1; b >= 0; b -= 1) {
			context.strokeStyle = `rgba(${rgb},${0.62 - 0.22 * b})`;
			const add = (path, k0) => {
				const i = order[k0];
				const from = b * band;
				const to = Math.min((b + 1) * band, this.count[i] - 1);
				if (to < from || this.count[i] === 0 || !visible(x[i], y[i])) return;
				let k = (this.head[i] - from + length) % length;
				if (b === 0) {
					path.moveTo(camera.toX(x[i]), camera.toY(y[i]));
					path.lineTo(camera.toX(this.x[i * length + k]), camera.toY(this.y[i * length + k]));
				} else path.moveTo(camera.toX(this.x[i * length + k]), camera.toY(this.y[i * length + k]));
				for (let s = from; s < to; s += 1) {
					k = k === 0 ? length - 1 : k - 1;
					path.lineTo(camera.toX(this.x[i * length + k]), camera.toY(this.y[i * length + k]));
				}
			};
			inBatches(order.length, AT_ONCE, add, (path) => context.stroke(path));
		}
	}
}
