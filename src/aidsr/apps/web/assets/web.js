// Clocks that run in the browser, so that the server need not count seconds, and the keys that work on every page.
function tick() {
  for (const clock of document.querySelectorAll("[data-since]")) {
    const seconds = Math.max(0, Math.round((Date.now() - Date.parse(clock.dataset.since)) / 1000));
    const [h, m, s] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
    clock.textContent = h ? `${h} h ${m} min` : m ? `${m} min ${s} s` : `${s} s`;
  }
}
setInterval(tick, 1000);
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest("input, textarea, select, [contenteditable]");
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === "/") { const field = document.querySelector("[data-search] input, input[data-search]"); if (field) { event.preventDefault(); field.focus(); } }
  if (event.key === "n") location.href = "/new";
  if (event.key === "h") location.href = "/";
});
// A success takes a fraction of a second: its film is slowed down to some seconds, and its end stays for a while.
const LEAST_S = 4, HELD_MS = 1500;
document.addEventListener("loadedmetadata", ({ target }) => {
  if (!target.matches("video.film")) return;
  target.playbackRate = Math.min(1, Math.max(0.1, target.duration / LEAST_S));
  const pace = target.parentElement.querySelector(".pace");
  if (pace && target.playbackRate < 1) pace.textContent = `, at ${target.playbackRate.toPrecision(2)} times real time`;
}, true);
document.addEventListener("ended", ({ target }) => { if (target.matches("video.film")) setTimeout(() => target.play(), HELD_MS); }, true);
