import { type Incident, type LiveMessage, runs, type RunState } from "../api/runs";
import { Crowd, decodeFrame, type Frame } from "./frames";

export interface LiveEvents {
  onFrame: (frame: Frame, crowd: Crowd) => void;
  onLights: (lights: Record<string, string>) => void;
  onDetectors: (detectors: Record<string, boolean>) => void;
  onState: (state: RunState, speed?: number | null) => void;
  onIncidents: (incidents: Incident[]) => void;
  /** All that will ever be on the road are known. */
  onIntroduced: (crowd: Crowd) => void;
}

/** Listens to a run; the newest frame is drawn with the next picture, then the next one is asked for. */
export class Live {
  readonly crowd = new Crowd();
  private readonly socket: WebSocket;
  private waiting: ArrayBuffer | null = null;
  private pending = 0;

  constructor(
    run: string,
    private readonly events: LiveEvents,
  ) {
    this.socket = new WebSocket(runs.liveUrl(run));
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => {
      if (typeof event.data === "string") this.read(event.data);
      else this.take(event.data);
    };
  }

  close(): void {
    cancelAnimationFrame(this.pending);
    this.socket.close();
  }

  private read(text: string): void {
    const message = JSON.parse(text) as LiveMessage;
    switch (message.type) {
      case "hello":
        this.crowd.origin = message.origin;
        this.crowd.introduce(message.actors);
        return this.events.onIntroduced(this.crowd);
      case "lights":
        return this.events.onLights(message.lights);
      case "detectors":
        return this.events.onDetectors(message.detectors);
      case "events":
        return this.events.onIncidents(message.events);
      case "state":
        return this.events.onState(message.state, message.speed);
      case "end":
        return this.events.onState(message.state);
    }
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
