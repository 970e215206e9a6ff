// How things look, wherever they are drawn: robots by state, lamps, marks. All of a kind go into one path.

const TAU = 2 * Math.PI;

/** Adds a robot's body to a path: who is small on the screen is a square, which is quick to fill. */
export function body(path, x, y, r) {
	if (r < 1.7) path.rect(x - r, y - r, 2 * r, 2 * r);
	else {
		path.moveTo(x + r, y);
		path.arc(x, y, r, 0, TAU);
	}
}

/** Adds a robot's shape by its state: 0 present, 1 paused, 2 down, 3 left out, 4 not joined. */
export function shape(path, status, x, y, r) {
	if (status === 2) {
		const d = Math.max(2, r * 0.75);
		path.moveTo(x - d, y - d);
		path.lineTo(x + d, y + d);
		path.moveTo(x - d, y + d);
		path.lineTo(x + d, y - d);
	} else if (status === 3) path.rect(x - r, y - r, 2 * r, 2 * r);
	else if (status === 4) {
		path.moveTo(x + r * 0.6, y);
		path.arc(x, y, r * 0.6, 0, TAU);
	} else body(path, x, y, r);
}

/** Strokes or fills a path of robots of one state. */
export function paint(context, path, status, c, r) {
	const line = Math.max(1, Math.min(2.5, r * 0.35));
	if (status === 0) {
		context.fillStyle = c.robot;
		context.fill(path);
		if (r > 4) {
			context.strokeStyle = c.robotEdge;
			context.lineWidth = 1;
			context.stroke(path);
		}
		return;
	}
	context.strokeStyle = status === 1 ? c.paused : status === 4 ? c.soft : c.down;
	context.lineWidth = line;
	if (status === 1 || status === 3) {
		context.fillStyle = c.page;
		context.fill(path);
	}
	context.stroke(path);
}

/** A lamp: a disc with eight rays. */
export function lamp(context, x, y, c, size = 6) {
	const path = new Path2D();
	for (let k = 0; k < 8; k += 1) {
		const a = (k * TAU) / 8;
		path.moveTo(x + Math.cos(a) * size * 1.35, y + Math.sin(a) * size * 1.35);
		path.lineTo(x + Math.cos(a) * size * 1.9, y + Math.sin(a) * size * 1.9);
	}
	context.strokeStyle = c.lamp;
	context.fillStyle = c.lampFill;
	context.lineWidth = 1.5;
	context.stroke(path);
	const disc = new Path2D();
	disc.arc(x, y, size, 0, TAU);
	context.fill(disc);
	context.stroke(disc);
}

/** Adds an upright cross to a path. */
export function plus(path, x, y, r) {
	path.moveTo(x - r, y);
	path.lineTo(x + r, y);
	path.moveTo(x, y - r);
	path.lineTo(x, y + r);
}

/**
 * Adds things one by one to paths of `size` things each and paints these: a path with thousands of parts is slow to fill,
 * and so is a path for each. `add(path, i)` may leave a thing out.
 */
export function inBatches(count, size, add, paintPath) {
	for (let from = 0; from < count; from += size) {
		const path = new Path2D();
		const to = Math.min(count, from + size);
		for (let i = from; i < to; i += 1) add(path, i);
		paintPath(path);
	}
}

export const BATCH = 16;

/** Adds a closed polygon of `count` corners, which start at `at`, to a path. */
export function polygon(path, camera, xy, at, count) {
	if (count < 2) return;
	path.moveTo(camera.toX(xy[at]), camera.toY(xy[at + 1]));
	for (let k = 1; k < count; k += 1) path.lineTo(camera.toX(xy[at + 2 * k]), camera.toY(xy[at + 2 * k + 1]));
	path.closePath();
}

/** A bar of round length for the scale: [meters, text]. */
export function roundLength(metersAtMost) {
	const power = 10 ** Math.floor(Math.log10(metersAtMost));
	const m = [5, 2, 1].map((k) => k * power).find((v) => v <= metersAtMost) ?? power;
	return [m, m >= 1 ? `${m} m` : m >= 0.01 ? `${Math.round(m * 100)} cm` : `${Math.round(m * 1000)} mm`];
}
