// From where a scene is seen: through one of its cameras, or from where the user has moved to.
import type { Camera, Pose } from './api.js';
import { OrbitCamera } from './camera.js';
import type { Viewer } from './pkg/restir.js';
import type { Settings } from './url-state.js';
import type { Scene } from './viewer-events.js';

/** The camera of a picture, kept in its settings. */
export class SceneCamera {
  /** What the user moves. */
  readonly orbit = new OrbitCamera();

  constructor(
    private readonly settings: Settings,
    private readonly scene: () => Scene | undefined,
  ) {}

  /** Index of the scene's camera that was chosen last. */
  get index(): number {
    return this.indexOf(this.settings.camera) ?? 0;
  }

  /** Looks through a camera of the scene, by index or name, and moves with it. Throws `UNKNOWN_NAME`. */
  follow(viewer: Viewer, camera: string): void {
    const index = this.indexOf(camera);
    if (index === undefined) {
      const names = (this.scene()?.cameras ?? []).map(({ name }, at) => name || at).join(', ');
      throw { code: 'UNKNOWN_NAME', message: `the scene has no camera ${camera}; there are: ${names}` };
    }
    viewer.follow_camera(index);
    Object.assign(this.settings, { camera, pose: undefined });
    this.take(viewer);
  }

  /** Looks from `pose` through the lens of the chosen camera. Throws `BAD_VALUE`. */
  setPose(viewer: Viewer, pose: Pose): void {
    const posed: Camera = { ...(this.scene()?.cameras[this.index] ?? { vertical_fov: 0.8 }), ...pose };
    viewer.set_camera(JSON.stringify(posed));
    this.settings.pose = pose;
    this.orbit.set(posed, viewer.bounds());
  }

  /** Looks from where the user has moved to, which it returns. */
  applyOrbit(viewer: Viewer): Camera {
    const camera = this.orbit.toCamera();
    viewer.set_camera(JSON.stringify(camera));
    this.settings.pose = camera;
    return camera;
  }

  /** After a frame through a camera that moves by itself: the user takes over from where it is. */
  syncOrbit(viewer: Viewer): void {
    const { pose } = this.settings;
    if (pose === undefined && this.scene()?.report.moving_cameras.includes(this.index)) this.take(viewer);
  }

  private take(viewer: Viewer): void {
    this.orbit.set(JSON.parse(viewer.camera()) as Camera, viewer.bounds());
  }

  private indexOf(camera: string): number | undefined {
    const cameras = this.scene()?.cameras ?? [];
    const index = Number(camera || NaN);
    const found = cameras[index] ? index : cameras.findIndex(({ name }) => name === camera);
    return found >= 0 ? found : undefined;
  }
}
