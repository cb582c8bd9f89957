// Fetches and compiles the wasm module once; the page and its workers share the compiled module.

/** Compiles while downloading where the host sends the wasm MIME type, else after the download. */
export async function compileWasm(): Promise<WebAssembly.Module> {
  const response = await fetch(new URL('./pkg/restir_bg.wasm', import.meta.url));
  if (!response.ok) throw { code: 'IO', message: `${response.url}: ${response.status} ${response.statusText}` };
  if (response.headers.get('content-type')?.startsWith('application/wasm')) return WebAssembly.compileStreaming(response);
  return WebAssembly.compile(await response.arrayBuffer());
}
