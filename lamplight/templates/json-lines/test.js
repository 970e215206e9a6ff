// `node test.js` asks the controller what a run would ask it.
"use strict";

const assert = require("node:assert");
const { spawnSync } = require("node:child_process");

const percept = (tick, bearing_rad) => ({ tick, bump: false, light: { value: 1, bearing_rad, gradient: null }, neighbors: [] });
const lines = [{ robot: 0, life: 1, params: { speed: 0.2 } }, percept(0, null), percept(1, 0)];
const { stdout } = spawnSync("node", [`${__dirname}/controller.js`], { input: lines.map((line) => JSON.stringify(line) + "\n").join("") });
const answers = stdout.toString().trim().split("\n").map((line) => JSON.parse(line));

assert.deepStrictEqual(answers, [{}, { tick: 0, velocity: [0, 0] }, { tick: 1, velocity: [0.2, 0] }]);
console.log("ok");
