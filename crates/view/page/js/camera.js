// Where on the canvas a point of the arena is: pan and zoom. The arena's y goes up, the canvas's goes down.

const MARGIN = { top: 20, side: 20, below: 40 }; // below is the bar of the scale
const MOST_PX_PER_M = 4000;

export function makeCamera() {
	const camera = {
		width: 1,
		height: 1,
		scale: 100, // CSS pixels per meter
		left: 0,
		bottom: 0,
		fitted: true,
		arena: [1, 1],
		toX: (x) => camera.left + x * camera.scale,
		toY: (y) => camera.bottom - y * camera.scale,
		fromX: (px) => (px - camera.left) / camera.scale,
		fromY: (py) => (camera.bottom - py) / camera.scale,
		resize(width, height) {
			if (camera.fitted || camera.width <= 1) {
				camera.width = width;
				camera.height = height;
				camera.fit();
				return;
			}
			camera.left += (width - camera.width) / 2;
			camera.bottom += (height - camera.height) / 2;
			camera.width = width;
			camera.height = height;
		},
		fit() {
			const [w, h] = camera.arena;
			camera.scale = Math.max(1e-3, Math.min((camera.width - 2 * MARGIN.side) / w, (camera.height - MARGIN.top - MARGIN.below) / h));
			camera.left = (camera.width - w * camera.scale) / 2;
			camera.bottom = (camera.height + MARGIN.top - MARGIN.below + h * camera.scale) / 2;
			camera.fitted = true;
		},
		zoom(factor, px = camera.width / 2, py = camera.height / 2) {
			const least = Math.min(camera.width / camera.arena[0], camera.height / camera.arena[1]) / 4;
			const scale = Math.min(MOST_PX_PER_M, Math.max(least, camera.scale * factor));
			const ratio = scale / camera.scale;
			camera.left = px + (camera.left - px) * ratio;
			camera.bottom = py + (camera.bottom - py) * ratio;
			camera.scale = scale;
			camera.fitted = false;
		},
		pan(dx, dy) {
			camera.left += dx;
			camera.bottom += dy;
			camera.fitted = false;
		},
		/** Moves the view so that a point is in it. */
		reveal(x, y) {
			const px = camera.toX(x);
			const py = camera.toY(y);
			const edge = 30;
			if (px < edge || py < edge || px > camera.width - edge || py > camera.height - edge) {
				if (!camera.fitted) camera.pan(camera.width / 2 - px, camera.height / 2 - py);
			}
		},
	};
	return camera;
}
