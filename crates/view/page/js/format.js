// Numbers as text. What is not known is an en dash.

export const UNKNOWN = "–";
const known = (value) => typeof value === "number" && Number.isFinite(value);

/** A number with a fixed count of decimals. */
export const fixed = (value, decimals = 2) => (known(value) ? value.toFixed(decimals).replace("-", "−") : UNKNOWN);

/** A whole number, its thousands apart. */
export const whole = (value) => (known(value) ? Math.round(value).toLocaleString("en-US").replaceAll(",", "\u202f") : UNKNOWN);

/** A number with about three significant digits. */
export function short(value) {
	if (!known(value)) return UNKNOWN;
	const size = Math.abs(value);
	if (size === 0) return "0";
	if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replaceAll("-", "−");
	return fixed(value, Math.max(0, 2 - Math.floor(Math.log10(size))));
}

/** Seconds of virtual time; as many decimals as a step has. */
export const seconds = (value, decimals = 1) => (known(value) ? `${fixed(value, decimals)} s` : UNKNOWN);

/** Microseconds, or milliseconds where they are many. */
export function micros(value) {
	if (!known(value)) return UNKNOWN;
	if (value >= 10_000) return `${short(value / 1000)} ms`;
	return `${value < 100 ? fixed(value, 1) : whole(value)} µs`;
}

/** A share as percent. */
export const percent = (value, decimals = 1) => (known(value) ? `${fixed(value * 100, decimals)} %` : UNKNOWN);

/** Radians as degrees, from -180 to 180. */
export const degrees = (value) => (known(value) ? `${fixed((Math.atan2(Math.sin(value), Math.cos(value)) * 180) / Math.PI, 1)}°` : UNKNOWN);

/** How many: "1 robot", "3 robots". */
export const many = (count, noun) => `${whole(count)} ${noun}${count === 1 ? "" : "s"}`;

/** Bytes in hexadecimal, in pairs, so that they wrap. */
export const hex = (text) => (text ? text.replace(/(..)(?=.)/g, "$1 ") : UNKNOWN);
