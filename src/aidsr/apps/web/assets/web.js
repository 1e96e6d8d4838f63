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
// A page of the manual is drawn only after the browser looked for the heading that its address names.
function arrive(tries = 50) {
  const heading = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (heading) heading.scrollIntoView(); else if (tries) setTimeout(arrive, 100, tries - 1);
}
if (location.hash) arrive();
// A success takes a fraction of a second: its film is slowed down to some seconds, and its end stays for a while.
const LEAST_S = 4, HELD_MS = 1500;
document.addEventListener("loadedmetadata", ({ target }) => {
  if (!target.matches("video.film")) return;
  target.playbackRate = Math.min(1, Math.max(0.1, target.duration / LEAST_S));
  const pace = target.parentElement.querySelector(".pace");
  if (pace && target.playbackRate < 1) pace.textContent = `, at ${target.playbackRate.toPrecision(2)} times real time`;
}, true);
document.addEventListener("ended", ({ target }) => { if (target.matches("video.film")) setTimeout(() => target.play(), HELD_MS); }, true);
// What waits for a person is counted in the title and on the icon, and told on the desktop where that was asked for.
const title = () => document.title.replace(/^\(\d+\) /, "");
const icon = (dot) => `data:image/svg+xml,${encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">
  <rect width="32" height="32" rx="7" fill="#1c6770"/><path d="M8 5v8c0 8 12 4 12 12M8 5h8" fill="none" stroke="#fff" stroke-width="4" stroke-linecap="round"/>
  ${dot ? '<circle cx="24" cy="24" r="7" fill="#e8590c"/>' : ""}</svg>`)}`;
let awaited = null;
function count() {
  const link = document.querySelector("[data-awaited]");
  if (!link || Number(link.dataset.awaited) === awaited) return;
  const more = awaited !== null && Number(link.dataset.awaited) > awaited;
  awaited = Number(link.dataset.awaited);
  document.title = awaited ? `(${awaited}) ${title()}` : title();
  document.querySelector("link[rel~=icon]").href = icon(awaited > 0);
  if (more && window.Notification?.permission === "granted")
    new Notification("AID-SR waits for you", { body: link.textContent.trim(), tag: "aidsr" });
}
setInterval(count, 1000);
window.askToNotify = () => window.Notification?.requestPermission();
