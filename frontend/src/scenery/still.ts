/** Formats of depth that a canvas may have; a copy needs the same. */
const DEPTHS = ["DEPTH24_STENCIL8", "DEPTH_COMPONENT24", "DEPTH_COMPONENT16", "DEPTH_COMPONENT32F"] as const;

/**
 * A copy of what a canvas shows, with its depth, to which what moves is added while nothing else does.
 *
 * Where the canvas has samples for smooth edges, or a depth that cannot be copied, there is none.
 */
export class StillPicture {
  private depth: (typeof DEPTHS)[number] | null | undefined;
  private frame: WebGLFramebuffer | null = null;
  private buffers: WebGLRenderbuffer[] = [];
  private size = "";

  constructor(private readonly gl: WebGLRenderingContext | WebGL2RenderingContext) {
    const one = !gl.getContextAttributes()?.antialias && "blitFramebuffer" in gl;
    this.depth = one ? undefined : null;
  }

  /** Copies what has been drawn; false if this cannot be done here. */
  keep(width: number, height: number): boolean {
    for (const depth of this.depth === undefined ? DEPTHS : [this.depth]) {
      if (depth === null) return false;
      if (this.size !== `${width} ${height} ${depth}`) this.make(width, height, depth);
      this.copy(null, this.frame, width, height);
      if (this.depth === depth || this.isCopied()) {
        this.depth = depth;
        return true;
      }
    }
    this.depth = null;
    this.drop();
    return false;
  }

  /** Puts the copy back on the canvas. */
  show(width: number, height: number): void {
    // A browser clears a canvas that it has shown before the first thing that is drawn, which a copy is not.
    this.gl.clear(this.gl.COLOR_BUFFER_BIT);
    this.copy(this.frame, null, width, height);
  }

  /** Frees what it holds. */
  drop(): void {
    this.gl.deleteFramebuffer(this.frame);
    for (const one of this.buffers) this.gl.deleteRenderbuffer(one);
    [this.frame, this.buffers, this.size] = [null, [], ""];
  }

  private isCopied(): boolean {
    const { gl } = this;
    let fine = true;
    while (gl.getError() !== gl.NO_ERROR) fine = false;
    return fine;
  }

  private make(width: number, height: number, depth: (typeof DEPTHS)[number]): void {
    this.drop();
    const gl = this.gl as WebGL2RenderingContext;
    const point = depth === "DEPTH24_STENCIL8" ? gl.DEPTH_STENCIL_ATTACHMENT : gl.DEPTH_ATTACHMENT;
    this.frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    this.buffers = (
      [
        [gl.RGBA8, gl.COLOR_ATTACHMENT0],
        [gl[depth], point],
      ] as const
    ).map(([format, attachment]) => {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, buffer);
      return buffer;
    });
    gl.bindRenderbuffer(gl.RENDERBUFFER, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.size = `${width} ${height} ${depth}`;
  }

  private copy(
    from: WebGLFramebuffer | null,
    to: WebGLFramebuffer | null,
    width: number,
    height: number,
  ): void {
    const gl = this.gl as WebGL2RenderingContext;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, from);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, to);
    const both = gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT;
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, both, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null); // as three.js has left it
  }
}
