// φ over the arena: its values on a coarse grid, as colors of equal perceptual steps (linear in OKLCH) and as contour lines.

const CELLS = 144; // along the longer side
const CONTOURS = 8;

/** φ at a point, as the protocol defines it. */
export function phi(field, x, y) {
	let value = field.offset ?? 0;
	for (const g of field.gaussians ?? []) {
		const dx = x - g.center_m[0];
		const dy = y - g.center_m[1];
		value += g.amplitude * Math.exp(-(dx * dx + dy * dy) / (2 * g.sigma_m * g.sigma_m));
	}
	for (const l of field.lamps ?? []) {
		const dx = (x - l.position_m[0]) / l.half_distance_m;
		const dy = (y - l.position_m[1]) / l.half_distance_m;
		value += l.peak / (1 + dx * dx + dy * dy);
	}
	return value;
}

/** 256 colors from the darkest to the brightest light, as RGB bytes. */
export function ramp({ light, chroma, hue }) {
	const out = new Uint8ClampedArray(256 * 3);
	for (let i = 0; i < 256; i += 1) {
		const t = i / 255;
		const mix = ([a, b]) => a + (b - a) * t;
		const rgb = oklch(mix(light), mix(chroma), mix(hue));
		for (let c = 0; c < 3; c += 1) out[3 * i + c] = Math.round(255 * rgb[c]);
	}
	return out;
}

function oklch(lightness, chroma, degrees) {
	const a = chroma * Math.cos((degrees * Math.PI) / 180);
	const b = chroma * Math.sin((degrees * Math.PI) / 180);
	const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
	const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
	const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
	return [
		4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
		-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
		-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
	].map((v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * Math.max(v, 0) ** (1 / 2.4) - 0.055));
}

/** The heat map of a field: an image to be stretched over the arena, the range of values, contour segments in meters. */
export function heatMap(field, width, height, heat) {
	const h = Math.max(width, height) / CELLS;
	const nx = Math.max(2, Math.round(width / h));
	const ny = Math.max(2, Math.round(height / h));
	const values = new Float64Array(nx * ny);
	let least = Infinity;
	let most = -Infinity;
	for (let j = 0; j < ny; j += 1) {
		const y = (1 - (j + 0.5) / ny) * height;
		for (let i = 0; i < nx; i += 1) {
			const v = phi(field, ((i + 0.5) / nx) * width, y);
			values[j * nx + i] = v;
			if (v < least) least = v;
			if (v > most) most = v;
		}
	}
	const span = most - least;
	const flat = !(span > 1e-9 * Math.max(1, Math.abs(most)));
	const image = new OffscreenCanvas(nx, ny);
	const context = image.getContext("2d");
	const pixels = context.createImageData(nx, ny);
	const rgb = ramp(heat);
	for (let k = 0; k < values.length; k += 1) {
		const c = 3 * (flat ? 0 : Math.round((255 * (values[k] - least)) / span));
		pixels.data[4 * k] = rgb[c];
		pixels.data[4 * k + 1] = rgb[c + 1];
		pixels.data[4 * k + 2] = rgb[c + 2];
		pixels.data[4 * k + 3] = 255;
	}
	context.putImageData(pixels, 0, 0);
	return { image, least, most, rgb, contours: flat ? [] : contours(values, nx, ny, width, height, least, span) };
}

/** Marching squares without the ambiguous case resolved: two segments, which is fine at this scale. */
function contours(values, nx, ny, width, height, least, span) {
	const out = [];
	const X = (i) => ((i + 0.5) / nx) * width;
	const Y = (j) => (1 - (j + 0.5) / ny) * height;
	for (let c = 1; c < CONTOURS; c += 1) {
		const level = least + (span * c) / CONTOURS;
		for (let j = 0; j + 1 < ny; j += 1) {
			for (let i = 0; i + 1 < nx; i += 1) {
				const a = values[j * nx + i] - level;
				const b = values[j * nx + i + 1] - level;
				const d = values[(j + 1) * nx + i] - level;
				const e = values[(j + 1) * nx + i + 1] - level;
				const at = out.length;
				if (a > 0 !== b > 0) out.push(X(i + a / (a - b)), Y(j));
				if (b > 0 !== e > 0) out.push(X(i + 1), Y(j + b / (b - e)));
				if (d > 0 !== e > 0) out.push(X(i + d / (d - e)), Y(j + 1));
				if (a > 0 !== d > 0) out.push(X(i), Y(j + a / (a - d)));
				if ((out.length - at) % 4) out.length = at;
			}
		}
	}
	return out;
}
