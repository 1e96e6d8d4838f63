// The browser's side of aidsr.web.view3d: what the Vue component in scene_view.js uses.
export { Connection } from "./connection.js";
export { FACTS, FRAME, STATE, TESTS } from "./frames.js";
export { canDraw, shortName, Viewer } from "./viewer.js";

const style = document.createElement("link");
style.rel = "stylesheet";
style.href = new URL("./view3d.css", import.meta.url).href;
document.head.append(style);
