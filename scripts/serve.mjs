// A static file server for dist/: what any file host does, no more.
import { createReadStream } from 'node:fs';
import { stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { StepError } from './run.mjs';

const types = {
  '.css': 'text/css; charset=utf-8',
  '.csv': 'text/csv; charset=utf-8',
  '.glb': 'model/gltf-binary',
  '.gltf': 'model/gltf+json',
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.json': 'application/json',
  '.png': 'image/png',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
  '.webp': 'image/webp',
  '.wgsl': 'text/plain; charset=utf-8',
};

/** The file that a request names, or undefined. `base` is the path under which the folder is served. */
async function resolve(folder, base, url) {
  let path;
  try {
    path = decodeURIComponent(new URL(url, 'http://localhost').pathname);
  } catch {
    return undefined;
  }
  if (!path.startsWith(base) || path.includes('\0')) return undefined;
  // Normalising an absolute path removes every '..' that would lead out of the folder.
  const name = normalize(`/${path.slice(base.length)}`);
  const file = join(folder, name.endsWith('/') ? `${name}index.html` : name);
  const found = await stat(file).catch(() => undefined);
  return found?.isFile() ? { file, size: found.size } : undefined;
}

/**
 * Serves `folder` on 127.0.0.1 and resolves once it listens. `base` starts and ends with '/'; port 0 takes a free one.
 * Resolves to the URL of the page and a function that stops the server.
 */
export function serve(folder, port, base = '/') {
  const server = createServer(async (request, response) => {
    const found = ['GET', 'HEAD'].includes(request.method) ? await resolve(folder, base, request.url) : undefined;
    if (!found) {
      response.writeHead(404, { 'content-type': 'text/plain' }).end('not found\n');
      return;
    }
    const type = types[extname(found.file)] ?? 'application/octet-stream';
    response.writeHead(200, { 'content-type': type, 'content-length': found.size, 'cache-control': 'no-cache' });
    if (request.method === 'HEAD') response.end();
    else createReadStream(found.file).on('error', () => response.destroy()).pipe(response);
  });
  return new Promise((resolvePromise, reject) => {
    server.once('error', (error) => {
      const why = error.code === 'EADDRINUSE' ? 'is in use; choose another: PORT=8081 npm start' : `cannot be used: ${error.message}`;
      reject(new StepError(`port ${port} ${why}`));
    });
    server.listen(port, '127.0.0.1', () => {
      const close = () => new Promise((done) => (server.close(done), server.closeAllConnections()));
      resolvePromise({ url: `http://localhost:${server.address().port}${base}`, close });
    });
  });
}
