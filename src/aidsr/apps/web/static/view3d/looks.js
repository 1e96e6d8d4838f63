// Colours of the two themes, and what tension looks like.
import { Color } from "./three/three.js";

export const THEMES = {
  light: {
    sky: ["#f7f9fb", "#dde4ea"],
    floor: "#eef1f4",
    line: "#b9c3cd",
    slack: "#7f93a6",
    hemisphere: ["#ffffff", "#b8b2a8", 1.05],
    lamp: ["#fff6e8", 2.1],
    surround: 0.45,
  },
  dark: {
    sky: ["#222a33", "#12161b"],
    floor: "#1d242c",
    line: "#46525f",
    slack: "#8da2b7",
    hemisphere: ["#cfdcec", "#2b2f36", 0.75],
    lamp: ["#fff1dd", 2.0],
    surround: 0.38,
  },
};

export const ERROR = new Color("#ff2d20");
export const WARNING = new Color("#ff9500");
export const CHOSEN = new Color("#1f8fff");

// Slack, half pull, full pull; chosen to differ in lightness too, for those who do not see red and green apart.
const HALF = new Color("#f5a623");
const FULL = new Color("#e0231c");
const PUSHING = new Color("#9b51e0");

/** Write the colour of a tendon that is pulled with a share of the full pull; a negative one pushes, as no tendon can. */
export function tensionColour(share, slack, colour) {
  if (share < -0.02) return colour.copy(PUSHING);
  // small pulls are many and large ones few: the root spreads them over the scale
  const shown = Math.sqrt(Math.min(Math.max(share, 0), 1));
  return shown < 0.5 ? colour.copy(slack).lerp(HALF, 2 * shown) : colour.copy(HALF).lerp(FULL, 2 * shown - 1);
}
