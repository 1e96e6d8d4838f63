// The browser's side of aidsr.apps.web.view3d: what the Vue components scene_view.js and parts_view.js use.
export { Connection } from "./connection.js";
export { squareInWords } from "./floor.js";
export { FACTS, FRAME, STATE, TESTS, TRACKS } from "./frames.js";
export { plate } from "./plate.js";
export { Timeline } from "./timeline.js";
export { canDraw, shortName, Viewer } from "./viewer.js";

const style = document.createElement("link");
style.rel = "stylesheet";
style.href = new URL("./view3d.css", import.meta.url).href;
document.head.append(style);
