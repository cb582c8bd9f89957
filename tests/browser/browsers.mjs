// Starts the browser under test with the switches that work without a GPU.
import { mkdtempSync } from 'node:fs';
import { rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import puppeteer from 'puppeteer-core';

// Most other sets of switches compute, but lose the device when the canvas presents.
const chromiumSwitches = [
  '--no-sandbox',
  '--enable-unsafe-webgpu',
  '--enable-features=Vulkan',
  '--use-vulkan=swiftshader',
  '--use-angle=swiftshader',
  '--disable-gpu-watchdog',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
];

// With CHROMIUM_GPU=yes the machine's own Vulkan driver is used instead, for measurements.
const usesGpu = process.env.CHROMIUM_GPU === 'yes';
const gpuSwitches = ['--no-sandbox', '--enable-unsafe-webgpu', '--enable-features=Vulkan', '--use-angle=vulkan', '--disable-vulkan-surface', '--ignore-gpu-blocklist'];

const launchers = {
  // A copy of the switches, for puppeteer takes --enable-features out of the list it is given.
  chromium: (profile) =>
    puppeteer.launch({
      browser: 'chrome',
      executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
      headless: true,
      userDataDir: profile,
      args: [...(usesGpu ? gpuSwitches : chromiumSwitches)],
    }),
  // WebGPU on lavapipe: the Vulkan driver comes from the environment that npm test sets.
  firefox: (profile) =>
    puppeteer.launch({
      browser: 'firefox',
      executablePath: '/usr/bin/firefox-esr',
      headless: true,
      userDataDir: profile,
      extraPrefsFirefox: { 'dom.webgpu.enabled': true, 'gfx.webgpu.ignore-blocklist': true },
    }),
};

/**
 * What the times that tests demand are multiplied by. They hold on two quiet cores; continuous integration runs on machines of
 * unknown speed beside unknown others, and there only what is far off is told.
 */
export const slack = process.env.CI ? 2 : 1;

/** The browser that BROWSER names: chromium or firefox. */
export const browserName = process.env.BROWSER ?? 'chromium';

/** Starts it with an empty profile; `close` ends it and removes the profile. */
export async function launch() {
  const profile = mkdtempSync(join(tmpdir(), `restir-${browserName}-`));
  const browser = await launchers[browserName](profile);
  const close = async () => {
    await browser.close();
    // The browser's last process may write a little longer.
    await rm(profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 250 });
  };
  return { browser, close };
}
