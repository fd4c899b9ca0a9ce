import { api } from "../api/client";
import { Crowd, decodeFrame, type Frame, type Introduced } from "./frames";

export interface LiveEvents {
  onFrame: (frame: Frame, crowd: Crowd) => void;
  onLights: (lights: Record<string, string>) => void;
  onState: (state: string) => void;
  /** The connection is gone: the run has ended, or the server is not there. */
  onClose: () => void;
}

interface Message {
  origin?: [number, number];
  actors?: Introduced[];
  lights?: Record<string, string>;
  state?: string;
}

/** Listens to a run; the newest frame is drawn with the next picture, then the next one is asked for. */
export class Live {
  readonly crowd = new Crowd();
  private readonly socket: WebSocket;
  private waiting: ArrayBuffer | null = null;
  private pending = 0;
  private closed = false;

  constructor(run: string, private readonly events: LiveEvents) {
    this.socket = new WebSocket(api.liveUrl(run));
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => {
      if (typeof event.data === "string") this.read(event.data);
      else this.take(event.data);
    };
    this.socket.onclose = () => { if (!this.closed) events.onClose(); };
  }

  close(): void {
    this.closed = true;
    cancelAnimationFrame(this.pending);
    this.socket.close();
  }

  private read(text: string): void {
    const message = JSON.parse(text) as Message;
    if (message.origin) this.crowd.origin = message.origin;
    if (message.actors) this.crowd.introduce(message.actors);
    if (message.lights) this.events.onLights(message.lights);
    if (message.state) this.events.onState(message.state);
  }

  private take(data: ArrayBuffer): void {
    this.waiting = data;
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      if (!this.waiting) return;
      const frame = decodeFrame(this.waiting);
      this.waiting = null;
      if (this.socket.readyState === WebSocket.OPEN) this.socket.send("ack");
      this.events.onFrame(frame, this.crowd);
    });
  }
}
