// Fetches, compiles and starts the wasm module once: all viewers of a page and their workers share the compiled module.
import init from './pkg/restir.js';

let compiled: Promise<WebAssembly.Module> | undefined;
let started: Promise<unknown> | undefined;

/** Compiles while downloading where the host sends the wasm MIME type, else after the download. */
async function compile(): Promise<WebAssembly.Module> {
  const response = await fetch(new URL('./pkg/restir_bg.wasm', import.meta.url)).catch((error: unknown) => {
    throw { code: 'IO', message: `restir_bg.wasm: ${(error as Error).message}` };
  });
  if (!response.ok) throw { code: 'IO', message: `${response.url}: ${response.status} ${response.statusText}` };
  if (response.headers.get('content-type')?.startsWith('application/wasm')) return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}

/** The compiled module. What failed is tried again by the next call. */
export function compileWasm(): Promise<WebAssembly.Module> {
  compiled ??= compile();
  compiled.catch(() => (compiled = undefined));
  return compiled;
}

/** Resolves when the module's functions can be called. */
export async function startWasm(): Promise<void> {
  const module = await compileWasm();
  started ??= init({ module_or_path: module });
  started.catch(() => (started = undefined));
  await started;
}
