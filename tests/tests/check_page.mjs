// Opens the live page in Chromium and checks what is there.
//
// Usage: node check_page.mjs PLAYWRIGHT CHROMIUM URL WHAT [PICTURE]
//
// WHAT is `acts` (a live run: look, select, kill), `many` or `recording`. Prints what it has seen; exits with 1 if something
// is not as it should be.

import { pathToFileURL } from "node:url";

const [playwright, executablePath, url, what, picture] = process.argv.slice(2);
const { chromium } = (await import(pathToFileURL(`${playwright}/index.mjs`))).default ?? {};
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const page = await (await browser.newContext({ viewport: { width: 1440, height: 900 } })).newPage();
const errors = [];
page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
page.on("pageerror", (error) => errors.push(String(error)));

let failures = 0;
const check = (name, isSo, more = "") => {
	console.log(isSo ? "ok" : "FAILED", name, more);
	if (!isSo) failures += 1;
};
const until = async (name, condition, argument) => {
	try {
		await page.waitForFunction(condition, argument, { timeout: 60000 });
		check(name, true);
	} catch {
		check(name, false);
	}
};

await page.goto(url);
check("the token is gone from the address", !page.url().includes("token"), page.url().replace(/:\d+/, ""));
await until("robots are drawn", () => window.lamplight?.frames > 3);
const before = await page.evaluate(() => [0, 1, 2].map((robot) => lamplight.place(robot)));
const haveMoved = (places) =>
	places.some(([x, y], robot) => {
		const now = lamplight.place(robot);
		return Math.hypot(now[0] - x, now[1] - y) > 1e-4;
	});
await until("they move", haveMoved, before);
check("robots", true, String(await page.evaluate(() => lamplight.robots)));

if (what === "acts") {
	await until("plots fill", () => lamplight.plotPoints > 2);
	await until("agents are listed", () => document.querySelectorAll("#agents-body tr[data-robot]").length > 5);
	await page.getByTestId("pause").click();
	await until("ticks are held", () => lamplight.state.paused);
	await page.waitForTimeout(500);
	const at = await page.evaluate(async () => {
		const { camera } = await import("/js/scene.js");
		const [x, y] = lamplight.place(7);
		return [camera.toX(x), camera.toY(y)];
	});
	const box = await page.locator("#arena").boundingBox();
	await page.mouse.click(box.x + at[0], box.y + at[1]);
	await until("a click opens the inspector", () => lamplight.selected === 7);
	await until("neighbors are listed", () => document.querySelectorAll("[data-testid=robot-neighbors] tbody tr").length > 2);
	await page.getByTestId("act-kill").click();
	await until("the kill is answered", () => document.getElementById("answer").textContent.includes("Kill robot 7: done"));
	await page.locator("#arena").focus();
	await page.keyboard.press(".");
	await page.click("#tab-ledger");
	await until("it is in the ledger", () => document.getElementById("ledger").textContent.includes("strikes"));
	await page.locator("#arena").focus();
	await page.keyboard.press("Space");
	await until("the robot is down", () => document.querySelector("[data-testid=robot-state]").textContent === "down");
	await page.getByTestId("act-restart").click();
	await until("it begins a new life", () => document.querySelector("[data-testid=robot-life]").textContent === "1");
	await page.fill("#link-partner", "5");
	await page.getByTestId("act-link").click();
	await until("a link is dropped", () => document.getElementById("answer").textContent.includes("between robot 7 and 5: done"));
	await page.click("#tab-disturb");
	await page.fill("#phi", "400");
	await page.getByTestId("phi-set").click();
	await until("the offset is set", () => document.getElementById("answer").textContent.startsWith("Set Φ to 400: done"));
	await page.keyboard.press("Escape");
	const [download] = await Promise.all([page.waitForEvent("download"), page.getByTestId("save").click()]);
	check("the scenario is saved", download.suggestedFilename().endsWith(".toml"), download.suggestedFilename());
} else {
	await page.waitForTimeout(4000);
	check("frames a second", true, String(Math.round(await page.evaluate(() => lamplight.fps) * 10) / 10));
}
if (picture) await page.screenshot({ path: picture });
const refused = await page.evaluate(() => fetch("/?token=0123456789abcdef0123456789abcdef").then((answer) => answer.status));
check("a wrong token is refused", refused === 403, String(refused));
const said = errors.filter((error) => !error.includes("403"));
check("no error on the console", said.length === 0, said.join("; "));
await browser.close();
process.exit(failures > 0 ? 1 : 0);
