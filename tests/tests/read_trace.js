// Opens a trace with the importer of Catapult's trace viewer (chrome://tracing), and prints what that has found.
//
// Usage: node read_trace.js trace_viewer_full.html trace.json
//
// The viewer is one page with one script. What of it shows things needs a browser and fails here; what reads traces
// does not.

"use strict";

const fs = require("fs");
const vm = require("vm");

const [page, trace] = process.argv.slice(2);
const [, script] = /<script>([\s\S]*)<\/script>/.exec(fs.readFileSync(page, "utf8"));

const sandbox = { process, performance, setTimeout, clearTimeout, console };
sandbox.global = sandbox;
// Reads large files piece by piece; a whole one is given here.
sandbox.oboe = { drop: {} };
sandbox.text = fs.readFileSync(trace, "utf8");
const context = vm.createContext(sandbox);
for (const part of script.split(/(?='use strict';)/)) {
    try {
        vm.runInContext(part, context);
    } catch {
        // It needs a browser.
    }
}

function opened() {
    const model = new tr.Model();
    const options = new tr.importer.ImportOptions();
    options.showImportWarnings = false;
    new tr.importer.Import(model, options).importTraces([JSON.parse(text)]);
    const slice = (slice) => ({
        title: slice.title,
        parent: slice.parentSlice ? slice.parentSlice.title : null,
        start_ms: slice.start,
        duration_ms: slice.duration,
    });
    const track = (thread) => ({
        process: thread.parent.name,
        name: thread.name,
        slices: thread.sliceGroup.slices.map(slice),
    });
    const end = (slice) => (slice ? { track: slice.parentContainer.name, title: slice.title } : null);
    return JSON.stringify({
        warnings: model.importWarnings.map((warning) => warning.message),
        tracks: Object.values(model.processes).flatMap((process) => Object.values(process.threads).map(track)),
        instants: model.instantEvents.map((instant) => instant.title),
        arrows: model.flowEvents.map((flow) => ({
            duration_ms: flow.duration,
            from: end(flow.startSlice),
            to: end(flow.endSlice),
        })),
    });
}

process.stdout.write(vm.runInContext(`(${opened})()`, context));
