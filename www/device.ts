// The graphics device that all viewers of a page share: its pipelines are made once.
import { Device } from './pkg/restir.js';

let opened: Promise<Device> | undefined;

/** The device; another one where it has been lost. Rejects with `NO_ADAPTER`. */
export async function sharedDevice(): Promise<Device> {
  for (;;) {
    const asked = (opened ??= Device.open());
    const device = await asked.catch(() => undefined);
    if (device && !device.is_lost()) return device;
    // Whoever comes first opens another.
    if (opened === asked) opened = undefined;
    if (!device) return asked;
  }
}
