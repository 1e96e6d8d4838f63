// The WebSocket to a view on the server: reconnects when it is lost, and rests while the page is hidden.
import { readMessage } from "./frames.js";

const UNKNOWN_VIEW = 4404;
const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 5000;

export class Connection {
  /**
   * @param {string} path  of the view on this server
   * @param {{message: (kind: number, value: object) => void, status: (status: string) => void}} listener
   *   `status` is called with "connecting", "open", "lost" (it is tried again) or "gone" (the server does not know the view)
   */
  constructor(path, listener) {
    this.url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${path}`;
    this.listener = listener;
    this.wait = FIRST_WAIT_MS;
    this.wanted = false;
    this.waiting = null;
  }

  /** Look, or stop looking: without anybody who looks the server simulates nothing. */
  look(wanted) {
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    clearTimeout(this.timer);
    if (wanted) this.open();
    else this.socket?.close();
  }

  send(command) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  /** Look, and send a command as soon as it can be; of several the last one counts. */
  ask(command) {
    this.look(true);
    if (this.socket?.readyState === WebSocket.OPEN) this.send(command);
    else this.waiting = command;
  }

  open() {
    if (!this.wanted) return;
    this.listener.status("connecting");
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = FIRST_WAIT_MS;
      this.listener.status("open");
      if (this.waiting) this.send(this.waiting);
      this.waiting = null;
    };
    socket.onmessage = (event) => {
      const { kind, value } = readMessage(event.data);
      this.listener.message(kind, value);
    };
    socket.onclose = (event) => this.closed(socket, event.code);
    this.socket = socket;
  }

  closed(socket, code) {
    if (socket !== this.socket) return;
    this.socket = null;
    if (code === UNKNOWN_VIEW) {
      this.wanted = false;
      this.listener.status("gone");
    } else if (this.wanted) {
      this.listener.status("lost");
      this.timer = setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    }
  }
}
