// Sets up what is missing, and only that. Uses rustup, cargo, npm and apt, nothing else.
import { existsSync, readFileSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { environment, lavapipeManifest, root, toolsFolder } from './environment.mjs';
import { StepError, asText, execute, run } from './run.mjs';

const succeeds = async (...command) => (await execute(command)).code === 0;
const prints = async (text, ...command) => (await execute(command)).output.includes(text);
const onPath = (program) => environment.PATH.split(delimiter).some((folder) => existsSync(join(folder, program)));

const readJson = (path) => (existsSync(path) ? JSON.parse(readFileSync(path, 'utf8')) : {});
const minimumRust = () => /^rust-version = "(.+)"/m.exec(readFileSync(join(root, 'Cargo.toml'), 'utf8'))[1];

/** Whether the active compiler is at least Cargo.toml's `rust-version`. */
async function rustIsNewEnough() {
  const found = /^rustc (\d+)\.(\d+)/.exec((await execute(['rustc', '--version'])).output);
  const [major, minor] = minimumRust().split('.').map(Number);
  return found !== null && (Number(found[1]) - major || Number(found[2]) - minor) >= 0;
}

/** Whether the wasm target's standard library is there (however it got there: rustup or a distribution). */
async function hasWasmTarget() {
  const { code, output } = await execute(['rustc', '--print', 'target-libdir', '--target', 'wasm32-unknown-unknown']);
  return code === 0 && existsSync(output.trim());
}

/** Whether node_modules holds the versions that package-lock.json names. */
function hasNpmPackages() {
  const locked = Object.entries(readJson(join(root, 'package-lock.json')).packages ?? {});
  return locked.every(([path, entry]) => !path || entry.optional || readJson(join(root, path, 'package.json')).version === entry.version);
}

const cargoTool = (name, crate, version) => ({
  name: `${name} ${version}`,
  check: () => prints(version, join(toolsFolder, 'bin', name), '--version'),
  // A debug build without debug information compiles in a third of the time and is fast enough.
  install: ['env', 'CARGO_PROFILE_DEV_DEBUG=0', 'cargo', 'install', '--debug', '--force', '--root', toolsFolder, `${crate}@${version}`],
});

const aptPackage = (name, check) => ({ name, check, apt: name });

const wasmBindgenVersion = /^wasm-bindgen = "=(.+)"/m.exec(readFileSync(join(root, 'Cargo.toml'), 'utf8'))[1];

/** What a build needs. */
const buildSteps = [
  aptPackage('build-essential', () => onPath('cc')),
  { name: 'rustup', check: () => onPath('rustup') || onPath('cargo'), help: 'install rustup: see https://rustup.rs' },
  { name: 'Rust', check: rustIsNewEnough, install: ['rustup', 'update', 'stable'] },
  { name: 'wasm target', check: hasWasmTarget, install: ['rustup', 'target', 'add', 'wasm32-unknown-unknown'] },
  { name: 'npm packages', check: hasNpmPackages, install: ['npm', 'ci'] },
  cargoTool('wasm-bindgen', 'wasm-bindgen-cli', wasmBindgenVersion),
  cargoTool('wasm-pack', 'wasm-pack', '0.15.1'),
];

/** What the tests need besides. */
const testSteps = [
  { name: 'rustfmt', check: () => succeeds('cargo', 'fmt', '--version'), install: ['rustup', 'component', 'add', 'rustfmt'] },
  { name: 'clippy', check: () => succeeds('cargo', 'clippy', '--version'), install: ['rustup', 'component', 'add', 'clippy'] },
  aptPackage('libvulkan1', () => prints('libvulkan.so.1', '/sbin/ldconfig', '-p')),
  aptPackage('mesa-vulkan-drivers', () => lavapipeManifest() !== undefined),
  aptPackage('chromium', () => onPath('chromium')),
  aptPackage('firefox-esr', () => onPath('firefox-esr')),
];

const canUseApt = () => process.getuid?.() === 0 && existsSync('/usr/bin/apt-get');

/** All missing Debian packages in one go: one list update, one transaction, one line to copy where we may not install. */
async function installDebianPackages(packages) {
  const install = ['apt-get', 'install', '-y', '--no-install-recommends', ...packages];
  if (!canUseApt()) throw new StepError(`missing: ${packages.join(', ')}. On Debian run:\n  sudo ${asText(install)}`);
  process.stdout.write(`setup: ${packages.join(', ')} … `);
  const env = { ...environment, DEBIAN_FRONTEND: 'noninteractive' };
  await run(['apt-get', 'update'], { env });
  await run(install, { env });
  console.log('installed');
}

async function installStep({ name, check, install, help }) {
  if (!install) throw new StepError(`setup: ${name} is missing; ${help}`);
  process.stdout.write(`setup: ${name} … `);
  const start = performance.now();
  const { code, output } = await execute(install);
  if (code !== 0 || !(await check())) {
    throw new StepError(`FAILED\n${output.trimEnd()}\n\nsetup could not install ${name}. Run this, then try again:\n  ${asText(install)}`);
  }
  console.log(`installed (${Math.round((performance.now() - start) / 1000)} s)`);
}

/** Checks each step and installs what is missing. `purpose` is 'build' or 'test' (which includes 'build'). */
export async function setup(purpose) {
  const steps = purpose === 'test' ? [...buildSteps, ...testSteps] : buildSteps;
  // Debian packages first: everything else may need the C compiler among them.
  const missing = [];
  for (const step of steps.filter(({ apt }) => apt)) if (!(await step.check())) missing.push(step.apt);
  if (missing.length > 0) await installDebianPackages(missing);
  for (const step of steps.filter(({ apt }) => !apt)) if (!(await step.check())) await installStep(step);
  console.log(`setup: all ${steps.length} present (${steps.map(({ name }) => name).join(', ')})`);
}
