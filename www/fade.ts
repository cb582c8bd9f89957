// Lets a sharp picture come through the one before it: that lies over the canvas, and fades.

/** Milliseconds. */
const duration = 200;

export class Fade {
  private readonly overlay = document.createElement('canvas');
  private timer = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.overlay.ariaHidden = 'true';
  }

  /** Keeps what the canvas shows above it. To be called in the task that presented it: later a WebGPU canvas is blank. */
  keep(): void {
    const { canvas, overlay } = this;
    if (matchMedia('(prefers-reduced-motion: reduce)').matches || !canvas.parentNode) return;
    this.end();
    [overlay.width, overlay.height] = [canvas.width, canvas.height];
    overlay.getContext('2d')?.drawImage(canvas, 0, 0);
    const { position, objectFit, clipPath } = getComputedStyle(canvas);
    Object.assign(overlay.style, {
      position: position === 'fixed' ? position : 'absolute',
      inset: `${canvas.offsetTop}px auto auto ${canvas.offsetLeft}px`,
      width: `${canvas.offsetWidth}px`,
      height: `${canvas.offsetHeight}px`,
      objectFit,
      clipPath,
      opacity: '1',
      pointerEvents: 'none',
      transition: `opacity ${duration}ms`,
    });
    canvas.after(overlay);
  }

  /** The canvas has the sharp picture. */
  begin(): void {
    if (!this.overlay.isConnected || this.timer) return;
    this.overlay.style.opacity = '0';
    this.timer = window.setTimeout(() => this.end(), duration);
  }

  /** At once. */
  end(): void {
    clearTimeout(this.timer);
    this.timer = 0;
    this.overlay.remove();
  }
}
