// A robot that drives towards the light and says how bright it is: a line of JSON in, a line out.
"use strict";

const SPEED_M_PER_S = 0.1;

require("node:readline")
    .createInterface({ input: process.stdin })
    .on("line", (line) => console.log(JSON.stringify(answer(JSON.parse(line)))));

function answer(percept) {
    // The first line of a life says who this is, and has no tick.
    if (!("tick" in percept)) return {};
    const bearing = percept.light.bearing_rad;
    const speed = bearing === null ? 0 : SPEED_M_PER_S;
    const light = Buffer.alloc(4);
    light.writeFloatLE(percept.light.value);
    return {
        tick: percept.tick,
        velocity: [speed * Math.cos(bearing), speed * Math.sin(bearing)],
        payload: light.toString("base64"),
    };
}
