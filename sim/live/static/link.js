// The connection to the run: hands every message to its handler, comes back by itself, sends commands.
const RETRY_MS = 1000;

export class Link {
  constructor(handlers) {
    this.handlers = handlers;
    this.over = false;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/live`);
    this.socket.onopen = () => this.handlers.connection("live", false);
    this.socket.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.type === "result") this.over = true;
      this.handlers[message.type]?.(message);
    };
    this.socket.onclose = () => {
      this.handlers.connection(this.over ? "run ended" : "no connection, trying again", !this.over);
      if (!this.over) setTimeout(() => this.open(), RETRY_MS);
    };
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}
