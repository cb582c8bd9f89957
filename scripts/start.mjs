// npm start: set up, build, serve, say where.
import { build, dist } from './build.mjs';
import { StepError, script } from './run.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';

function portFromEnvironment() {
  const text = process.env.PORT || '8080';
  const port = Number(text);
  if (!Number.isInteger(port) || port < 0 || port > 65535) throw new StepError(`PORT must be a number from 0 to 65535, not '${text}'`);
  return port;
}

await script(async () => {
  const port = portFromEnvironment();
  await setup('build');
  await build();
  const { url } = await serve(dist, port);
  console.log(`restir is at ${url}`);
});
