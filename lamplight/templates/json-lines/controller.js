// A robot that drives towards the light and keeps away from others: a line of JSON in, a line out.
"use strict";

let speed = 0.1;

require("node:readline")
    .createInterface({ input: process.stdin })
    .on("line", (line) => console.log(JSON.stringify(answer(JSON.parse(line)))));

function answer(percept) {
    if (!("tick" in percept)) {
        // The first line of a life says who this is.
        speed = percept.params.speed ?? speed;
        return {};
    }
    const toLight = percept.light.bearing_rad;
    let [x, y] = toLight === null ? [0, 0] : [speed * Math.cos(toLight), speed * Math.sin(toLight)];
    for (const { range_m, bearing_rad } of percept.neighbors) {
        if (range_m < 0.25) {
            x -= 2 * speed * Math.cos(bearing_rad);
            y -= 2 * speed * Math.sin(bearing_rad);
        }
    }
    return { tick: percept.tick, velocity: [x, y] };
}
