// Every flattened shader through Tint, the other WGSL compiler (naga has seen them in build.rs).
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { create, globals } from 'webgpu';
import { root } from './environment.mjs';
import { StepError, script } from './run.mjs';

// build.rs writes one file per pass here, includes resolved.
const folder = join(root, 'target', 'shaders');

/** What Tint and Dawn say against one shader on a device with WebGPU's default limits: a list of lines. */
async function complaints(device, name, code) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({ label: name, code });
  const { messages } = await module.getCompilationInfo();
  const lines = messages.filter(({ type }) => type === 'error').map((m) => `${name}:${m.lineNum}:${m.linePos}: ${m.message}`);
  if (lines.length === 0 && code.includes('@compute')) {
    // A pipeline shows what the module alone does not: limits on buffers, textures and workgroup memory.
    device.createComputePipeline({ label: name, layout: 'auto', compute: { module } });
  }
  const error = await device.popErrorScope();
  return lines.length === 0 && error ? [`${name}: ${error.message}`] : lines;
}

await script(async () => {
  const names = existsSync(folder) ? readdirSync(folder, { recursive: true }).filter((name) => name.endsWith('.wgsl')).sort() : [];
  if (names.length === 0) throw new StepError('no shaders in target/shaders: build.rs writes them; run cargo build first');
  Object.assign(globalThis, globals);
  // Dawn frees the instance with its last reference, devices and all: keep it for the life of the process.
  globalThis.gpu = create(['backend=null']);
  const adapter = await globalThis.gpu.requestAdapter();
  const device = await adapter.requestDevice();
  const found = [];
  for (const name of names) found.push(...(await complaints(device, name, readFileSync(join(folder, name), 'utf8'))));
  if (found.length > 0) throw new StepError(found.join('\n'));
  console.log(`${names.length} shaders`);
});
// Dawn's threads keep the process alive otherwise.
process.exit();
