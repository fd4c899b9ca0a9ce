import { type Incident, type LiveMessage, runs, type RunState } from "../api/runs";
import { Crowd, decodeFrame, type Frame } from "./frames";

export interface LiveEvents {
  onFrame: (frame: Frame, crowd: Crowd) => void;
  onLights: (lights: Record<string, string>) => void;
  onDetectors: (detectors: Record<string, boolean>) => void;
  onState: (state: RunState, speed?: number | null) => void;
  onIncidents: (incidents: Incident[]) => void;
  /** Whether the run has ended, as far as is known by other ways. */
  hasEnded: () => boolean;
  /** All that will ever be on the road are known. */
  onIntroduced: (crowd: Crowd) => void;
}

/** Milliseconds after which a connection that was lost is tried again. */
const AGAIN = 1000;

/**
 * Listens to a run; the newest frame is drawn with the next picture, then the next one is asked for. A
 * connection that is lost is made again until the run has ended.
 */
export class Live {
  crowd = new Crowd();
  private socket: WebSocket;
  private over = false;
  /** Incidents that were passed on, and that this connection has reported: each reports all of them. */
  private passed = 0;
  private reported = 0;
  private retry = 0;
  private waiting: ArrayBuffer | null = null;
  private pending = 0;

  constructor(
    private readonly run: string,
    private readonly events: LiveEvents,
  ) {
    this.socket = this.connect();
  }

  close(): void {
    this.over = true;
    clearTimeout(this.retry);
    cancelAnimationFrame(this.pending);
    this.socket.close();
  }

  private connect(): WebSocket {
    const socket = new WebSocket(runs.liveUrl(this.run));
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => {
      if (typeof event.data === "string") this.read(event.data);
      else this.take(event.data);
    };
    socket.onclose = () => {
      if (this.over || this.events.hasEnded()) return;
      this.retry = window.setTimeout(() => {
        // All road users are introduced anew.
        this.crowd = new Crowd();
        this.reported = 0;
        this.socket = this.connect();
      }, AGAIN);
    };
    return socket;
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
        return this.incidents(message.events);
      case "state":
        return this.events.onState(message.state, message.speed);
      case "end":
        this.over = true;
        return this.events.onState(message.state);
    }
  }

  private incidents(reported: Incident[]): void {
    const fresh = reported.slice(Math.max(0, this.passed - this.reported));
    this.reported += reported.length;
    this.passed += fresh.length;
    if (fresh.length > 0) this.events.onIncidents(fresh);
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
